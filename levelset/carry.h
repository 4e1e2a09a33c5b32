#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "core/parallel.h"
#include "levelset/stencil.h"

namespace scarp {

/// Marks a node that has no value yet.
inline constexpr float no_value = std::numeric_limits<float>::infinity();

/// Nodes of a leaf that are in the band and have no value.
inline bool lacks_values(const Leaf& leaf, const float* values) {
  for (int node = 0; node < leaf_size; ++node) {
    if (values[node] == no_value && std::abs(leaf.phi[node]) < LevelSet::half_width) {
      return true;
    }
  }
  return false;
}

/// Carries values from the nodes next to the surface to the whole band.
///
/// rule(phi, values) gives the value of a node from its neighbours along the axes, whose phi and
/// values are at the strides of Block; no_value as long as it cannot tell. All nodes of a pass are
/// asked before any value changes: the order of nodes and threads does not matter.
///
/// Shape: 512 values per leaf, no_value where there is none; what no value reaches stays so.
template <class Rule>
void carry_outward(const Band& band, std::vector<float>& values, const Rule& rule) {
  // From the surface to the edge of the band; a pass reaches 1 / sqrt(3) further at least.
  constexpr int pass_count = 8;
  std::vector<std::size_t> pending;
  for (std::size_t n = 0; n < band.leaves().size(); ++n) {
    if (lacks_values(band.leaves()[n], &values[n * leaf_size])) {
      pending.push_back(n);
    }
  }
  for (int pass = 0; pass < pass_count && !pending.empty(); ++pass) {
    LeafValues next(pending.size());
    parallel_for(pending.size(), 8, [&](std::size_t begin, std::size_t end) {
      Block phi;
      Block known;
      for (std::size_t p = begin; p < end; ++p) {
        const std::size_t n = pending[p];
        gather(
            band, n, [&](std::size_t m) { return band.leaves()[m].phi; }, phi);
        gather(
            band, n, [&](std::size_t m) { return &values[m * leaf_size]; }, known);
        for (int node = 0; node < leaf_size; ++node) {
          const float value = values[n * leaf_size + static_cast<std::size_t>(node)];
          const float* at = phi.row(node >> 6, (node >> 3) & 7) + (node & 7);
          const bool asks =
              value == no_value && std::abs(band.leaves()[n].phi[node]) < LevelSet::half_width;
          next[p][node] =
              asks ? rule(at, known.row(node >> 6, (node >> 3) & 7) + (node & 7)) : value;
        }
      }
    });
    for (std::size_t p = 0; p < pending.size(); ++p) {
      std::memcpy(&values[pending[p] * leaf_size], next[p], leaf_size * sizeof(float));
    }
    std::erase_if(pending, [&](std::size_t n) {
      return !lacks_values(band.leaves()[n], &values[n * leaf_size]);
    });
  }
}

}  // namespace scarp
