#pragma once

#include "levelset/surface/connectivity.h"

namespace scarp {

class PhaseGraph;

/// The closed voids of a band as if there were no other surface.
///
/// Only nodes next to a void keep what it is once it has closed: those around them also know how
/// far the open surface is, which moves on. Here they know of the voids alone, so what is read of a
/// void, with its edges and corners, stays the same to the last bit.
struct ClosedGas {
  LevelSet phi;  ///< a lid far above all voids bounds the solid
  OpenGas gas;   ///< of phi: the voids are open, what is above the lid is not; lists no voids
};

/// gas: the graph of the band.
///
/// Cost: as 16 time steps of the surface of the voids and of the lid, which is flat.
ClosedGas closed_gas(const Band& band, const PhaseGraph& gas);

}  // namespace scarp
