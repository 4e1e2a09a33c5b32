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

namespace scarp {

/// phi of one leaf with a halo of two nodes along each axis; corners of the halo are not filled.
///
/// Node (i, j, k) of the leaf is at [i + 2][j + 2][k + 4]: rows start on cache lines.
struct Block {
  static constexpr int halo = 2;
  static constexpr int z_offset = 4;
  static constexpr std::ptrdiff_t x_stride = (leaf_edge + 2 * halo) * 16;
  static constexpr std::ptrdiff_t y_stride = 16;

  alignas(64) float values[leaf_edge + 2 * halo][leaf_edge + 2 * halo][16];

  const float* row(int i, int j) const { return &values[i + halo][j + halo][z_offset]; }
  float* row(int i, int j) { return &values[i + halo][j + halo][z_offset]; }
};

/// From a node to its neighbours along x, y and z.
inline constexpr std::array<std::ptrdiff_t, 3> axis_strides{Block::x_stride, Block::y_stride, 1};

/// Reads a leaf and its halo, mirrored or wrapped at the domain sides.
///
/// source(n) gives the 512 values of leaf n.
template <class Source>
void gather(const Band& band, std::size_t leaf, const Source& source, Block& block) {
  const auto values = [&](int index) { return index >= 0 ? source(index) : missing_values(index); };
  const auto [i0, j0, k0] = band.leaves()[leaf].origin;
  const auto inside = [](int origin, int count) {
    return origin >= leaf_edge && origin + leaf_edge + Block::halo <= count;
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
      std::memcpy(row - 2, below + offset + 6, 2 * sizeof(float));
      std::memcpy(row + 8, above + offset, 2 * sizeof(float));
    }
    const float* left = values(next[0]);
    const float* right = values(next[1]);
    const float* front = values(next[2]);
    const float* back = values(next[3]);
    for (int n = 0; n < 8; ++n) {
      for (int h = 0; h < Block::halo; ++h) {
        std::memcpy(block.row(h - 2, n), left + leaf_offset(h + 6, n, 0), 8 * sizeof(float));
        std::memcpy(block.row(h + 8, n), right + leaf_offset(h, n, 0), 8 * sizeof(float));
        std::memcpy(block.row(n, h - 2), front + leaf_offset(n, h + 6, 0), 8 * sizeof(float));
        std::memcpy(block.row(n, h + 8), back + leaf_offset(n, h, 0), 8 * sizeof(float));
      }
    }
    return;
  }

  // At a side every row is looked up, because mirrored rows may come from any leaf nearby.
  const int z = k0 >> 3;
  for (int i = -Block::halo; i < leaf_edge + Block::halo; ++i) {
    const bool i_inner = i >= 0 && i < leaf_edge;
    const int x = band.fold(0, i0 + i);
    for (int j = -Block::halo; j < leaf_edge + Block::halo; ++j) {
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
        std::memcpy(row - 2, below + offset + 6, 2 * sizeof(float));
        std::memcpy(row + 8, above + offset, 2 * sizeof(float));
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

/// The smaller of two numbers of one sign, zero if the signs differ.
inline float minmod(float a, float b) {
  const float smaller = std::abs(a) < std::abs(b) ? a : b;
  return a * b > 0 ? smaller : 0.0F;
}

/// Squares of the derivative along one axis.
struct AxisSlopes {
  float upwind = 0;    ///< Godunov: for information that travels the way phi grows or falls
  float steepest = 0;  ///< the larger of the two one-sided differences
};

/// side = 1: information travels towards growing phi, side = -1: towards falling phi.
///
/// Symmetric to the last bit under reversal of the axis. Source: Osher and Sethian 1988, second
/// order by minmod of neighbouring second differences (ENO2).
inline AxisSlopes axis_slopes(const float* p, std::ptrdiff_t stride, float side,
                              bool second_order) {
  const float centre = p[0];
  float backward = centre - p[-stride];
  float forward = p[stride] - centre;
  const float steepest = std::max(std::abs(backward), std::abs(forward));
  if (second_order) {
    const float here = forward - backward;
    const float before = (centre - p[-stride]) - (p[-stride] - p[-2 * stride]);
    const float after = (p[2 * stride] - p[stride]) - (p[stride] - centre);
    backward += 0.5F * minmod(here, before);
    forward -= 0.5F * minmod(here, after);
  }
  const float upwind = std::max(std::max(side * backward, 0.0F), std::max(-side * forward, 0.0F));
  return {upwind * upwind, steepest * steepest};
}

/// Difference of the two from which on a place counts as near an edge (fully at twice this): on a
/// smooth surface it is below 1 / radius of curvature in spacings, and pure ENO2 holds.
inline constexpr float kink_starts = 0.15F;

/// |grad phi| of a function that is meant to be a distance: by upwind differences, but near an edge
/// 1, where that lies between what the upwind and the steepest differences say.
///
/// Where normals fan out from an edge, upwind differences are too small by up to 30 % within the
/// first spacings: without this the edge lags behind by half a spacing for good.
inline float distance_slope(const float* p, float side) {
  const AxisSlopes x = axis_slopes(p, Block::x_stride, side, true);
  const AxisSlopes y = axis_slopes(p, Block::y_stride, side, true);
  const AxisSlopes z = axis_slopes(p, 1, side, true);
  const float upwind = std::sqrt((x.upwind + y.upwind) + z.upwind);
  const float steepest = std::sqrt((x.steepest + y.steepest) + z.steepest);
  const float kink = std::clamp((steepest - upwind - kink_starts) / kink_starts, 0.0F, 1.0F);
  return upwind + kink * (std::max(upwind, std::min(steepest, 1.0F)) - upwind);
}

/// |grad phi| by first-order upwind differences.
inline float upwind_slope(const float* p, float side) {
  return std::sqrt((axis_slopes(p, Block::x_stride, side, false).upwind +
                    axis_slopes(p, Block::y_stride, side, false).upwind) +
                   axis_slopes(p, 1, side, false).upwind);
}

}  // namespace scarp
