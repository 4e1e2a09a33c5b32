#include "levelset/motion/slivers.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/parallel.h"
#include "levelset/grid/carry.h"
#include "levelset/grid/exposure.h"
#include "levelset/motion/recession.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 8;

/// Thickest sliver, in spacings.
constexpr float sliver_thickness = 0.25F;

/// New phi of a node.
struct NewPhi {
  std::size_t leaf;
  int offset;
  float phi;
};

class Slivers {
 public:
  Slivers(const Layers& layers, const SpeedField& field, const LeafValues& moved)
      : layers_(layers), band_(layers.top().band()), moved_(moved), is_slow_(slow_layers(field)) {}

  void find_in_leaf(std::size_t n, std::vector<NewPhi>& found) const {
    for_each_node(candidates(n), [&](int offset) {
      const Node node = node_at(band_.leaves()[n], offset);
      if (find_foot(node, found)) return;
      if (const auto below = seen_below_sliver(node)) lay_bare(node, *below, 0, found);
    });
  }

 private:
  /// Nodes next to a slow layer that have not grown, with something left above it.
  LeafMask candidates(std::size_t n) const {
    const Leaf& leaf = band_.leaves()[n];
    const float* const moved = moved_[n];
    const auto [i, j, k] = leaf.origin;
    LeafMask nodes{};
    for (std::size_t layer = 0; layer + 1 < is_slow_.size(); ++layer) {
      if (!is_slow_[layer]) continue;
      const Band& band = layers_.stack[layer].phi.band();
      const int found = band.find(i >> 3, j >> 3, k >> 3);
      if (found < 0) continue;
      const float* const phi = band.leaves()[static_cast<std::size_t>(found)].phi;
      for (int node = 0; node < leaf_size; ++node) {
        const float left = phi[node] - moved[node];
        const std::uint64_t is_one = std::uint64_t{left > 0} & std::uint64_t{left < 1} &
                                     std::uint64_t{std::abs(phi[node]) < 1} &
                                     std::uint64_t{!(moved[node] < leaf.phi[node])};
        nodes[node >> 6] |= is_one << (node & 63);
      }
    }
    return nodes;
  }

  float phi(std::size_t layer, const Node& node) const {
    return layers_.stack[layer].phi.node(node[0], node[1], node[2]);
  }
  float old_phi(const Node& node) const { return band_.node(node[0], node[1], node[2]); }
  float new_phi(const Node& node) const { return value_at(band_, moved_, node); }

  static Node next(const Node& node, int axis, int step) {
    Node other = node;
    other[axis] += step;
    return other;
  }

  /// The slow layer that is seen on all cut edges of a node with next to nothing left above it.
  std::optional<std::size_t> seen_below_sliver(const Node& node) const {
    const float here = old_phi(node);
    std::optional<std::size_t> seen;
    for (int face = 0; face < 6; ++face) {
      const int axis = face / 2;
      const int step = face % 2 == 0 ? -1 : 1;
      const Node other = next(node, axis, step);
      const float there = old_phi(other);
      if ((here < 0) == (there < 0)) continue;
      const std::size_t layer = exposed_layer(layers_, step < 0 ? other : node, axis);
      const float left = crossing(here, there) - crossing(phi(layer, node), phi(layer, other));
      if (!is_slow_[layer] || std::abs(left) > sliver_thickness) return std::nullopt;
      seen = std::max(seen.value_or(layer), layer);
    }
    return seen;
  }

  /// Whether a node in a slow layer is the foot of a sheet of which no node is left. Of that
  /// as much remains above it as its flanks have still to go.
  bool find_foot(const Node& node, std::vector<NewPhi>& found) const {
    if (!(old_phi(node) < 0)) return false;
    const std::size_t layer = layer_at(layers_, node);
    if (!is_slow_[layer]) return false;
    std::optional<float> least;
    for (int face = 0; face < 6; ++face) {
      const int axis = face / 2;
      const Node last = next(node, axis, face % 2 == 0 ? -1 : 1);
      if (!(old_phi(last) < 0) || new_phi(last) < 0) continue;
      const std::optional<float> left = left_of_sheet(node, last, axis);
      if (!left) continue;
      lay_bare(last, layer, *left, found);
      lay_bare_beside(node, last, axis, layer, *left, found);
      least = std::min(least.value_or(*left), *left);
    }
    if (least) lay_bare(node, layer, *least, found);
    return least.has_value();
  }

  /// How far the flanks have to go of a sheet that ends in the cell beside its last node; nothing
  /// if this is none: gas to two sides of the node, and no more than a spacing left below that.
  std::optional<float> left_of_sheet(const Node& foot, const Node& last, int axis) const {
    const auto has_ended = [&](int across, int step) {
      Node below = next(foot, across, step);
      Node beside = next(last, across, step);
      if (old_phi(beside) < 0 && !(new_phi(beside) < 0)) {
        // The middle lies between two nodes that turn to gas at once.
        below = next(below, across, step);
        beside = next(beside, across, step);
      }
      const float here = old_phi(below);
      if (old_phi(beside) < 0) return false;
      if (!(here < 0)) return true;
      const std::size_t layer = layer_at(layers_, below);
      return is_slow_[layer] && phi(layer, below) - here < 1;
    };
    std::optional<float> least;
    for (int across = 0; across < 3; ++across) {
      if (across == axis || !has_ended(across, -1) || !has_ended(across, 1)) continue;
      const float beside =
          std::min(new_phi(next(last, across, -1)), new_phi(next(last, across, 1)));
      const float left = std::max(0.5F * (1 - new_phi(last) - beside), 0.0F);
      least = std::min(least.value_or(left), left);
    }
    return least;
  }

  /// What the flanks left below them beside the last node of a sheet, less than a spacing ago, goes
  /// with it.
  void lay_bare_beside(const Node& foot, const Node& last, int axis, std::size_t below,
                       float thickness, std::vector<NewPhi>& found) const {
    for (int across = 0; across < 3; ++across) {
      for (const int step : {-1, 1}) {
        const Node gas = next(last, across, step);
        if (across == axis || old_phi(gas) < 0 || !(new_phi(gas) < 1)) continue;
        lay_bare(gas, below, thickness, found);
        lay_bare(next(foot, across, step), below, thickness, found);
      }
    }
  }

  /// Leaves no more than the given thickness above a layer at a node, unless what lies there is
  /// slow.
  void lay_bare(const Node& node, std::size_t below, float thickness,
                std::vector<NewPhi>& found) const {
    const float moved = new_phi(node);
    float bare = moved;
    for (std::size_t layer = layers_.stack.size() - 1; layer > below; --layer) {
      const float phi_below = phi(layer - 1, node);
      if (!(phi_below > bare)) continue;
      if (is_slow_[layer]) return;
      bare = phi_below;
    }
    bare -= thickness;
    const int leaf =
        band_.find(band_.fold(0, node[0]) >> 3, band_.fold(1, node[1]) >> 3, node[2] >> 3);
    if (leaf < 0 || !(bare > moved) || (bare < 0) != (moved < 0)) return;
    const int offset = leaf_offset(band_.fold(0, node[0]), band_.fold(1, node[1]), node[2]);
    found.push_back({static_cast<std::size_t>(leaf), offset, bare});
  }

  const Layers& layers_;
  const Band& band_;
  const LeafValues& moved_;
  std::vector<bool> is_slow_;
};

}  // namespace

void clear_slivers(const Layers& layers, const SpeedField& field, LeafValues& moved) {
  const Slivers slivers(layers, field, moved);
  const std::size_t count = layers.top().band().leaves().size();
  std::vector<std::vector<NewPhi>> found((count + grain - 1) / grain);
  parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) slivers.find_in_leaf(n, found[begin / grain]);
  });
  for (const std::vector<NewPhi>& each : found)
    for (const auto& [leaf, offset, phi] : each)
      moved[leaf][offset] = std::max(moved[leaf][offset], phi);
}

}  // namespace scarp
