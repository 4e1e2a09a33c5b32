#include "levelset/grid/carry.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "levelset/grid/layers.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

/// A value at one of ten nodes of a band.
std::vector<float> few_values(const Band& band) {
  std::mt19937 random(3);
  std::bernoulli_distribution has_value(0.1);
  std::vector<float> values(band.leaves().size() * leaf_size, no_value);
  for (std::size_t n = 0; n < band.leaves().size(); ++n) {
    const Leaf& leaf = band.leaves()[n];
    for (int node = 0; node < leaf_size; ++node) {
      const Node at = node_at(leaf, node);
      const bool inside = at[0] < band.node_count(0) && at[1] < band.node_count(1);
      if (inside && has_value(random)) values[n * leaf_size + static_cast<std::size_t>(node)] = 1;
    }
  }
  return values;
}

/// Whether a node has a neighbour with a value, one by one.
bool is_beside_value(const Band& band, const std::vector<float>& values, const Node& at) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const int step : {-1, 1}) {
      Node to = at;
      to[axis] += step;
      if (axis < 2) to[axis] = band.fold(axis, to[axis]);
      const int leaf = band.find(to[0] >> 3, to[1] >> 3, to[2] >> 3);
      if (leaf < 0) continue;
      const int node = leaf_offset(to[0], to[1], to[2]);
      if (values[static_cast<std::size_t>(leaf * leaf_size + node)] != no_value) return true;
    }
  }
  return false;
}

TEST(KnownNodes, FrontierIsWhatLacksAValueBesideOne) {
  for (const Boundary sides : {Boundary::reflective, Boundary::periodic}) {
    const Frame frame{.spacing = 1, .cells = {19, 10}, .boundary = {sides, sides}};
    const Layers layers = single_layer(
        frame, [](Vec3d r) { return r.z - 0.3 * r.x - 0.1; }, -12, 12);
    const Band& band = layers.top().band();
    const std::vector<float> values = few_values(band);
    const KnownNodes nodes(band, values);
    for (std::size_t n = 0; n < band.leaves().size(); ++n) {
      const Leaf& leaf = band.leaves()[n];
      const LeafMask frontier = nodes.frontier(n);
      for (int node = 0; node < leaf_size; ++node) {
        const bool is_active = (leaf.active[node >> 6] >> (node & 63) & 1) != 0;
        const bool lacks = values[n * leaf_size + static_cast<std::size_t>(node)] == no_value;
        const bool expected =
            is_active && lacks && is_beside_value(band, values, node_at(leaf, node));
        ASSERT_EQ((frontier[node >> 6] >> (node & 63) & 1) != 0, expected) << n << ' ' << node;
      }
    }
  }
}

}  // namespace
}  // namespace scarp
