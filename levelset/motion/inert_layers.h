#pragma once

#include "levelset/grid/band.h"
#include "levelset/grid/layers.h"
#include "levelset/motion/speed_field.h"

namespace scarp {

/// Whether some layers do not move while others move.
bool has_standing_layers(const SpeedField& field);

/// Takes back what a time step removed from layers that do not move.
///
/// Speeds next to the line where such a layer (a mask) meets one that moves belong to the nearest
/// surface, so the moving one reaches over by part of a spacing. Here both ends of every edge that
/// is cut on the standing layer's surface keep their phi: no vertex of that surface moves by one
/// bit. Gas that is nearer to what moves than to the layer's wall knows nothing of that: its phi
/// becomes the distance to the wall as what moves goes. Where the surface arrives at the layer from
/// below, or goes down along a wall that stood against what is below the layer, it is put on the
/// buried interface; where a wall goes on from above, on that.
/// Growth remains. What is left of a film beside such a layer goes with it once it is thinner than
/// 0.05 spacings; the volume of these residues is reported.
///
/// Shape: moved has the new phi of every leaf of the top's band, the layers still the old one; room
///        for as many values, what they are does not matter.
/// Units: dt in spacings per (nm/s), the volume in spacings cubed.
double keep_inert_layers(const Layers& layers, const SpeedField& field, float dt, LeafValues& moved,
                         LeafValues& room);

}  // namespace scarp
