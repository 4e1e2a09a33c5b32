#pragma once

#include <cstddef>

#include "levelset/grid/layers.h"

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

/// Where coat() has not looked for necks. Units: nm.
struct NecksLeftOut {
  std::size_t node_count = 0;  ///< 0: it has looked everywhere
  double lowest = 0;
  double highest = 0;
};

/// Coats what gas from the source can reach with a film of the same thickness everywhere, which
/// belongs to the top layer (see add_layer): all gas within that distance of the surface becomes
/// solid.
///
/// The distance is that to the extracted surface, or, up to a spacing, phi itself: the film is as
/// exact as those are. Convex edges are rounded by the thickness, gaps narrower than twice the
/// thickness are filled. Gas behind a neck is coated until the neck is shut (see
/// shutting_thicknesses()), but throughout where the nodes below overhangs are more than
/// most_nodes. Closed voids stay as they are to the last bit.
///
/// Units: nm, > 0.
/// Cost:  a few closest-point queries per node of the new band.
NecksLeftOut coat(Layers& layers, double thickness, std::size_t most_nodes = std::size_t{1} << 26);

/// The highest point of a material, seen or buried; minus infinity if there is none of it.
///
/// Units: nm.
double highest_point(const Layers& layers, MaterialId material);

}  // namespace scarp
