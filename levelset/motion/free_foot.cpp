#include "levelset/motion/free_foot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "levelset/grid/band.h"
#include "levelset/grid/carry.h"
#include "levelset/grid/exposure.h"
#include "levelset/grid/stencil.h"
#include "levelset/surface/crease.h"

namespace scarp {

namespace {

/// Nodes within this of a foot along each axis are looked at, in spacings.
constexpr int reach = 5;

/// The mask's surface is asked for its foot from this height above it on, over one spacing: lower
/// down its normal knows the floor.
constexpr float least_height = 1;

/// Feet that are nearer to a convex corner of a mask are left out, in spacings.
constexpr double corner_reach = 4;

/// Feet within so many nodes of a side have an image beyond it.
constexpr int image_reach = 6;

/// Nodes of the crystal this near to its surface tell where the wall has got to, in spacings.
constexpr float next_to_wall = 0.6F;

/// A node takes phi of the plane of the nearest foot, if that is less than this from it along the
/// line of feet. In spacings.
constexpr double own = 1;

/// Nodes less than this from a foot along the line of feet do not pass its plane. Where the edge of
/// a mask bends those beside the foot would run ahead and take the wall along. In spacings.
constexpr double held = 3;

/// Nodes further behind the plane than this are not held: there another opening may be.
constexpr double most_behind = 2;

/// Fast planes that come along the wall are seen so far from the foot, and have come if they are
/// so far ahead of the wall there, or along a bent edge of where it began. In spacings.
constexpr double watched = held + 1;
constexpr double ahead = 0.5;

/// A wall further from the foot does without, in spacings: fewer nodes of it are within reach.
constexpr double most_shift = 1.5;
constexpr double most_straight_shift = 3.5;

/// Feet further apart, or whose directions differ by more than 25 degrees, are not of one edge.
constexpr double apart = 2;
constexpr double least_cosine = 0.9;

/// Directions whose cosine is less than that below one are the same.
constexpr double straight = 1e-6;

/// A wall is taken over from a foot beside if it leaves more than this, in spacings.
constexpr double least_gain = 1e-6;

/// A point of the line from which a mask's surface rises, and the plane of the wall below.
struct Foot {
  Node node{};            ///< of the mask
  Vec3d offset{};         ///< from there, in spacings: so differences are those of the mirror image
  Vec3d aside{};          ///< unit vector along the interface, to where there is no mask
  Vec3d up{};             ///< unit normal of the interface
  Vec3d normal{};         ///< of the wall
  double rate = 0;        ///< of the wall
  double shift = 0;       ///< how far the wall has moved since
  double own_shift = 0;   ///< by the wall that is nearest to the foot
  double most_ahead = 0;  ///< of the plane, of walls beside the foot
  bool is_straight = false;
  bool holds = false;
  std::size_t original = 0;  ///< of an image beyond a side, the foot that it is made from
  int side = 0;              ///< axis of that side
  bool is_mirrored = false;  ///< across it
  bool is_image = false;
};

Vec3d from(const Foot& foot, const Node& node) {
  Vec3d way;
  for (int axis = 0; axis < 3; ++axis)
    way[axis] = static_cast<double>(node[axis] - foot.node[axis]) - foot.offset[axis];
  return way;
}

/// How far a node is above the wall's plane.
double height(const Foot& foot, const Node& node) {
  return dot(foot.normal, from(foot, node)) + foot.shift;
}

/// Finds feet below the cuts of masks' surfaces.
class FootFinder {
 public:
  FootFinder(const Layers& layers, const SpeedField& field, const std::vector<float>& mobility)
      : layers_(layers), field_(field), mobility_(mobility), band_(layers.top().band()) {}

  std::vector<Foot> run() {
    Block block;
    for (std::size_t n = 0; n < band_.leaves().size(); ++n) {
      const Leaf& leaf = band_.leaves()[n];
      gather<1>(
          band_, n, [&](std::size_t m) -> const float* { return band_.leaves()[m].phi; }, block);
      for_each_node(next_to_surface(leaf, block), [&](int offset) {
        const float* here = block.row(offset >> 6, (offset >> 3) & 7) + (offset & 7);
        if (!(*here < 0) || mobility_[n * leaf_size + static_cast<std::size_t>(offset)] != 0)
          return;
        for (int axis = 0; axis < 3; ++axis) {
          for (const int step : {-1, 1}) {
            if (!(here[step * axis_strides[axis]] < 0))
              add_foot_below(node_at(leaf, offset), axis, step);
          }
        }
      });
    }
    return std::move(feet_);
  }

 private:
  float layer_phi(std::size_t layer, const Node& node) const {
    return layers_.stack[layer].phi.node(node[0], node[1], node[2]);
  }

  /// The foot below a cut of a mask's surface, on the edge from a solid node to gas.
  void add_foot_below(const Node& solid, int axis, int step) {
    Node gas = solid;
    gas[axis] += step;
    const Node& lower = step < 0 ? gas : solid;
    const std::size_t mask = exposed_layer(layers_, lower, axis);
    if (mask == 0 || !field_.is_inert[mask] || field_.is_inert[mask - 1]) return;
    const double way =
        crossing(band_.node(solid[0], solid[1], solid[2]), band_.node(gas[0], gas[1], gas[2]));
    const double height = (1 - way) * layer_phi(mask - 1, solid) + way * layer_phi(mask - 1, gas);
    if (height < least_height || height >= least_height + 1) return;

    Vec3d up;
    for (int a = 0; a < 3; ++a) {
      Node before = solid;
      Node behind = solid;
      --before[a];
      ++behind[a];
      up[a] = 0.5 * (layer_phi(mask - 1, behind) - layer_phi(mask - 1, before));
    }
    const double rise = length(up);
    const Vec3d n = cut_normal(band_, lower, axis);
    const Vec3d across = rise * n - (dot(n, up) / rise) * up;
    // Else the mask's surface lies along the interface.
    if (rise < 0.5 || length(across) < 0.5 * rise) return;

    Foot foot{.node = solid, .aside = across / length(across)};
    foot.offset[axis] = step * way;
    // Down along the mask's surface.
    const Vec3d along = up - dot(n, up) * n;
    foot.offset = foot.offset - (height / dot(along, up)) * along;
    foot.up = up / rise;
    feet_.push_back(foot);
  }

  const Layers& layers_;
  const SpeedField& field_;
  const std::vector<float>& mobility_;
  const Band& band_;
  std::vector<Foot> feet_{};
};

/// Feet with their images beyond the sides, by their places.
class FootMap {
 public:
  FootMap(const Frame& frame, std::vector<Foot> feet) : frame_(frame), feet_(std::move(feet)) {
    add_images();
    sort_by_columns();
  }

  /// Those within the domain first, then images.
  std::vector<Foot>& feet() { return feet_; }
  const std::vector<Foot>& feet() const { return feet_; }
  bool empty() const { return feet_.empty(); }

  /// All feet within corner_reach, and some others.
  std::vector<std::size_t> beside(const Foot& foot) const {
    std::vector<std::size_t> found;
    const auto [x, y] = column(foot);
    for (int i = x - 1; i <= x + 1; ++i) {
      for (int j = y - 1; j <= y + 1; ++j) {
        const auto at = columns_.find({i, j});
        if (at != columns_.end()) found.insert(found.end(), at->second.begin(), at->second.end());
      }
    }
    return found;
  }

  /// Gives images the walls of what they are made from, which comes before them.
  void renew_images() {
    for (Foot& image : feet_) {
      if (!image.is_image) continue;
      const Foot& source = feet_[image.original];
      image.normal = source.normal;
      if (image.is_mirrored) image.normal[image.side] = -image.normal[image.side];
      image.rate = source.rate;
      image.shift = source.shift;
    }
  }

 private:
  /// Columns four spacings wide, so what is nearer than corner_reach is in one beside.
  static std::array<int, 2> column(const Foot& foot) {
    const auto part = [&](int axis) {
      return static_cast<int>(std::floor((foot.node[axis] + foot.offset[axis]) / corner_reach));
    };
    return {part(0), part(1)};
  }

  // Feet beyond the sides are beside others, too. Nodes ask only those within.
  void add_images() {
    for (int axis = 0; axis < 2; ++axis) {
      const auto lateral = static_cast<std::size_t>(axis);
      const int cells = frame_.cells[lateral];
      const bool mirrors = frame_.boundary[lateral] == Boundary::reflective;
      const std::size_t count = feet_.size();
      for (const int side : {0, cells}) {
        for (std::size_t f = 0; f < count; ++f) {
          Foot image = feet_[f];
          if (std::abs(image.node[axis] - side) > image_reach || image.node[axis] == side) continue;
          image.node[axis] = mirrors     ? 2 * side - image.node[axis]
                             : side == 0 ? image.node[axis] + cells
                                         : image.node[axis] - cells;
          if (mirrors) mirror(image, axis);
          image.is_image = true;
          image.original = f;
          image.side = axis;
          image.is_mirrored = mirrors;
          feet_.push_back(image);
        }
      }
    }
  }

  static void mirror(Foot& foot, int axis) {
    for (Vec3d* const v : {&foot.offset, &foot.aside, &foot.up, &foot.normal})
      (*v)[axis] = -(*v)[axis];
  }

  void sort_by_columns() {
    columns_.clear();
    for (std::size_t f = 0; f < feet_.size(); ++f) columns_[column(feet_[f])].push_back(f);
  }

  const Frame& frame_;
  std::vector<Foot> feet_;
  std::map<std::array<int, 2>, std::vector<std::size_t>> columns_{};
};

/// The wall that a crystal leaves below the line of a foot.
class SlowestWalls {
 public:
  explicit SlowestWalls(const CrystalRates& crystal) : crystal_(crystal) {}

  /// The normal of the slowest one, of lines between two directions. up: normal of the interface.
  Vec3d between(const Vec3d& first, const Vec3d& last, const Vec3d& up) const {
    const Vec3d middle = first + last;
    const Vec3d half = last - first;
    const auto aside = [&](double part) { return normalized(middle + part * half); };
    const int here = lean(aside(0), up);
    if (dot(first, last) > 1 - straight) return slowest_wall(aside(0), up, here, here);
    // Most walls lean alike all along the way, and are soon found.
    const int there = lean(aside(1), up);
    const int before = lean(aside(-1), up);
    const int least_lean = std::min({before, here, there});
    const int most_lean = std::max({before, here, there});
    const bool alike = most_lean - least_lean <= 2;
    const auto wall = [&](double part) {
      const Vec3d way = aside(part);
      if (alike) return slowest_wall(way, up, least_lean, most_lean);
      const int own_lean = lean(way, up);
      return slowest_wall(way, up, own_lean, own_lean);
    };
    const auto speed = [&](double part) {
      const Vec3d n = wall(part);
      return crystal_.rate(Vec3f(n)).value / length(cross(n, up));
    };
    // From -1 to 1, so that mirror images have the same bits.
    double least = -1;
    double most = 1;
    for (int n = 0; n < 20; ++n) {
      const double third = (most - least) / 3;
      const double below = speed(least + third);
      const double above = speed(most - third);
      if (below <= above) most -= third;
      if (above <= below) least += third;
    }
    return wall(0.5 * (least + most));
  }

 private:
  // Of the planes through a line along the foot, the one counts that undercuts the mask most
  // slowly. They lean by s = tan(angle to the interface / 2): sines would differ from machine to
  // machine.

  static constexpr int half_leans = 48;

  static double lean_of(int n) {
    return n <= half_leans ? static_cast<double>(n) / half_leans
                           : half_leans / static_cast<double>(2 * half_leans - n);
  }

  static Vec3d leaning(const Vec3d& aside, const Vec3d& up, double s) {
    return (1 / (1 + s * s)) * ((2 * s) * aside + (1 - s * s) * up);
  }

  double undercut(const Vec3d& aside, const Vec3d& up, double s) const {
    return crystal_.rate(Vec3f(leaning(aside, up, s))).value * ((1 + s * s) / s);
  }

  int lean(const Vec3d& aside, const Vec3d& up) const {
    int best = 2;
    double least = undercut(aside, up, lean_of(best));
    for (int n = 3; n < 2 * half_leans - 1; ++n) {
      const double here = undercut(aside, up, lean_of(n));
      if (here < least) best = n;
      least = std::min(least, here);
    }
    return best;
  }

  /// Between the neighbours of two leans.
  Vec3d slowest_wall(const Vec3d& aside, const Vec3d& up, int first, int last) const {
    double least = lean_of(first - 1);
    double most = lean_of(last + 1);
    for (int n = 0; n < 30; ++n) {
      const double third = (most - least) / 3;
      const bool is_lower = undercut(aside, up, least + third) < undercut(aside, up, most - third);
      (is_lower ? most : least) += is_lower ? -third : third;
    }
    return leaning(aside, up, 0.5 * (least + most));
  }

  const CrystalRates& crystal_;
};

bool is_straight(const FootMap& map, const Foot& foot) {
  return std::ranges::all_of(map.beside(foot), [&](std::size_t f) {
    return dot(foot.aside, map.feet()[f].aside) > 1 - straight;
  });
}

/// The directions between which those of the edge of an opening lie that are nearer to this foot
/// than to others. Planes of all of them begin there, and the slowest is left: that of one foot
/// alone would be a plane that etches fast unless the foot lies in the right place.
std::array<Vec3d, 2> asides(const FootMap& map, const Foot& foot) {
  const Vec3d along = cross(foot.aside, foot.up);
  std::array<Vec3d, 2> ends{foot.aside, foot.aside};
  std::array<double, 2> nearest{apart, apart};
  for (const std::size_t f : map.beside(foot)) {
    const Foot& other = map.feet()[f];
    const Vec3d way = from(foot, other.node) + other.offset;
    const double step = dot(along, way);
    const std::size_t side = step < 0 ? 0 : 1;
    const bool bends_around_opening = dot(way, other.aside - foot.aside) < 0;
    if (step == 0 || !(std::abs(step) < nearest[side]) || dot(way, way) > apart * apart ||
        !bends_around_opening || dot(foot.aside, other.aside) < least_cosine)
      continue;
    nearest[side] = std::abs(step);
    ends[side] = normalized(foot.aside + other.aside);
  }
  return ends;
}

void find_walls(FootMap& map, const CrystalRates& crystal) {
  const SlowestWalls slowest(crystal);
  // Along a straight edge all feet ask the same.
  std::array<Vec3d, 3> asked{};
  Vec3d normal;
  for (Foot& foot : map.feet()) {
    if (foot.is_image) continue;
    const std::array<Vec3d, 2> ends = asides(map, foot);
    const std::array<Vec3d, 3> asks{ends[0], ends[1], foot.up};
    foot.is_straight = is_straight(map, foot);
    if (asks != asked) normal = slowest.between(ends[0], ends[1], foot.up);
    asked = asks;
    foot.normal = normal;
    foot.rate = crystal.rate(Vec3f(foot.normal)).value;
  }
}

/// A mask has a convex corner where a foot lies behind the line along another one.
std::vector<Foot> without_corners(const FootMap& map) {
  constexpr double least_behind = 0.5;
  std::vector<Foot> kept;
  for (const Foot& foot : map.feet()) {
    if (foot.is_image) continue;
    const bool is_at_corner = std::ranges::any_of(map.beside(foot), [&](std::size_t f) {
      const Foot& other = map.feet()[f];
      const Vec3d way = from(foot, other.node) + other.offset;
      return dot(way, way) < corner_reach * corner_reach && dot(way, foot.aside) < -least_behind &&
             dot(foot.aside, other.aside) > -0.5;
    });
    if (!is_at_corner) kept.push_back(foot);
  }
  return kept;
}

/// Around an opening the walls that etch slowly spread along its edge: where the wall of a foot
/// would pass that of one beside it the latter is what is left. Walls are handed on from foot to
/// foot, as long as something changes.
void take_slower_walls(FootMap& map) {
  constexpr int most_rounds = 100;
  bool changes = true;
  for (int round = 0; changes && round < most_rounds; ++round) {
    changes = false;
    map.renew_images();
    const std::vector<Foot> before = map.feet();
    for (std::size_t f = 0; f < before.size(); ++f) {
      const Foot& here = before[f];
      if (here.is_image) continue;
      double least = here.shift - least_gain;
      const Foot* taken = nullptr;
      for (const std::size_t other : map.beside(here)) {
        const Foot& foot = before[other];
        const Vec3d way = from(foot, here.node) + here.offset;
        if (dot(way, way) > apart * apart || dot(foot.aside, here.aside) < least_cosine) continue;
        const double there = dot(foot.normal, way) + foot.shift;
        if (there < least || (there == least && taken != nullptr && foot.rate < taken->rate)) {
          least = there;
          taken = &foot;
        }
      }
      if (taken == nullptr || least < 0) continue;
      map.feet()[f].normal = taken->normal;
      map.feet()[f].rate = taken->rate;
      map.feet()[f].shift = least;
      changes = true;
    }
  }
  for (Foot& foot : map.feet()) {
    const double start = foot.is_straight ? foot.own_shift : 0;
    const double most = foot.is_straight ? most_straight_shift : most_shift;
    foot.holds = foot.shift <= most && foot.most_ahead - start <= ahead;
  }
}

/// The nodes of the band around feet.
class FootNodes {
 public:
  FootNodes(const Layers& layers, const std::vector<float>& mobility, FootMap& map)
      : mobility_(mobility), band_(layers.top().band()), map_(map) {
    find_distances();
  }

  /// How far walls have moved from their feet.
  void find_shifts() {
    for (Foot& foot : map_.feet()) {
      if (foot.is_image) continue;
      double shift = 0;
      double own_shift = 0;
      double most_ahead = 0;
      for_each_node_near(foot, watched, [&](const Node& node, std::size_t at, double way) {
        if (mobility_[at] == 0 || !(phi(at) < 0) || phi(at) < -next_to_wall) return;
        const double past = phi(at) - height(foot, node);
        double& most = way < held ? shift : most_ahead;
        most = std::max(most, past);
        if (way < own) own_shift = std::max(own_shift, past);
      });
      foot.shift = shift;
      foot.own_shift = own_shift;
      foot.most_ahead = most_ahead;
    }
  }

  /// What nodes take from the walls of feet.
  FreeFoot values(float dt) const {
    FreeFoot free{
        .phi = std::vector<float>(mobility_.size(), std::numeric_limits<float>::quiet_NaN()),
        .most = std::vector<float>(mobility_.size(), std::numeric_limits<float>::max())};
    for (const Foot& foot : map_.feet()) {
      if (foot.is_image || !foot.holds) continue;
      for_each_node_near(foot, held, [&](const Node& node, std::size_t at, double way) {
        const auto plane = static_cast<float>(height(foot, node));
        const bool is_masked = mobility_[at] == 0;
        if (!is_masked && plane > -most_behind) {
          const float most =
              std::max(plane, phi(at)) + static_cast<float>(foot.rate) * mobility_[at] * dt;
          free.most[at] = std::min(free.most[at], most);
        }
        if (!(way < own) || !is_nearest(foot, node, at)) return;
        // Of two that are as near the one that leaves more counts, in whatever order they come.
        if (is_masked || is_behind(foot, node, at, plane)) {
          const float there = is_masked ? std::min(plane, most_beside(node)) : plane;
          free.phi[at] = std::isnan(free.phi[at]) ? there : std::min(free.phi[at], there);
        }
      });
    }
    return free;
  }

 private:
  static constexpr std::size_t missing = std::numeric_limits<std::size_t>::max();

  float phi(std::size_t at) const { return band_.leaves()[at / leaf_size].phi[at % leaf_size]; }

  /// Where arrays have a node, if the band has it.
  std::size_t place(const Node& node) const {
    const NodePlace at = band_.place(node);
    return at.is_there() && std::abs(phi(at.index())) < LevelSet::half_width ? at.index() : missing;
  }

  /// Calls visit(node, its place in arrays, its distance from the foot along the line of feet) for
  /// the nodes of the band near a foot, less than most from it along that line. Nodes beyond the
  /// sides are given as they lie, their places are those of their images.
  template <class Visit>
  void for_each_node_near(const Foot& foot, double most, const Visit& visit) const {
    const Vec3d along = cross(foot.aside, foot.up);
    for (int i = foot.node[0] - reach; i <= foot.node[0] + reach; ++i) {
      for (int j = foot.node[1] - reach; j <= foot.node[1] + reach; ++j) {
        const int base = foot.node[2] + static_cast<int>(std::lround(foot.offset.z));
        for (int k = base - reach; k <= base + reach; ++k) {
          const Node node{i, j, k};
          const double way = std::abs(dot(along, from(foot, node)));
          if (!(way < most)) continue;
          const std::size_t at = place(node);
          if (at != missing) visit(node, at, way);
        }
      }
    }
  }

  void find_distances() {
    distance_.assign(mobility_.size(), std::numeric_limits<float>::max());
    for (const Foot& foot : map_.feet()) {
      if (foot.is_image) continue;
      for_each_node_near(foot, own, [&](const Node& node, std::size_t at, double) {
        const Vec3d way = from(foot, node);
        distance_[at] = std::min(distance_[at], static_cast<float>(dot(way, way)));
      });
    }
  }

  bool is_nearest(const Foot& foot, const Node& node, std::size_t at) const {
    const Vec3d way = from(foot, node);
    return static_cast<float>(dot(way, way)) == distance_[at];
  }

  /// Whether a node of the crystal only knows the foot: the way there leans more than the wall.
  bool is_behind(const Foot& foot, const Node& node, std::size_t at, float plane) const {
    if (!(phi(at) < 0) || phi(at) > plane) return false;
    const Vec3d way = from(foot, node);
    return -dot(way, foot.aside) > dot(foot.normal, foot.aside) * length(way);
  }

  /// A distance is no more than one more than that of a neighbour.
  float most_beside(const Node& node) const {
    float most = LevelSet::half_width;
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        Node next = node;
        next[axis] += step;
        const std::size_t at = place(next);
        if (at != missing && mobility_[at] != 0) most = std::min(most, phi(at) + 1);
      }
    }
    return most;
  }

  const std::vector<float>& mobility_;
  const Band& band_;
  FootMap& map_;
  std::vector<float> distance_{};  ///< squares of those to the nearest foot
};

FreeFoot foot_of_crystal(const Layers& layers, const SpeedField& field, const CrystalRates& crystal,
                         const std::vector<float>& mobility, float dt) {
  FootMap all(layers.frame, FootFinder(layers, field, mobility).run());
  find_walls(all, crystal);
  FootMap map(layers.frame, without_corners(all));
  if (map.empty()) return {};
  FootNodes nodes(layers, mobility, map);
  nodes.find_shifts();
  take_slower_walls(map);
  return nodes.values(dt);
}

}  // namespace

FreeFoot free_foot(const Layers& layers, const SpeedField& field,
                   const std::vector<float>& mobility, float dt) {
  if (!etches_crystal(field)) return {};
  for (const AngularSpeed& part : field.angular) {
    if (const CrystalRates* crystal = part.factor.crystal())
      return foot_of_crystal(layers, field, *crystal, mobility, dt);
  }
  return {};
}

}  // namespace scarp
