#pragma once

#include <vector>

#include "levelset/grid/layers.h"
#include "levelset/motion/speed_field.h"

namespace scarp {

/// What an etched crystal does next to the foot of a mask, as if the crystal had no mask there.
///
/// Shape: 512 values per leaf of the top's band; both empty if there is no such foot.
struct FreeFoot {
  std::vector<float> phi;   ///< for differences in the place of the top's; NaN: take the top's
  std::vector<float> most;  ///< phi after the time step at most
};

/// From the foot of a mask on there is the wall that undercuts it most slowly, whatever the floor
/// does.
///
/// The top's phi tells nothing of this wall: in the mask it is the distance to the mask's own
/// surface, and in the crystal behind the foot that to the foot, where normals fan out to planes
/// that etch fast. So phi there is the distance to the wall's plane, and no node passes that plane
/// faster than the wall etches. The plane is where the wall has got to, by the nodes of the crystal
/// next to the surface.
///
/// Left out are feet within four spacings of a convex corner of a mask, where planes that etch fast
/// take the wall away.
///
/// Shape: mobility as by mobilities(). Units: dt in spacings per (nm/s).
FreeFoot free_foot(const Layers& layers, const SpeedField& field,
                   const std::vector<float>& mobility, float dt);

}  // namespace scarp
