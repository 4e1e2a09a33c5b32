#pragma once

#include <vector>

#include "levelset/grid/layers.h"

namespace scarp {

/// Lets what grows pass over what does not move, next to which speeds are those of the latter.
///
/// Gas next to a mask knows the distance to the mask, which does not change; a film that comes
/// along would have to wait until it is nearer, node after node. Here such nodes look for the
/// distance to the film on ways through the gas (the eikonal equation from neighbour to neighbour,
/// first order; around the mask's edge through the mask's outermost nodes), and get the speed with
/// which the film, where it gets nearer than the mask within dt, ends at its place.
///
/// Shape: is_inert one per layer; speed 512 per leaf of the top's band, is changed.
/// Units: dt in s, speeds in nm/s.
void overgrow(const Layers& layers, const std::vector<bool>& is_inert, double dt,
              std::vector<float>& speed);

}  // namespace scarp
