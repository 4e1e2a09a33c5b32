#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "levelset/grid/stencil.h"
#include "levelset/grid/symmetry.h"

namespace scarp {

/// Marks a node that has no value yet.
inline constexpr float no_value = std::numeric_limits<float>::infinity();

/// Nodes that have a value, by leaf, and nodes of the band that lack one; of those beyond the
/// diagonal of a frame, which are images of others, none lacks one.
class KnownNodes {
 public:
  /// Shape: 512 values per leaf.
  KnownNodes(const Band& band, std::span<const float> values);

  /// Nodes of a leaf that lack a value and have a neighbour along an axis that has one.
  LeafMask frontier(std::size_t leaf) const;

  /// Nodes that have got a value.
  void add(std::size_t leaf, const LeafMask& nodes) {
    for (int i = 0; i < leaf_edge; ++i) {
      known_[leaf][i] |= nodes[i];
      lacking_[leaf][i] &= ~nodes[i];
    }
  }

 private:
  /// Nodes of a leaf with a neighbour along an axis that has a value.
  LeafMask beside_known(std::size_t leaf) const;

  const Band& band_;
  std::vector<LeafMask> known_;
  std::vector<LeafMask> lacking_;
};

inline std::size_t node_count(const LeafMask& mask) {
  std::size_t count = 0;
  for (const std::uint64_t word : mask) count += static_cast<std::size_t>(std::popcount(word));
  return count;
}

/// Calls visit(node) for every node of a mask, in the order of nodes.
template <class Visit>
void for_each_node(const LeafMask& mask, const Visit& visit) {
  for (int i = 0; i < leaf_edge; ++i) {
    for (std::uint64_t word = mask[i]; word != 0; word &= word - 1) {
      visit(i * leaf_edge * leaf_edge + std::countr_zero(word));
    }
  }
}

/// Calls visit(k) for the nodes of a row whose bits are set.
template <class Visit>
void for_each_of_row(unsigned row, const Visit& visit) {
  for (; row != 0; row &= row - 1) visit(std::countr_zero(row));
}

/// A rule for one node as one for rows.
template <class Rule>
auto each_of_row(const Rule& rule) {
  return [rule](const float* phi, const float* values, unsigned asked, float* answers) {
    for_each_of_row(asked, [&](int k) { answers[k] = rule(phi + k, values + k); });
  };
}

/// Asks the rule of carry_outward for the nodes of one leaf; the answers in the order of nodes.
template <class Rule>
void ask_leaf(const LeafMask& asked, const Block& phi, const Block& values, const Rule& rule,
              float* answers) {
  for (int ij = 0; ij < leaf_edge * leaf_edge; ++ij) {
    const int i = ij / leaf_edge;
    const int j = ij % leaf_edge;
    const auto row = static_cast<unsigned>(asked[i] >> (leaf_edge * j)) & 0xffU;
    if (row == 0) continue;
    std::array<float, leaf_edge> answers_of_row{};
    rule(phi.row(i, j), values.row(i, j), row, answers_of_row.data());
    for_each_of_row(row, [&](int k) { *answers++ = answers_of_row[k]; });
  }
}

/// Writes the answers of ask_leaf to the values of the leaf. Returns the nodes that got a value.
inline LeafMask take_answers(const LeafMask& asked, const float* answers, float* values) {
  LeafMask found{};
  for_each_node(asked, [&](int node) {
    values[node] = *answers;
    found[node >> 6] |= std::uint64_t{*answers++ != no_value} << (node & 63);
  });
  return found;
}

/// Carries values from the nodes next to the surface to the whole band.
///
/// rule(phi, values, asked, answers) gives the values of the nodes of a row whose bits are set in
/// asked, from their neighbours along the axes, whose phi and values are at the strides of Block;
/// no_value as long as it cannot tell, always if none of them has a value. Answers for others do
/// not matter. All nodes of a pass are asked before any value changes: the order of nodes and
/// threads does not matter.
///
/// Shape: 512 values per leaf, no_value where there is none; what no value reaches stays so.
template <class Rule>
void carry_outward(const Band& band, std::span<float> values, const Rule& rule) {
  // From the surface to the edge of the band; a pass reaches 1 / sqrt(3) further at least.
  constexpr int pass_count = 8;
  constexpr std::size_t grain = 8;
  const std::size_t count = band.leaves().size();
  KnownNodes nodes(band, values);
  std::vector<LeafMask> asked(count);
  std::vector<std::size_t> first(count + 1, 0);  // of a leaf's answers
  std::vector<float> answers;
  const auto in_tree = [&](std::size_t n) -> const float* { return band.leaves()[n].phi; };
  const auto so_far = [&](std::size_t n) { return &values[n * leaf_size]; };
  for (int pass = 0; pass < pass_count; ++pass) {
    parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        asked[n] = nodes.frontier(n);
        first[n + 1] = node_count(asked[n]);
      }
    });
    std::partial_sum(first.begin(), first.end(), first.begin());
    answers.resize(first.back());
    parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
      Block phi;
      Block known;
      for (std::size_t n = begin; n < end; ++n) {
        if (asked[n] == LeafMask{}) continue;
        gather<1>(band, n, in_tree, phi);
        gather<1>(band, n, so_far, known);
        ask_leaf(asked[n], phi, known, rule, &answers[first[n]]);
      }
    });
    parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        nodes.add(n, take_answers(asked[n], answers.data() + first[n], &values[n * leaf_size]));
      }
    });
    // Nodes on the diagonal look at those beyond it.
    if (band.frame().diagonal) mirror_across_diagonal(band, values);
  }
}

}  // namespace scarp
