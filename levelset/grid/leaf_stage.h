#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "levelset/grid/stencil.h"

namespace scarp {

/// A stage of a Runge-Kutta method: phi at the start of the time step, and a part of the way from
/// there to where an Euler step leads from the stage before. Nodes that do not move keep every bit.
///
/// Units: dt in spacings per (nm/s).
struct Stage {
  float dt = 0;
  float part = 1;
  float smallest_phi = 0;  ///< what comes nearer to the surface is moved off to the side it is on
  bool is_first = true;
  bool is_last = true;
};

/// What a kernel works on: phi at the start, after the stage before (with its halo), and the new
/// phi, for the nodes of a leaf that lie in the domain. The new phi may take the place of that at
/// the start.
struct LeafStage {
  const Block& before;
  const float* start;
  const std::uint64_t* active;
  Stage stage;
  std::array<int, 2> node_count;
  float* after;
  /// Rows with j ahead of i by more than this are mirror images of others, and stay for now.
  int most_ahead = leaf_edge;

  /// phi of a node that an Euler step takes to moved; what is not in the band stays.
  SCARP_KERNEL_PART void set(int node, float here, float moved) const {
    const float reached = std::abs(here) < LevelSet::half_width ? moved : here;
    const float phi = start[node] + stage.part * (reached - start[node]);
    after[node] = off_surface(phi, stage.smallest_phi);
  }

  /// Whether a row has nodes in the band to be moved. Others stay.
  SCARP_KERNEL_PART bool moves(int i, int j) const {
    return j - i <= most_ahead && ((active[i] >> (leaf_edge * j)) & 0xff) != 0;
  }
  SCARP_KERNEL_PART void keep_row(int i, int j) const {
    const int node = leaf_offset(i, j, 0);
    for (int k = 0; k < leaf_edge; ++k) after[node + k] = start[node + k];
  }
};

}  // namespace scarp
