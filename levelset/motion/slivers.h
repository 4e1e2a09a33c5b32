#pragma once

#include "levelset/grid/band.h"
#include "levelset/grid/layers.h"
#include "levelset/motion/speed_field.h"

namespace scarp {

/// Takes away what a time step left of a fast layer over a slow one for want of nodes, though it
/// has been etched:
///
/// - slivers: the slow layer is seen, but one end of an edge of the grid still has phi of a surface
///   up to a quarter of a spacing above it, and moves no faster than what is seen;
/// - feet of sheets: the flanks of a sheet meet between two nodes, so the node in its middle turns
///   to gas at once, and on the edge below it up to a spacing seems left, which would go from above
///   alone. Now as much is left as the flanks have still to go.
///
/// Shape: moved has the new phi of every leaf of the top's band, the layers still the old one.
void clear_slivers(const Layers& layers, const SpeedField& field, LeafValues& moved);

}  // namespace scarp
