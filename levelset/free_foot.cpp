#include "levelset/free_foot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "levelset/band.h"
#include "levelset/carry.h"
#include "levelset/crease.h"
#include "levelset/exposure.h"
#include "levelset/stencil.h"

namespace scarp {

namespace {

/// Nodes within this of a foot along each axis are looked at, in spacings: differences to
/// neighbours of what the wall passes in its first two spacings reach so far.
constexpr int reach = 3;

/// The mask's surface is asked for its foot from this height above it on, over one spacing: lower
/// down its normal knows the floor.
constexpr float least_height = 1;

/// Feet that are nearer to a convex corner of a mask are left out, in spacings.
constexpr double corner_reach = 4;

/// Nodes of the crystal this near to its surface tell where the wall has got to, in spacings.
constexpr float next_to_wall = 0.6F;

/// A foot holds nodes that are less than this from it along the line of feet, and is told of what
/// happens to the wall by those less than that, in spacings.
constexpr double own = 1;
constexpr double beside = 2;

/// A wall further from the foot does without, in spacings.
constexpr double most_shift = 0.15;

/// A point of the line from which a mask's surface rises, and the plane of the wall below.
struct Foot {
  Node node{};       ///< of the mask
  Vec3d offset{};    ///< from there, in spacings: so differences are those of the mirror image
  Vec3d aside{};     ///< unit vector along the interface, to where there is no mask
  Vec3d normal{};    ///< of the wall
  double rate = 0;   ///< of the wall
  double shift = 0;  ///< how far the wall has moved since
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

class Feet {
 public:
  Feet(const Layers& layers, const SpeedField& field, const CrystalRates& crystal,
       const std::vector<float>& mobility)
      : layers_(layers),
        field_(field),
        crystal_(crystal),
        mobility_(mobility),
        band_(layers.top().band()) {}

  FreeFoot run(float dt) {
    find();
    leave_out_corners();
    if (feet_.empty()) return {};
    find_distances();
    find_shifts();
    return values(dt);
  }

 private:
  static constexpr std::size_t missing = std::numeric_limits<std::size_t>::max();

  float phi(std::size_t at) const { return band_.leaves()[at / leaf_size].phi[at % leaf_size]; }

  float layer_phi(std::size_t layer, const Node& node) const {
    return layers_.stack[layer].phi.node(node[0], node[1], node[2]);
  }

  /// Where arrays have a node, if the band has it.
  std::size_t place(const Node& node) const {
    const int x = band_.fold(0, node[0]);
    const int y = band_.fold(1, node[1]);
    const int leaf = band_.find(x >> 3, y >> 3, node[2] >> 3);
    if (leaf < 0) return missing;
    const std::size_t at = static_cast<std::size_t>(leaf) * leaf_size +
                           static_cast<std::size_t>(leaf_offset(x, y, node[2]));
    return std::abs(phi(at)) < LevelSet::half_width ? at : missing;
  }

  void find() {
    Block block;
    for (std::size_t n = 0; n < band_.leaves().size(); ++n) {
      const Leaf& leaf = band_.leaves()[n];
      gather<1>(
          band_, n, [&](std::size_t m) { return band_.leaves()[m].phi; }, block);
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
  }

  /// The foot below a cut of a mask's surface, on the edge from a solid node to gas.
  void add_foot_below(const Node& solid, int axis, int step) {
    Node gas = solid;
    gas[axis] += step;
    const Node& lower = step < 0 ? gas : solid;
    const std::size_t mask = exposed_layer(layers_, lower, axis);
    if (mask == 0 || !field_.stands_still[mask] || field_.stands_still[mask - 1]) return;
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
    foot.normal = slowest_wall(foot.aside, up / rise);
    foot.rate = crystal_.rate(Vec3f(foot.normal)).value;
    feet_.push_back(foot);
  }

  /// Of the planes through a line along the foot, the one that undercuts the mask most slowly.
  Vec3d slowest_wall(Vec3d aside, Vec3d up) const {
    // By s = tan(angle to the interface / 2): sines would differ from machine to machine.
    const auto normal = [&](double s) {
      return (1 / (1 + s * s)) * ((2 * s) * aside + (1 - s * s) * up);
    };
    const auto speed = [&](double s) {
      return crystal_.rate(Vec3f(normal(s))).value * ((1 + s * s) / s);
    };
    constexpr int half = 48;
    const auto place = [](int n) {
      return n <= half ? static_cast<double>(n) / half : half / static_cast<double>(2 * half - n);
    };
    int best = 2;
    for (int n = 3; n < 2 * half - 1; ++n)
      if (speed(place(n)) < speed(place(best))) best = n;
    double least = place(best - 1);
    double most = place(best + 1);
    for (int n = 0; n < 50; ++n) {
      const double third = (most - least) / 3;
      const bool is_lower = speed(least + third) < speed(most - third);
      (is_lower ? most : least) += is_lower ? -third : third;
    }
    return normal(0.5 * (least + most));
  }

  /// A mask has a convex corner where a foot lies behind the line along another one.
  void leave_out_corners() {
    constexpr double least_behind = 0.5;
    std::vector<Foot> kept;
    for (const Foot& foot : feet_) {
      const bool is_at_corner = std::ranges::any_of(feet_, [&](const Foot& other) {
        const Vec3d way = from(foot, other.node) + other.offset;
        return dot(way, way) < corner_reach * corner_reach &&
               dot(way, foot.aside) < -least_behind && dot(foot.aside, other.aside) > -0.5;
      });
      if (!is_at_corner) kept.push_back(foot);
    }
    feet_ = std::move(kept);
  }

  /// Calls visit(node, its place in arrays) for the nodes of the band near a foot, less than beside
  /// from it along the line of feet. Nodes beyond the sides are given as they lie, their places are
  /// those of their images.
  template <class Visit>
  void for_each_node_near(const Foot& foot, double beside, const Visit& visit) const {
    const Vec3d along = normalized(cross(foot.aside, foot.normal));
    for (int i = foot.node[0] - reach; i <= foot.node[0] + reach; ++i) {
      for (int j = foot.node[1] - reach; j <= foot.node[1] + reach; ++j) {
        const int base = foot.node[2] + static_cast<int>(std::lround(foot.offset.z));
        for (int k = base - reach; k <= base + reach; ++k) {
          const std::size_t at = place({i, j, k});
          const Node node{i, j, k};
          if (at != missing && std::abs(dot(along, from(foot, node))) < beside) visit(node, at);
        }
      }
    }
  }

  void find_distances() {
    distance_.assign(mobility_.size(), std::numeric_limits<float>::max());
    for (const Foot& foot : feet_) {
      for_each_node_near(foot, own, [&](const Node& node, std::size_t at) {
        const Vec3d way = from(foot, node);
        distance_[at] = std::min(distance_[at], static_cast<float>(dot(way, way)));
      });
    }
  }

  bool is_nearest(const Foot& foot, const Node& node, std::size_t at) const {
    const Vec3d way = from(foot, node);
    return static_cast<float>(dot(way, way)) == distance_[at];
  }

  /// Also by what is nearest to another foot: what takes the wall away comes from the side.
  void find_shifts() {
    for (Foot& foot : feet_) {
      double shift = 0;
      for_each_node_near(foot, beside, [&](const Node& node, std::size_t at) {
        if (mobility_[at] == 0 || !(phi(at) < 0) || phi(at) < -next_to_wall) return;
        shift = std::max(shift, phi(at) - height(foot, node));
      });
      foot.shift = shift;
    }
  }

  FreeFoot values(float dt) const {
    FreeFoot free{
        .phi = std::vector<float>(mobility_.size(), std::numeric_limits<float>::quiet_NaN()),
        .most = std::vector<float>(mobility_.size(), std::numeric_limits<float>::max())};
    for (const Foot& foot : feet_) {
      if (foot.shift > most_shift) continue;
      for_each_node_near(foot, own, [&](const Node& node, std::size_t at) {
        if (!is_nearest(foot, node, at)) return;
        const auto plane = static_cast<float>(height(foot, node));
        const bool is_masked = mobility_[at] == 0;
        // Of two that are as near the one that leaves more counts, in whatever order they come.
        if (is_masked || is_behind(foot, node, at, plane)) {
          const float there = is_masked ? std::min(plane, most_beside(node)) : plane;
          free.phi[at] = std::isnan(free.phi[at]) ? there : std::min(free.phi[at], there);
        }
        if (!is_masked) {
          const float most =
              std::max(plane, phi(at)) + static_cast<float>(foot.rate) * mobility_[at] * dt;
          free.most[at] = std::min(free.most[at], most);
        }
      });
    }
    return free;
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

  const Layers& layers_;
  const SpeedField& field_;
  const CrystalRates& crystal_;
  const std::vector<float>& mobility_;
  const Band& band_;
  std::vector<Foot> feet_{};
  std::vector<float> distance_{};  ///< squares of those to the nearest foot
};

}  // namespace

FreeFoot free_foot(const Layers& layers, const SpeedField& field,
                   const std::vector<float>& mobility, float dt) {
  if (!etches_crystal(field)) return {};
  for (const AngularSpeed& part : field.angular) {
    if (const CrystalRates* crystal = part.factor.crystal())
      return Feet(layers, field, *crystal, mobility).run(dt);
  }
  return {};
}

}  // namespace scarp
