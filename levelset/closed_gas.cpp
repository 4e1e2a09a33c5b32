#include "levelset/closed_gas.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "core/triangle_tree.h"
#include "levelset/band.h"
#include "levelset/carry.h"
#include "levelset/extract_surface.h"
#include "levelset/phase_graph.h"
#include "levelset/redistance.h"
#include "levelset/resample.h"

namespace scarp {

namespace {

constexpr float far = LevelSet::half_width;

/// A flat surface above all leaves of a band, and a height between.
struct Lid {
  LevelSet phi;
  double below;
};

Lid lid_above(const Band& band) {
  const auto& leaves = band.leaves();
  const auto highest =
      std::max_element(leaves.begin(), leaves.end(),
                       [](const Leaf& a, const Leaf& b) { return a.origin[2] < b.origin[2]; });
  // In the middle of leaves that have none of the band next to them: one leaf per column holds it.
  const double leaf = leaf_edge * band.frame().spacing;
  const double end = highest->origin[2] * band.frame().spacing + leaf;
  const double height = end + 1.5 * leaf - 0.5 * band.frame().spacing;
  return {{band.frame(), [height](Vec3d r) { return r.z - height; }, height, height},
          end + 0.75 * leaf};
}

/// phi of a node, to be put into another band.
struct NodeValue {
  Node node{};
  float phi = 0;
};

/// The gas of voids and the solid next to it; what is not next to their surface is far from it.
std::vector<NodeValue> nodes_of_voids(const Band& band, const PhaseGraph& gas) {
  std::vector<NodeValue> values;
  const auto add = [&](const Leaf& leaf, int offset) {
    const Node node = node_at(leaf, offset);
    bool is_next_to_solid = false;
    for (int face = 0; face < 6; ++face) {
      Node other = node;
      other[face / 2] += face % 2 == 0 ? -1 : 1;
      const float phi = band.node(other[0], other[1], other[2]);
      if (!(phi < 0)) continue;
      is_next_to_solid = true;
      for (int axis = 0; axis < 2; ++axis) other[axis] = band.fold(axis, other[axis]);
      values.push_back({other, phi});
    }
    values.push_back({node, is_next_to_solid ? leaf.phi[offset] : far});
  };
  for (std::size_t n = 0; n < band.leaves().size(); ++n) {
    for (const LeafPiece& piece : gas.pieces(n)) {
      if (piece.region == 0) continue;
      for_each_node(piece.nodes, [&](int offset) { add(band.leaves()[n], offset); });
    }
  }
  return values;
}

/// Solid, where a band has no leaves yet.
void add_leaves(const std::vector<NodeValue>& values, Band& band) {
  std::vector<NewLeaf> added;
  for (const auto& [node, phi] : values)
    added.push_back({.origin = {node[0] & ~7, node[1] & ~7, node[2] & ~7}, .solid = true});
  std::sort(added.begin(), added.end());
  added.erase(std::unique(added.begin(), added.end()), added.end());
  band.change_leaves(added, {});
}

void set(std::span<const NodeValue> values, Band& band) {
  for (const auto& [node, phi] : values) {
    const int leaf = band.find(node[0] >> 3, node[1] >> 3, node[2] >> 3);
    if (leaf < 0) continue;
    band.leaves()[static_cast<std::size_t>(leaf)].phi[leaf_offset(node[0], node[1], node[2])] = phi;
  }
}

/// Calls visit(phi, place) for the nodes of a band that lie below a height, on all threads.
template <class Visit>
void for_each_node_below(double height, Band& band, const Visit& visit) {
  const Frame& frame = band.frame();
  parallel_for(band.leaves().size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const Leaf& leaf = band.leaves()[n];
      for (int offset = 0; offset < leaf_size; ++offset) {
        const Vec3d r(frame.node_position(node_at(leaf, offset)));
        if (r.z < height) visit(leaf.phi[offset], r);
      }
    }
  });
}

OpenGas all_but_the_source(const Band& band) {
  const PhaseGraph graph(band, Phase::gas);
  OpenGas gas;
  gas.open = graph.nodes_where([](const LeafPiece& piece) { return piece.region != 0; });
  return gas;
}

}  // namespace

ClosedGas closed_gas(const Band& band, const PhaseGraph& gas) {
  std::vector<NodeValue> values = nodes_of_voids(band, gas);
  auto [phi, height] = lid_above(band);
  Band& rebuilt = phi.band();
  add_leaves(values, rebuilt);
  set(values, rebuilt);
  // For its leaves: upwind differences are off beyond edges, by up to .3 spacings.
  redistance_fully(rebuilt);

  // Where all else is far nothing tells of edges, and the surface is cut straight.
  for_each_node_below(height, rebuilt, [](float& phi, Vec3d) { phi = std::copysign(far, phi); });
  set(values, rebuilt);
  const TriangleTree straight(extract_surface(phi, all_but_the_source(rebuilt)));
  const Sides sides = band.frame().sides();
  for_each_node_below(height, rebuilt, [&](float& phi, Vec3d r) {
    const double distance = distance_to(straight, sides, r) / band.frame().spacing;
    phi = off_surface(std::copysign(static_cast<float>(std::min<double>(distance, far)), phi));
  });
  std::erase_if(values, [](const NodeValue& each) { return each.phi == far; });
  set(values, rebuilt);
  OpenGas voids = all_but_the_source(rebuilt);
  return {std::move(phi), std::move(voids)};
}

}  // namespace scarp
