#include "levelset/grid/stencil.h"

namespace scarp {

namespace {

SCARP_VECTOR_KERNEL void find_next_to_surface(const Block& block, LeafMask& mask) {
  for (int i = 0; i < leaf_edge; ++i) {
    std::uint64_t word = 0;
    for (int j = 0; j < leaf_edge; ++j) {
      const float* row = block.row(i, j);
      std::uint32_t bits = 0;
      for (int k = 0; k < leaf_edge; ++k) {
        const float* p = row + k;
        const float side = *p < 0 ? -1.0F : 1.0F;
        // No node is exactly 0: a product is negative if that neighbour has the other sign.
        const float x = std::min(p[-Block::x_stride] * side, p[Block::x_stride] * side);
        const float y = std::min(p[-Block::y_stride] * side, p[Block::y_stride] * side);
        const float z = std::min(p[-1] * side, p[1] * side);
        bits += std::min(std::min(x, y), z) < 0 ? 1U << k : 0U;
      }
      word |= std::uint64_t{bits} << (leaf_edge * j);
    }
    mask[i] = word;
  }
}

}  // namespace

LeafMask next_to_surface(const Leaf& leaf, const Block& block) {
  LeafMask mask;
  find_next_to_surface(block, mask);
  for (int i = 0; i < leaf_edge; ++i) mask[i] &= leaf.active[i];
  return mask;
}

}  // namespace scarp
