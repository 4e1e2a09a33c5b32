#pragma once

#include <vector>

#include "levelset/grid/band.h"
#include "levelset/grid/layers.h"
#include "levelset/motion/speed_field.h"

namespace scarp {

/// Which layers recede more slowly than others. Shape: one per layer, or empty where no speeds of
/// layers are known.
std::vector<bool> slow_layers(const SpeedField& field);
bool has_slow_layers(const SpeedField& field);

/// Takes back where a time step went through a layer faster than that can be etched.
///
/// Speeds belong to nodes, and a film much thinner than a spacing has none of its own: where the
/// surface arrives along it, nodes behind it move on with the layer above. Here no node's phi rises
/// by more than in dt the layers take that lie on its way, whose own phi knows where they are to
/// the last bit: a layer that does not move is never passed. Surfaces of lower layers that are open
/// beside a film go on as they were.
///
/// Shape: moved has the new phi of every leaf of the top's band, the layers still the old one.
/// Units: dt in spacings per (nm/s).
void limit_recession(const Layers& layers, const SpeedField& field, float dt, LeafValues& moved);

}  // namespace scarp
