#pragma once

#include <array>

#include "levelset/stencil.h"

namespace scarp {

/// A stage of a Runge-Kutta method: phi at the start of the time step, and a part of the way from
/// there to where an Euler step leads from the stage before. Nodes that do not move keep every bit.
///
/// Units: dt in spacings per (nm/s).
struct Stage {
  float dt = 0;
  float part = 1;
};

/// What a kernel works on: phi at the start, after the stage before (with its halo), and the new
/// phi, for the nodes of a leaf that lie in the domain.
struct LeafStage {
  const Block& before;
  const float* start;
  Stage stage;
  std::array<int, 2> node_count;
  float* after;

  /// phi of a node that an Euler step takes to moved; what is not in the band stays.
  SCARP_KERNEL_PART void set(int node, float here, float moved) const {
    const float reached = std::abs(here) < LevelSet::half_width ? moved : here;
    after[node] = start[node] + stage.part * (reached - start[node]);
  }
};

}  // namespace scarp
