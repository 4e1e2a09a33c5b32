#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "core/vector_kernel.h"
#include "levelset/grid/band.h"

namespace scarp {

/// phi of one leaf with a halo of three nodes along each axis; corners of the halo are not filled.
///
/// Node (i, j, k) of the leaf is at [i + 3][j + 3][k + 4]: rows start on cache lines.
struct Block {
  static constexpr int halo = 3;
  static constexpr int z_offset = 4;
  static constexpr std::ptrdiff_t x_stride = std::ptrdiff_t{leaf_edge + 2 * halo} * 16;
  static constexpr std::ptrdiff_t y_stride = 16;

  alignas(64) float values[leaf_edge + 2 * halo][leaf_edge + 2 * halo][16];

  const float* row(int i, int j) const { return &values[i + halo][j + halo][z_offset]; }
  float* row(int i, int j) { return &values[i + halo][j + halo][z_offset]; }
};

/// From a node to its neighbours along x, y and z.
inline constexpr std::array<std::ptrdiff_t, 3> axis_strides{Block::x_stride, Block::y_stride, 1};

/// Which leaves the rows first..last of a leaf (0..7 are its own) come from along a lateral axis,
/// mirrored or wrapped at the sides. Next to a periodic side with a single node in the last leaf
/// these are four.
struct FoldedAxis {
  static constexpr int most = 4;

  std::array<int, leaf_edge + 2 * Block::halo> offsets{};  ///< of rows in their leaf
  std::array<int, leaf_edge + 2 * Block::halo> places{};   ///< of their leaf in column
  std::array<int, most> column{};
  int count = 0;

  FoldedAxis(const Band& band, int axis, int origin, int first, int last) {
    for (int n = first; n <= last; ++n) {
      const int folded = band.fold(axis, origin + n);
      int c = 0;
      while (c < count && column[c] != folded >> 3) ++c;
      if (c == count) column[count++] = folded >> 3;
      places[n + Block::halo] = c;
      offsets[n + Block::halo] = folded & 7;
    }
  }

  int place(int row) const { return places[row + Block::halo]; }
  int offset(int row) const { return offsets[row + Block::halo]; }
};

/// Whether a leaf's halo reaches beyond a side.
inline bool is_at_side(const Band& band, std::size_t leaf, int halo) {
  const auto& origin = band.leaves()[leaf].origin;
  const auto inside = [&](int axis) {
    return origin[axis] >= leaf_edge && origin[axis] + leaf_edge + halo <= band.node_count(axis);
  };
  return !inside(0) || !inside(1);
}

/// Rows of a leaf at a side, of which mirrored ones may come from any leaf nearby.
template <int halo, class Values>
void gather_at_side(const Band& band, std::size_t leaf, const Values& values, Block& block) {
  const auto [i0, j0, k0] = band.leaves()[leaf].origin;
  const FoldedAxis x(band, 0, i0, -halo, leaf_edge - 1 + halo);
  const FoldedAxis y(band, 1, j0, -halo, leaf_edge - 1 + halo);
  using Pile = std::array<const float*, 3>;
  std::array<std::array<Pile, FoldedAxis::most>, FoldedAxis::most> around;
  for (int a = 0; a < x.count; ++a) {
    for (int b = 0; b < y.count; ++b) {
      for (int up = 0; up < 3; ++up) {
        around[a][b][up] = values(band.find(x.column[a], y.column[b], (k0 >> 3) + up - 1));
      }
    }
  }
  for (int i = -halo; i < leaf_edge + halo; ++i) {
    const bool i_inner = i >= 0 && i < leaf_edge;
    for (int j = -halo; j < leaf_edge + halo; ++j) {
      const bool j_inner = j >= 0 && j < leaf_edge;
      if (!i_inner && !j_inner) {
        continue;
      }
      const auto& [below, here, above] = around[x.place(i)][y.place(j)];
      const int offset = leaf_offset(x.offset(i), y.offset(j), 0);
      float* row = block.row(i, j);
      std::memcpy(row, here + offset, 8 * sizeof(float));
      if (i_inner && j_inner) {
        std::memcpy(row - halo, below + offset + leaf_edge - halo, halo * sizeof(float));
        std::memcpy(row + 8, above + offset, halo * sizeof(float));
      }
    }
  }
}

/// Reads a leaf and as much of its halo as is asked for, mirrored or wrapped at the domain sides.
///
/// source(n) gives the 512 values of leaf n.
template <int halo = 2, class Source>
void gather(const Band& band, std::size_t leaf, const Source& source, Block& block) {
  const auto values = [&](int index) { return index >= 0 ? source(index) : missing_values(index); };
  static_assert(halo <= Block::halo);
  if (!is_at_side(band, leaf, halo)) {
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

  gather_at_side<halo>(band, leaf, values, block);
}

/// Nodes of a leaf that lie in the domain, along one lateral axis.
inline int stored_nodes(const Band& band, const Leaf& leaf, int axis) {
  return std::min(leaf_edge, band.node_count(axis) - leaf.origin[axis]);
}

/// Nodes of a leaf with a neighbour along an axis on the other side of the surface. block holds phi
/// with a halo of one node.
LeafMask next_to_surface(const Leaf& leaf, const Block& block);

}  // namespace scarp
