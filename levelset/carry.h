#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "levelset/stencil.h"

namespace scarp {

/// Marks a node that has no value yet.
inline constexpr float no_value = std::numeric_limits<float>::infinity();

/// Nodes that have a value, by leaf, and nodes of the band that lack one.
class KnownNodes {
 public:
  /// Shape: 512 values per leaf.
  KnownNodes(const Band& band, const std::vector<float>& values);

  /// Nodes of a leaf that lack a value and may get one from a neighbour along an axis that has one.
  LeafMask frontier(std::size_t leaf) const;

  void add(std::size_t leaf, int node) {
    const std::uint64_t bit = std::uint64_t{1} << (node & 63);
    known_[leaf][node >> 6] |= bit;
    lacking_[leaf][node >> 6] &= ~bit;
  }

 private:
  const Band& band_;
  std::vector<LeafMask> known_;
  std::vector<LeafMask> lacking_;
};

/// Calls visit(node) for every node of a mask, in the order of nodes.
template <class Visit>
void for_each_node(const LeafMask& mask, const Visit& visit) {
  for (int i = 0; i < leaf_edge; ++i) {
    for (std::uint64_t word = mask[i]; word != 0; word &= word - 1) {
      visit(i * leaf_edge * leaf_edge + std::countr_zero(word));
    }
  }
}

/// Carries values from the nodes next to the surface to the whole band.
///
/// rule(phi, values) gives the value of a node from its neighbours along the axes, whose phi and
/// values are at the strides of Block; no_value as long as it cannot tell, always if none of them
/// has a value. All nodes of a pass are asked before any value changes: the order of nodes and
/// threads does not matter.
///
/// Shape: 512 values per leaf, no_value where there is none; what no value reaches stays so.
template <class Rule>
void carry_outward(const Band& band, std::vector<float>& values, const Rule& rule) {
  // From the surface to the edge of the band; a pass reaches 1 / sqrt(3) further at least.
  constexpr int pass_count = 8;
  constexpr std::size_t grain = 8;
  const std::size_t count = band.leaves().size();
  KnownNodes nodes(band, values);
  std::vector<std::vector<std::pair<std::size_t, float>>> found((count + grain - 1) / grain);
  for (int pass = 0; pass < pass_count; ++pass) {
    parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
      auto& list = found[begin / grain];
      list.clear();
      Block phi;
      Block known;
      for (std::size_t n = begin; n < end; ++n) {
        const LeafMask frontier = nodes.frontier(n);
        if (frontier == LeafMask{}) {
          continue;
        }
        gather<1>(
            band, n, [&](std::size_t m) { return band.leaves()[m].phi; }, phi);
        gather<1>(
            band, n, [&](std::size_t m) { return &values[m * leaf_size]; }, known);
        for_each_node(frontier, [&](int node) {
          const float value = rule(phi.row(node >> 6, (node >> 3) & 7) + (node & 7),
                                   known.row(node >> 6, (node >> 3) & 7) + (node & 7));
          if (value != no_value) {
            list.emplace_back(n * leaf_size + static_cast<std::size_t>(node), value);
          }
        });
      }
    });
    parallel_for(found.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t range = begin; range < end; ++range) {
        for (const auto& [at, value] : found[range]) {
          values[at] = value;
          nodes.add(at / leaf_size, static_cast<int>(at % leaf_size));
        }
      }
    });
  }
}

}  // namespace scarp
