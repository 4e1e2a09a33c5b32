#pragma once

#include <cstddef>

#include "core/vec3.h"
#include "levelset/grid/level_set.h"

namespace scarp {

/// How far phi is from a distance at the nodes with a neighbour on the other side of the surface,
/// by |grad phi| with the steeper difference along each axis: 1 on a plane, more and less at edges
/// and where fronts meet.
///
/// Units: nm.
struct SurfaceSlopes {
  std::size_t nodes = 0;
  std::size_t off = 0;  ///< of them those whose slope is below 1/2 or above 2, or not a number
  float worst = 1;      ///< the slope furthest from 1, as a factor; not a number where there is one
  Vec3d worst_at{};
};

/// Cost: about 5 ns per node of the band, a thousandth to a hundredth of a time step.
SurfaceSlopes surface_slopes(const LevelSet& phi);

}  // namespace scarp
