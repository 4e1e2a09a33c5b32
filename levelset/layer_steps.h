#pragma once

#include "levelset/layers.h"

namespace scarp {

// What acts on the layers at once, without a speed and without time.

/// The highest point of the surface that gas from the source can reach. Units: nm.
double highest_point(const Layers& layers);

/// Takes away all solid above the plane z = height, of every layer; never adds any.
///
/// Next to the plane phi is the distance to it to the last bit. Voids that the plane cuts are open
/// then; solid may be left that nothing joins to the wafer (see remove_islands).
///
/// Units: nm.
void planarise(Layers& layers, double height);

/// Coats what gas from the source can reach with a film of the same thickness everywhere, which
/// belongs to the top layer (see add_layer): all gas within that distance of the surface becomes
/// solid.
///
/// The distance is that to the extracted surface, or, up to a spacing, phi itself: the film is as
/// exact as those are. Convex edges are rounded by the thickness, gaps narrower than twice the
/// thickness are filled. Gas behind a neck is coated until the neck is shut, which
/// shutting_thicknesses() finds among up to 2^26 nodes below overhangs, and films thicker than a
/// spacing. Closed voids stay as they are to the last bit.
///
/// Units: nm, > 0.
/// Cost:  a few closest-point queries per node of the new band.
void coat(Layers& layers, double thickness);

/// The highest point of a material, seen or buried; minus infinity if there is none of it.
///
/// Units: nm.
double highest_point(const Layers& layers, MaterialId material);

}  // namespace scarp
