#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "levelset/band.h"

/// Compiles a kernel for several instruction sets; which one runs is decided when the program is
/// loaded. All give the same bits: no fused operations (-ffp-contract=off), no reordering.
#if defined(__x86_64__) && !defined(__AVX2__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__clang__)
#define SCARP_VECTOR_KERNEL __attribute__((target_clones("avx2", "default")))
#else
#define SCARP_VECTOR_KERNEL
#endif

/// What a kernel is made of: compiled anew inside every kernel, for its instruction set. A call
/// would go to a function for the lowest one.
#if defined(__GNUC__)
#define SCARP_KERNEL_PART [[gnu::always_inline]] inline
#else
#define SCARP_KERNEL_PART inline
#endif

namespace scarp {

/// phi of one leaf with a halo of three nodes along each axis; corners of the halo are not filled.
///
/// Node (i, j, k) of the leaf is at [i + 3][j + 3][k + 4]: rows start on cache lines.
struct Block {
  static constexpr int halo = 3;
  static constexpr int z_offset = 4;
  static constexpr std::ptrdiff_t x_stride = (leaf_edge + 2 * halo) * 16;
  static constexpr std::ptrdiff_t y_stride = 16;

  alignas(64) float values[leaf_edge + 2 * halo][leaf_edge + 2 * halo][16];

  const float* row(int i, int j) const { return &values[i + halo][j + halo][z_offset]; }
  float* row(int i, int j) { return &values[i + halo][j + halo][z_offset]; }
};

/// From a node to its neighbours along x, y and z.
inline constexpr std::array<std::ptrdiff_t, 3> axis_strides{Block::x_stride, Block::y_stride, 1};

/// Reads a leaf and as much of its halo as is asked for, mirrored or wrapped at the domain sides.
///
/// source(n) gives the 512 values of leaf n.
template <int halo = 2, class Source>
void gather(const Band& band, std::size_t leaf, const Source& source, Block& block) {
  const auto values = [&](int index) { return index >= 0 ? source(index) : missing_values(index); };
  const auto [i0, j0, k0] = band.leaves()[leaf].origin;
  static_assert(halo <= Block::halo);
  const auto inside = [](int origin, int count) {
    return origin >= leaf_edge && origin + leaf_edge + halo <= count;
  };

  if (inside(i0, band.node_count(0)) && inside(j0, band.node_count(1))) {
    const auto& next = band.neighbours(leaf);
    const float* centre = source(leaf);
    const float* below = values(next[4]);
    const float* above = values(next[5]);
    for (int ij = 0; ij < 64; ++ij) {
      float* row = block.row(ij >> 3, ij & 7);
      const int offset = ij * leaf_edge;
      std::memcpy(row, centre + offset, 8 * sizeof(float));
      std::memcpy(row - halo, below + offset + leaf_edge - halo, halo * sizeof(float));
      std::memcpy(row + 8, above + offset, halo * sizeof(float));
    }
    const float* left = values(next[0]);
    const float* right = values(next[1]);
    const float* front = values(next[2]);
    const float* back = values(next[3]);
    for (int n = 0; n < 8; ++n) {
      for (int h = 0; h < halo; ++h) {
        std::memcpy(block.row(h - halo, n), left + leaf_offset(h + 8 - halo, n, 0),
                    8 * sizeof(float));
        std::memcpy(block.row(h + 8, n), right + leaf_offset(h, n, 0), 8 * sizeof(float));
        std::memcpy(block.row(n, h - halo), front + leaf_offset(n, h + 8 - halo, 0),
                    8 * sizeof(float));
        std::memcpy(block.row(n, h + 8), back + leaf_offset(n, h, 0), 8 * sizeof(float));
      }
    }
    return;
  }

  // At a side every row is looked up, because mirrored rows may come from any leaf nearby.
  const int z = k0 >> 3;
  for (int i = -halo; i < leaf_edge + halo; ++i) {
    const bool i_inner = i >= 0 && i < leaf_edge;
    const int x = band.fold(0, i0 + i);
    for (int j = -halo; j < leaf_edge + halo; ++j) {
      const bool j_inner = j >= 0 && j < leaf_edge;
      if (!i_inner && !j_inner) {
        continue;
      }
      const int y = band.fold(1, j0 + j);
      const int offset = leaf_offset(x, y, 0);
      float* row = block.row(i, j);
      std::memcpy(row, values(band.find(x >> 3, y >> 3, z)) + offset, 8 * sizeof(float));
      if (i_inner && j_inner) {
        const float* below = values(band.find(x >> 3, y >> 3, z - 1));
        const float* above = values(band.find(x >> 3, y >> 3, z + 1));
        std::memcpy(row - halo, below + offset + leaf_edge - halo, halo * sizeof(float));
        std::memcpy(row + 8, above + offset, halo * sizeof(float));
      }
    }
  }
}

/// Nodes of a leaf that lie in the domain, along one lateral axis.
inline int stored_nodes(const Band& band, const Leaf& leaf, int axis) {
  return std::min(leaf_edge, band.node_count(axis) - leaf.origin[axis]);
}

/// Whether a neighbour along an axis is on the other side of the surface.
inline bool is_next_to_surface(const float* p) {
  const bool solid = *p < 0;
  for (const std::ptrdiff_t stride : axis_strides) {
    if ((p[-stride] < 0) != solid || (p[stride] < 0) != solid) {
      return true;
    }
  }
  return false;
}

}  // namespace scarp
