#pragma once

#include <span>

#include "levelset/grid/layers.h"

namespace scarp {

/// A film on some materials alone, of the top layer (see add_layer): all open gas that is no
/// further than the thickness from where one of them is exposed, on the shortest way through the
/// gas. So the film grows over the edges of a material sideways as far as upwards, and around
/// corners, but not through walls. Does not look for necks.
///
/// Units: nm, > 0.
/// Error: 0.15 spacings on walls of other materials, a third of a spacing behind each corner; films
///        go through walls thinner than half a spacing.
/// Cost:  per node within the thickness a closest-point query and a look at the straight way.
void coat_on(Layers& layers, double thickness, std::span<const MaterialId> materials);

}  // namespace scarp
