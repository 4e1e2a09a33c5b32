#include "levelset/motion/edge_facets.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/grid/band.h"
#include "levelset/grid/exposure.h"
#include "levelset/grid/stencil.h"
#include "levelset/motion/slow_planes.h"

namespace scarp {

namespace {

/// Nodes within this of an edge along each axis are looked at, in spacings.
constexpr int reach = 6;

/// The facet has a shape of its own once the crystal is that much higher than the mask, in
/// spacings.
constexpr double most_height = 5;

/// The crystal's top is looked for between these distances from the edge, in spacings.
constexpr double nearest_top = 1;
constexpr double furthest_top = 4.5;

/// In narrower openings, in spacings, facets meet before they are released: the crystal's height
/// tells nothing of the time then.
constexpr double least_width = 8;

/// An edge holds nodes less than this from it along its line, over the mask and over the opening.
constexpr double held_over_mask = 3;
constexpr double own = 1;

/// Edges further from a node than the nearest one by more than this do not hold it: those on the
/// other side of a line.
constexpr double room = 0.5;

/// A crystal that is further out than that, or further behind, in spacings, has come another way.
constexpr double most_ahead = 0.3;
constexpr float most_behind = 0.3F;

constexpr Vec3d up{0, 0, 1};

/// Planes that are in front of another one by less than that have a part of its facet, in spacings.
constexpr double in_front = 1e-3;

/// The planes that begin at edges with one direction aside.
struct Fan {
  Vec3d aside{};
  std::vector<CrystalPlane> planes{};
};

/// How far a place is in front of the plane that is nearest to it of those behind which the crystal
/// is.
struct Front {
  double distance = 0;
  const CrystalPlane* plane = nullptr;
};

/// A place of the line at which the upper surface of a mask ends.
struct Edge {
  Node node{};     ///< the gas node beside
  Vec3d offset{};  ///< from there, in spacings: so differences are those of the mirror image
  Vec3d aside{};   ///< level unit vector away from the mask
  std::size_t mask = 0;
  int below = 0;         ///< index of the highest nodes in the mask
  std::size_t fan = 0;   ///< number of the planes that begin there
  double rate_up = 0;    ///< of the crystal's top
  double time = 0;       ///< since it began, for an amplitude of one
  double amplitude = 0;  ///< of the crystal's speed
};

Vec3d from(const Edge& edge, const Node& node) {
  Vec3d way;
  for (int axis = 0; axis < 3; ++axis)
    way[axis] = static_cast<double>(node[axis] - edge.node[axis]) - edge.offset[axis];
  return way;
}

/// Finds the edges of masks near which something grows.
class EdgeFinder {
 public:
  EdgeFinder(const Layers& layers, const SpeedField& field)
      : layers_(layers), field_(field), band_(layers.top().band()) {}

  /// In leaves in which something grows, and those beside: there films are near.
  std::vector<Edge> run() {
    const std::span<const Leaf> leaves = band_.leaves();
    std::vector<bool> grows(leaves.size(), false);
    for (std::size_t n = 0; n < leaves.size(); ++n) {
      for (const AngularSpeed& part : field_.angular) {
        const float* amplitude = &part.amplitude[n * leaf_size];
        grows[n] = grows[n] || std::any_of(amplitude, amplitude + leaf_size,
                                           [](float value) { return value > 0; });
      }
    }
    for (std::size_t n = 0; n < leaves.size(); ++n) {
      const auto& next = band_.neighbours(n);
      const bool is_near = grows[n] || std::ranges::any_of(next, [&](int leaf) {
                             return leaf >= 0 && grows[static_cast<std::size_t>(leaf)];
                           });
      if (!is_near) continue;
      for (std::size_t mask = 1; mask < layers_.stack.size(); ++mask)
        if (field_.is_inert[mask] && !field_.is_inert[mask - 1]) find_in(leaves[n].origin, mask);
    }
    return std::move(edges_);
  }

 private:
  void find_in(const Node& origin, std::size_t mask) {
    const Band& band = layers_.stack[mask].phi.band();
    const int found = band.find(origin[0] >> 3, origin[1] >> 3, origin[2] >> 3);
    if (found < 0) return;
    const Leaf& leaf = band.leaves()[static_cast<std::size_t>(found)];
    for (int offset = 0; offset < leaf_size; ++offset) {
      const float here = leaf.phi[offset];
      if (!(here < 0) || here < -1.01F) continue;
      const Node node = node_at(leaf, offset);
      if (node[0] >= band.node_count(0) || node[1] >= band.node_count(1)) continue;
      const float above = band.node(node[0], node[1], node[2] + 1);
      if (above < 0 || layer_at(layers_, node) != mask) continue;
      for (int axis = 0; axis < 2; ++axis) {
        for (const int step : {-1, 1}) {
          Node beside = node;
          beside[axis] += step;
          if (!(band.node(beside[0], beside[1], beside[2]) < 0))
            add_edge(band, node, beside, axis, step, above, mask);
        }
      }
    }
  }

  /// Between a node of the mask, the highest one there, and gas beside it, which knows the wall:
  /// what lies in the mask near its edge only knows the nearer of the two.
  void add_edge(const Band& band, const Node& node, const Node& gas, int axis, int step,
                float above, std::size_t mask) {
    const float there = band.node(gas[0], gas[1], gas[2]);
    const auto difference = [&](int a, int first, int last) {
      Node low = gas;
      Node high = gas;
      low[a] += first;
      high[a] += last;
      return (static_cast<double>(band.node(high[0], high[1], high[2])) -
              band.node(low[0], low[1], low[2])) /
             (last - first);
    };
    Vec3d slope;
    slope[axis] = step < 0 ? difference(axis, -1, 0) : difference(axis, 0, 1);
    slope[1 - axis] = difference(1 - axis, -1, 1);
    slope.z = difference(2, -1, 0);
    const double level = std::sqrt(slope.x * slope.x + slope.y * slope.y);
    constexpr double least_level = 0.7;  // else it is not the wall that the node knows
    if (level < least_level || slope[axis] * step <= 0) return;
    // A distance has a slope of one, which differences hold to a tenth only.
    const double steep = length(slope);
    Edge edge{.node = gas, .mask = mask, .below = node[2]};
    edge.aside = Vec3d{slope.x / level, slope.y / level, 0};
    // From the wall beside the gas up along it.
    const double height = 1.0 - above;
    edge.offset = -((there * steep + slope.z * height) / level) * edge.aside;
    edge.offset.z = height;
    edges_.push_back(edge);
  }

  const Layers& layers_;
  const SpeedField& field_;
  const Band& band_;
  std::vector<Edge> edges_{};
};

class Edges {
 public:
  Edges(const Layers& layers, std::vector<Edge> edges, const CrystalRates& crystal,
        const std::vector<float>& mobility)
      : layers_(layers),
        crystal_(crystal),
        mobility_(mobility),
        band_(layers.top().band()),
        edges_(std::move(edges)) {}

  std::vector<HeldNode> run(float dt) {
    std::erase_if(edges_, [&](Edge& edge) { return !find_plane(edge); });
    if (edges_.empty()) return {};
    find_distances();
    return held(dt);
  }

 private:
  static constexpr std::size_t missing = std::numeric_limits<std::size_t>::max();

  float phi(std::size_t at) const { return band_.leaves()[at / leaf_size].phi[at % leaf_size]; }

  float mask_phi(std::size_t mask, const Node& node) const {
    return layers_.stack[mask].phi.node(node[0], node[1], node[2]);
  }

  /// Where arrays have a node, if the band has it.
  std::size_t place(const Node& node) const {
    const NodePlace at = band_.place(node);
    return at.is_there() && std::abs(phi(at.index())) < LevelSet::half_width ? at.index() : missing;
  }

  /// Calls visit(node, its place in arrays, the way there from the edge) for the nodes of the band
  /// near an edge, less than most from it along its line.
  template <class Visit>
  void for_each_node_near(const Edge& edge, double most, const Visit& visit) const {
    const Vec3d along = cross(edge.aside, up);
    const int aside = layers_.frame.varies_along(1) ? reach : 0;
    for (int i = edge.node[0] - reach; i <= edge.node[0] + reach; ++i) {
      for (int j = edge.node[1] - aside; j <= edge.node[1] + aside; ++j) {
        for (int k = edge.below - reach; k <= edge.below + reach; ++k) {
          const Node node{i, j, k};
          const Vec3d way = from(edge, node);
          if (!(std::abs(dot(along, way)) < most)) continue;
          const std::size_t at = place(node);
          if (at != missing) visit(node, at, way);
        }
      }
    }
  }

  bool is_wide(const Edge& edge) const {
    const Vec3d along = cross(edge.aside, up);
    constexpr auto most = static_cast<int>(least_width);
    for (int i = edge.node[0] - most; i <= edge.node[0] + most; ++i) {
      for (int j = edge.node[1] - most; j <= edge.node[1] + most; ++j) {
        const Node node{i, j, edge.below};
        const Vec3d way = from(edge, node);
        const double aside = dot(way, edge.aside);
        if (aside > 0 && aside < least_width && std::abs(dot(along, way)) < own &&
            mask_phi(edge.mask, node) < 0)
          return false;
      }
    }
    return true;
  }

  /// Whether the crystal's top is as high as the edge, and a facet begins there.
  bool find_plane(Edge& edge) {
    double top = -std::numeric_limits<double>::max();
    for_each_node_near(edge, own, [&](const Node&, std::size_t at, const Vec3d& way) {
      const double aside = dot(way, edge.aside);
      if (aside < nearest_top || aside > furthest_top) return;
      if (phi(at) < 0) top = std::max(top, way.z);
      if (mobility_[at] == 0 || phi(at) < 0 || phi(at) > 1) return;
      top = std::max(top, way.z - phi(at));
      edge.amplitude = std::max(edge.amplitude, static_cast<double>(mobility_[at]));
    });
    if (top < -1 || top > most_height || !is_wide(edge)) return false;
    edge.rate_up = crystal_.rate(Vec3f(up)).value;
    if (!(edge.rate_up > 0)) return false;
    edge.fan = fan_from(edge.aside);
    if (fans_[edge.fan].planes.empty()) return false;
    edge.time = std::max(top, 0.0) / edge.rate_up;
    double furthest = 0;
    for_each_node_near(edge, own, [&](const Node& node, std::size_t at, const Vec3d& way) {
      if (mobility_[at] == 0 || phi(at) < 0 || phi(at) > 1) return;
      if (phi(at) > mask_phi(edge.mask, node) - same_phi) return;  // the distance to the mask
      furthest = std::max(furthest, front(edge, way, edge.time).distance - phi(at));
    });
    return furthest < most_ahead;
  }

  /// Along a straight edge all ask the same.
  std::size_t fan_from(const Vec3d& aside) {
    if (!fans_.empty() && fans_.back().aside == aside) return fans_.size() - 1;
    fans_.push_back({aside, slow_planes(crystal_, -aside, up)});
    return fans_.size() - 1;
  }

  Front front(const Edge& edge, const Vec3d& way, double time) const {
    Front furthest{.distance = -std::numeric_limits<double>::max()};
    for (const CrystalPlane& plane : fans_[edge.fan].planes) {
      const double distance = dot(way, plane.normal) - plane.rate * time;
      if (distance > furthest.distance) furthest = {distance, &plane};
    }
    return furthest;
  }

  bool holds(const Edge& edge, const Node& node, const Vec3d& way) const {
    if (dot(way, edge.aside) > 0) {
      const Vec3d along = cross(edge.aside, up);
      return std::abs(dot(along, way)) < own;
    }
    return mask_phi(edge.mask, {node[0], node[1], edge.below}) < 0;
  }

  void find_distances() {
    distance_.assign(mobility_.size(), std::numeric_limits<float>::max());
    for (const Edge& edge : edges_) {
      for_each_node_near(edge, held_over_mask, [&](const Node&, std::size_t at, const Vec3d& way) {
        distance_[at] = std::min(distance_[at], static_cast<float>(length(way)));
      });
    }
  }

  std::vector<HeldNode> held(float dt) const {
    std::vector<HeldNode> found;
    for (const Edge& edge : edges_) {
      const double time = edge.time + edge.amplitude * dt;
      for_each_node_near(
          edge, held_over_mask, [&](const Node& node, std::size_t at, const Vec3d& way) {
            if (phi(at) < 0 && mobility_[at] == 0) return;
            if (length(way) > distance_[at] + room) return;
            const Front ahead = front(edge, way, time);
            const auto least = static_cast<float>(ahead.distance);
            if (least < -1 || !holds(edge, node, way)) return;
            const bool is_left_behind =
                mobility_[at] > 0 && phi(at) > least && phi(at) < least + most_behind &&
                is_facet(edge, way - ahead.distance * ahead.plane->normal, time);
            found.push_back({at, std::min(phi(at), least),
                             is_left_behind ? least : std::numeric_limits<float>::max()});
          });
    }
    return merged(std::move(found));
  }

  /// What several edges say of a node, in whatever order they come.
  static std::vector<HeldNode> merged(std::vector<HeldNode> found) {
    std::ranges::sort(found, {}, &HeldNode::at);
    std::vector<HeldNode> each;
    for (const HeldNode& node : found) {
      if (each.empty() || each.back().at != node.at) {
        each.push_back(node);
        continue;
      }
      each.back().least = std::max(each.back().least, node.least);
      each.back().most = std::min(each.back().most, node.most);
    }
    return each;
  }

  /// Whether a place on a plane is one of its facet: no other plane from that edge on is behind it.
  bool is_facet(const Edge& edge, const Vec3d& place, double time) const {
    return place.z > 0 && place.z < edge.rate_up * time &&
           std::ranges::all_of(fans_[edge.fan].planes, [&](const CrystalPlane& plane) {
             return dot(place, plane.normal) < plane.rate * time + in_front;
           });
  }

  const Layers& layers_;
  const CrystalRates& crystal_;
  const std::vector<float>& mobility_;
  const Band& band_;
  std::vector<Edge> edges_;
  std::vector<Fan> fans_{};
  std::vector<float> distance_{};  ///< to the nearest edge
};

}  // namespace

std::vector<HeldNode> edge_facets(const Layers& layers, const SpeedField& field,
                                  const std::vector<float>& mobility, float dt) {
  if (!field.grows_beside_inert || field.angular.size() != 1) return {};
  const CrystalRates* const crystal = field.angular.front().factor.crystal();
  if (crystal == nullptr) return {};
  return Edges(layers, EdgeFinder(layers, field).run(), *crystal, mobility).run(dt);
}

}  // namespace scarp
