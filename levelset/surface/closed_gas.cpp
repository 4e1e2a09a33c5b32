#include "levelset/surface/closed_gas.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include "levelset/grid/band.h"
#include "levelset/grid/carry.h"
#include "levelset/grid/redistance.h"
#include "levelset/surface/phase_graph.h"

namespace scarp {

namespace {

constexpr float far = LevelSet::half_width;

/// A flat surface above all leaves of a band.
LevelSet lid_above(const Band& band) {
  const auto& leaves = band.leaves();
  const auto highest =
      std::max_element(leaves.begin(), leaves.end(),
                       [](const Leaf& a, const Leaf& b) { return a.origin[2] < b.origin[2]; });
  // In the middle of leaves that have none of the band next to them: one leaf per column holds it.
  constexpr double leaves_above = 2.5;
  const double height =
      (highest->origin[2] + leaves_above * leaf_edge - 0.5) * band.frame().spacing;
  return {band.frame(), [height](Vec3d r) { return r.z - height; }, height, height};
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

void set(const std::vector<NodeValue>& values, Band& band) {
  for (const auto& [node, phi] : values) {
    const int leaf = band.find(node[0] >> 3, node[1] >> 3, node[2] >> 3);
    band.leaves()[static_cast<std::size_t>(leaf)].phi[leaf_offset(node[0], node[1], node[2])] = phi;
  }
}

/// Puts nodes into the solid of a band that has no leaves where they are.
void put(const std::vector<NodeValue>& values, Band& band) {
  std::vector<NewLeaf> added;
  for (const auto& [node, phi] : values)
    added.push_back({.origin = {node[0] & ~7, node[1] & ~7, node[2] & ~7}, .solid = true});
  std::sort(added.begin(), added.end());
  added.erase(std::unique(added.begin(), added.end()), added.end());
  band.change_leaves(added, {});
  set(values, band);
}

/// phi of a solid node beside two others, of which the fourth corner of the face is gas of a void:
/// that of the plane through the three, or, where differences are no gradient of a distance, of an
/// edge that lies as far along either axis. Upwind differences add up both ways around an edge and
/// hide it. across: how much phi of the gas falls along the third axis.
float beyond_edge(float beside, float other, float gas, float across) {
  constexpr float plane = 1.1F;  // squares of the gradient from which on an edge is taken for one
  constexpr float edge = 1.2F;
  const float square = (gas - beside) * (gas - beside) + (gas - other) * (gas - other);
  const float trust = std::clamp((square + across * across - plane) / (edge - plane), 0.0F, 1.0F);
  const float on_plane = beside + other - gas;
  return on_plane + trust * (-std::hypot(beside, other) - on_plane);
}

bool is_next_to_gas(const Band& band, const Node& node) {
  for (int face = 0; face < 6; ++face) {
    Node other = node;
    other[face / 2] += face % 2 == 0 ? -1 : 1;
    if (!(band.node(other[0], other[1], other[2]) < 0)) return true;
  }
  return false;
}

/// Gives such nodes that value, the one nearest to the surface where there are several.
void find_beyond_edges(const std::vector<NodeValue>& voids, Band& band) {
  std::vector<NodeValue> found;
  const auto phi = [&](const Node& node) { return band.node(node[0], node[1], node[2]); };
  for (const auto& [gas, value] : voids) {
    if (value < 0 || value == far) continue;
    for (int axis = 0; axis < 3; ++axis) {
      Node below = gas;
      --below[(axis + 2) % 3];
      Node above = gas;
      ++above[(axis + 2) % 3];
      const float across = std::max(value - std::min(phi(below), phi(above)), 0.0F);
      for (const auto& [step, other_step] :
           {std::array{-1, -1}, std::array{-1, 1}, std::array{1, -1}, std::array{1, 1}}) {
        Node beside = gas;
        beside[axis] += step;
        Node other = gas;
        other[(axis + 1) % 3] += other_step;
        Node node = beside;
        node[(axis + 1) % 3] += other_step;
        if (!(phi(beside) < 0 && phi(other) < 0 && phi(node) < 0)) continue;
        for (int n = 0; n < 2; ++n) node[n] = band.fold(n, node[n]);
        found.push_back({node, beyond_edge(phi(beside), phi(other), value, across)});
      }
    }
  }
  std::sort(found.begin(), found.end(), [](const NodeValue& a, const NodeValue& b) {
    return std::tie(a.node, a.phi) < std::tie(b.node, b.phi);
  });
  std::erase_if(found, [&](const NodeValue& each) { return is_next_to_gas(band, each.node); });
  set(found, band);
}

OpenGas all_but_the_source(const Band& band) {
  const PhaseGraph graph(band, Phase::gas);
  OpenGas gas;
  gas.open = graph.nodes_where([](const LeafPiece& piece) { return piece.region != 0; });
  return gas;
}

}  // namespace

ClosedGas closed_gas(const Band& band, const PhaseGraph& gas) {
  LevelSet phi = lid_above(band);
  const std::vector<NodeValue> voids_and_walls = nodes_of_voids(band, gas);
  put(voids_and_walls, phi.band());
  redistance_fully(phi.band());
  find_beyond_edges(voids_and_walls, phi.band());
  OpenGas voids = all_but_the_source(phi.band());
  return {std::move(phi), std::move(voids)};
}

}  // namespace scarp
