#include "levelset/motion/recession.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "core/parallel.h"
#include "levelset/grid/carry.h"
#include "levelset/grid/exposure.h"
#include "levelset/grid/stencil.h"

namespace scarp {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr std::size_t grain = 8;

/// Only nodes this near to the surface, in spacings, can be next to it after a time step.
constexpr float near_surface = 2;

/// A layer is slow beside one that recedes faster by this factor.
constexpr float slow = 1.25F;

/// By how much a slow layer may seem to recede faster than it does, as slopes of phi are 1 within
/// a few per cent only.
constexpr float slope_room = 1.03F;

class Recession {
 public:
  Recession(const Layers& layers, const SpeedField& field, float dt)
      : layers_(layers), band_(layers.top().band()), is_slow_(slow_layers(field)) {
    for (const float etch : field.fastest_etch) way_.push_back(dt * (slope_room * etch));
  }

  void limit_leaf(std::size_t n, float* moved) const {
    const LeafMask nodes = too_far(n, moved);
    if (nodes == LeafMask{}) return;
    const Leaf& leaf = band_.leaves()[n];
    for_each_node(nodes, [&](int offset) {
      moved[offset] = limited(node_at(leaf, offset), leaf.phi[offset], moved[offset]);
    });
  }

 private:
  /// phi of a layer at the nodes of a leaf of the top.
  const float* phi_of(std::size_t layer, const Node& origin) const {
    const Band& band = layers_.stack[layer].phi.band();
    const int leaf = band.find(origin[0] >> 3, origin[1] >> 3, origin[2] >> 3);
    return leaf >= 0 ? band.leaves()[static_cast<std::size_t>(leaf)].phi : missing_values(leaf);
  }

  /// Nodes that have risen further beyond a slow layer, where there is one, than that is etched.
  LeafMask too_far(std::size_t n, const float* moved) const {
    const Leaf& leaf = band_.leaves()[n];
    LeafMask nodes{};
    for (std::size_t layer = 0; layer < is_slow_.size(); ++layer) {
      if (!is_slow_[layer]) continue;
      const float* const phi = phi_of(layer, leaf.origin);
      const float* const below =
          layer == 0 ? missing_values(Band::missing_gas) : phi_of(layer - 1, leaf.origin);
      for (int node = 0; node < leaf_size; ++node) {
        const bool is_there = below[node] > phi[node] + same_phi;
        const bool passes = moved[node] > phi[node] + way_[layer];
        const bool rises = moved[node] > leaf.phi[node] && std::abs(leaf.phi[node]) < near_surface;
        const bool found = is_there & passes & rises;
        nodes[node >> 6] |= std::uint64_t{found} << (node & 63);
      }
    }
    return nodes;
  }

  float phi(std::size_t layer, const Node& node) const {
    return layers_.stack[layer].phi.node(node[0], node[1], node[2]);
  }

  /// The layer that is seen at the surface nearest to a node: what lies above it there, going by
  /// phi, has been removed.
  std::size_t seen_from(const Node& node) const {
    const auto seen_next_to = [&](const Node& at) -> std::optional<std::size_t> {
      std::optional<std::size_t> seen;
      float nearest = 2;
      const float here = band_.node(at[0], at[1], at[2]);
      for (int face = 0; face < 6; ++face) {
        Node next = at;
        next[face / 2] += face % 2 == 0 ? -1 : 1;
        const float there = band_.node(next[0], next[1], next[2]);
        if ((here < 0) == (there < 0)) continue;
        const std::size_t layer = exposed_layer(layers_, face % 2 == 0 ? next : at, face / 2);
        const float distance = crossing(here, there);
        if (distance > nearest || (distance == nearest && seen && *seen <= layer)) continue;
        nearest = distance;
        seen = layer;
      }
      return seen;
    };
    if (const auto seen = seen_next_to(node)) return *seen;
    std::optional<std::size_t> lowest;
    float nearest = 0;
    for (int face = 0; face < 6; ++face) {
      Node next = node;
      next[face / 2] += face % 2 == 0 ? -1 : 1;
      const auto seen = seen_next_to(next);
      if (!seen) continue;
      const float distance = std::abs(band_.node(next[0], next[1], next[2]));
      if (lowest && (distance > nearest || (distance == nearest && *seen >= *lowest))) continue;
      nearest = distance;
      lowest = seen;
    }
    return lowest.value_or(0);
  }

  /// The time budget of a point that goes down through the layers: as far as the first slow one,
  /// and on from there as long as it lasts.
  float limited(const Node& node, float old, float wanted) const {
    float at = old;
    float part_left = 1;
    bool meets_slow = false;
    std::size_t layer = seen_from(node);
    for (;; --layer) {
      const float begin = phi(layer, node);
      const float end = layer == 0 ? infinity : phi(layer - 1, node);
      if (!(end > std::max(at, begin + same_phi))) continue;
      if (is_slow_[layer]) {
        meets_slow = true;
        at = std::max(at, begin);
        part_left = std::max(part_left, 0.0F);
      }
      const float part = (end - at) / way_[layer];
      if (layer == 0 || (meets_slow && !(part < part_left))) break;
      part_left -= part;
      at = end;
    }
    const float limit = meets_slow ? at + part_left * way_[layer] : infinity;
    return limit < wanted ? std::min(wanted, std::max(limit, beside(node, old, layer, limit)))
                          : wanted;
  }

  /// How far the surfaces of lower layers come that are open near a node.
  float beside(const Node& node, float old, std::size_t layer, float limit) const {
    float furthest = limit;
    constexpr int reach = 2;
    constexpr float half_edge = 0.5F;  // the surface goes on as far to all sides of a cut
    for (int x = -reach; x <= reach; ++x) {
      for (int y = -reach; y <= reach; ++y) {
        for (int z = -reach; z <= reach; ++z) {
          const Node at{node[0] + x, node[1] + y, node[2] + z};
          const float here = band_.node(at[0], at[1], at[2]);
          if (!(here < 0) || here < -near_surface) continue;
          for (int face = 0; face < 6; ++face) {
            // From solid to gas, so that mirror images have the same bits.
            const auto axis = static_cast<std::size_t>(face / 2);
            const int step = face % 2 == 0 ? -1 : 1;
            Node next = at;
            next[axis] += step;
            const float there = band_.node(next[0], next[1], next[2]);
            if (there < 0) continue;
            const std::size_t seen = exposed_layer(layers_, step < 0 ? next : at, face / 2);
            if (seen >= layer || is_slow_[seen]) continue;
            std::array<float, 3> way{static_cast<float>(x), static_cast<float>(y),
                                     static_cast<float>(z)};
            way[axis] += static_cast<float>(step) * crossing(here, there);
            const float distance = std::sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
            const float nearest = old < 0 ? std::min(half_edge - distance, 0.0F) : distance;
            furthest = std::max(furthest, nearest + way_[seen]);
          }
        }
      }
    }
    return furthest;
  }

  const Layers& layers_;
  const Band& band_;
  std::vector<bool> is_slow_;
  std::vector<float> way_;  ///< of the layers in a time step, in spacings
};

}  // namespace

std::vector<bool> slow_layers(const SpeedField& field) {
  float fastest = 0;
  for (const float etch : field.fastest_etch) fastest = std::max(fastest, etch);
  std::vector<bool> are_slow;
  for (const float etch : field.fastest_etch) are_slow.push_back(slow * etch < fastest);
  return are_slow;
}

bool has_slow_layers(const SpeedField& field) {
  const std::vector<bool> are_slow = slow_layers(field);
  return std::find(are_slow.begin(), are_slow.end(), true) != are_slow.end();
}

void limit_recession(const Layers& layers, const SpeedField& field, float dt, LeafValues& moved) {
  const Recession recession(layers, field, dt);
  parallel_for(layers.top().band().leaves().size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) recession.limit_leaf(n, moved[n]);
  });
}

}  // namespace scarp
