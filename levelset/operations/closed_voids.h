#pragma once

#include "levelset/grid/band.h"
#include "levelset/surface/connectivity.h"

namespace scarp {

/// Nodes of closed voids, and of solid next to them: they hold the surface of the void.
bool holds_void(const Band& band, const OpenGas& gas, const Node& node);

/// Puts the voids of a band into another one where they are filled.
void take_over_voids(const Band& from, const OpenGas& gas, Band& to);

}  // namespace scarp
