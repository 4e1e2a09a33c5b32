#include "levelset/grid/carry.h"

#include <algorithm>
#include <utility>

namespace scarp {

namespace {

// Bits of a word are rows of eight along z.
constexpr std::uint64_t first_of_rows = 0x0101010101010101U;
constexpr std::uint64_t last_of_rows = 0x8080808080808080U;

SCARP_VECTOR_KERNEL void find_known(const float* values, LeafMask& known) {
  for (int i = 0; i < leaf_edge; ++i) {
    std::uint64_t word = 0;
    for (int j = 0; j < leaf_edge; ++j) {
      const float* row = values + leaf_offset(i, j, 0);
      std::uint32_t bits = 0;
      for (int k = 0; k < leaf_edge; ++k) {
        bits += row[k] != no_value ? 1U << k : 0U;
      }
      word |= std::uint64_t{bits} << (leaf_edge * j);
    }
    known[i] = word;
  }
}

/// Nodes of a leaf that are no mirror images of others across the diagonal.
LeafMask no_images(const Band& band, const Leaf& leaf) {
  LeafMask nodes;
  nodes.fill(~std::uint64_t{0});
  if (!band.frame().diagonal) return nodes;
  for (int i = 0; i < leaf_edge; ++i) {
    const int first_image = std::clamp(leaf.origin[0] + i - leaf.origin[1] + 1, 0, leaf_edge);
    nodes[i] = first_image == leaf_edge ? ~std::uint64_t{0}
                                        : (std::uint64_t{1} << (leaf_edge * first_image)) - 1;
  }
  return nodes;
}

}  // namespace

// Images are never added to what is known: a node on the diagonal, which alone has some for
// neighbours, has their originals for neighbours as well.
KnownNodes::KnownNodes(const Band& band, std::span<const float> values)
    : band_(band), known_(band.leaves().size()), lacking_(band.leaves().size()) {
  parallel_for(known_.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      find_known(&values[n * leaf_size], known_[n]);
      const LeafMask own = no_images(band, band.leaves()[n]);
      for (int i = 0; i < leaf_edge; ++i) {
        lacking_[n][i] = band.leaves()[n].active[i] & ~known_[n][i] & own[i];
      }
    }
  });
}

LeafMask KnownNodes::frontier(std::size_t leaf) const {
  LeafMask nodes = lacking_[leaf];
  if (nodes == LeafMask{}) return nodes;
  const LeafMask near = beside_known(leaf);
  for (int i = 0; i < leaf_edge; ++i) nodes[i] &= near[i];
  return nodes;
}

LeafMask KnownNodes::beside_known(std::size_t leaf) const {
  const LeafMask& here = known_[leaf];
  LeafMask nodes{};
  // Within the leaf,
  for (int i = 0; i < leaf_edge; ++i) {
    if (i > 0) nodes[i] |= here[i - 1];
    if (i + 1 < leaf_edge) nodes[i] |= here[i + 1];
    nodes[i] |= here[i] << 8 | here[i] >> 8;
    nodes[i] |= (here[i] & ~last_of_rows) << 1 | (here[i] & ~first_of_rows) >> 1;
  }
  const auto known = [&](int found) {
    return found >= 0 ? known_[static_cast<std::size_t>(found)] : LeafMask{};
  };
  // before and behind it along x and y, beyond a side in a mirror image or at the other end,
  const Leaf& at = band_.leaves()[leaf];
  const auto [x, y, z] = at.origin;
  const std::array<int, 2> last{stored_nodes(band_, at, 0) - 1, stored_nodes(band_, at, 1) - 1};
  for (const auto& [i, beyond] : {std::pair{0, x - 1}, {last[0], x + last[0] + 1}}) {
    const int from = band_.fold(0, beyond);
    nodes[i] |= known(band_.find(from >> 3, y >> 3, z >> 3))[from & 7];
  }
  for (const auto& [j, beyond] : {std::pair{0, y - 1}, {last[1], y + last[1] + 1}}) {
    const int from = band_.fold(1, beyond);
    const LeafMask words = known(band_.find(x >> 3, from >> 3, z >> 3));
    for (int i = 0; i < leaf_edge; ++i)
      nodes[i] |= (words[i] >> (leaf_edge * (from & 7)) & 0xff) << (leaf_edge * j);
  }
  // and below and above it.
  const LeafMask below = known(band_.neighbours(leaf)[4]);
  const LeafMask above = known(band_.neighbours(leaf)[5]);
  for (int i = 0; i < leaf_edge; ++i)
    nodes[i] |= (below[i] & last_of_rows) >> 7 | (above[i] & first_of_rows) << 7;
  return nodes;
}

}  // namespace scarp
