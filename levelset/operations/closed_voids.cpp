#include "levelset/operations/closed_voids.h"

#include <algorithm>
#include <vector>

#include "levelset/grid/redistance.h"

namespace scarp {

bool holds_void(const Band& band, const OpenGas& gas, const Node& node) {
  const auto is_closed_gas = [&](const Node& at) {
    return !(band.node(at[0], at[1], at[2]) < 0) && !is_open_gas(band, gas, at);
  };
  bool found = is_closed_gas(node);
  for (int face = 0; !found && face < 6; ++face) {
    Node other = node;
    other[face / 2] += face % 2 == 0 ? -1 : 1;
    found = is_closed_gas(other);
  }
  return found;
}

void take_over_voids(const Band& from, const OpenGas& gas, Band& to) {
  struct Value {
    Node node;
    float phi;
  };
  std::vector<Value> values;
  std::vector<NewLeaf> added;
  for (const Leaf& leaf : from.leaves()) {
    const std::size_t before = values.size();
    const int i_count = std::min(leaf_edge, from.node_count(0) - leaf.origin[0]);
    const int j_count = std::min(leaf_edge, from.node_count(1) - leaf.origin[1]);
    for (int node = 0; node < leaf_size; ++node) {
      const int i = node >> 6;
      const int j = (node >> 3) & 7;
      const Node at = node_at(leaf, node);
      if (i < i_count && j < j_count && holds_void(from, gas, at)) {
        values.push_back({at, leaf.phi[node]});
      }
    }
    const auto [i, j, k] = leaf.origin;
    if (values.size() > before && to.find(i >> 3, j >> 3, k >> 3) < 0) {
      added.push_back({.origin = leaf.origin, .solid = true});
    }
  }
  to.change_leaves(added, {});
  for (const Value& value : values) {
    const auto [i, j, k] = value.node;
    const auto leaf = static_cast<std::size_t>(to.find(i >> 3, j >> 3, k >> 3));
    to.leaves()[leaf].phi[leaf_offset(i, j, k)] = value.phi;
  }
  to.trim();
  redistance_fully(to);
}

}  // namespace scarp
