#include "levelset/carry.h"

#include <algorithm>

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
  if (nodes == LeafMask{} || is_at_side(band_, leaf, 1)) {
    // At a side a neighbour may be mirrored or wrapped: all are asked.
    return nodes;
  }
  const LeafMask& here = known_[leaf];
  const auto word = [&](int face, int i) {
    const int next = band_.neighbours(leaf)[face];
    return next >= 0 ? known_[static_cast<std::size_t>(next)][i] : 0;
  };
  for (int i = 0; i < leaf_edge; ++i) {
    std::uint64_t near = i > 0 ? here[i - 1] : word(0, leaf_edge - 1);
    near |= i + 1 < leaf_edge ? here[i + 1] : word(1, 0);
    near |= here[i] << 8 | word(2, i) >> 56;
    near |= here[i] >> 8 | word(3, i) << 56;
    near |= (here[i] & ~last_of_rows) << 1 | (word(4, i) & last_of_rows) >> 7;
    near |= (here[i] & ~first_of_rows) >> 1 | (word(5, i) & first_of_rows) << 7;
    nodes[i] &= near;
  }
  return nodes;
}

}  // namespace scarp
