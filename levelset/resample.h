#pragma once

#include "core/triangle_tree.h"
#include "levelset/layers.h"

namespace scarp {

/// How far a surface is from a point of the domain, beyond periodic sides too.
double distance_to(const TriangleTree& surface, const Sides& sides, Vec3d r);

/// The same wafer on another grid of the same domain.
///
/// The surfaces of the layers, as they are extracted, have their distances measured anew: they move
/// by what linear facets leave of a curve within a cell, and lose what is finer than a cell of
/// either grid. Films stay films, however thin.
///
/// Cost: a closest-point query (see TriangleTree) per node of the new bands.
Layers resampled(const Layers& layers, const Frame& frame);

/// The wafer that a section through an axis stands for, between four sides, with its spacing or at
/// most so many cells from side to side. The outermost ring goes on into the corners.
Layers revolved(const Layers& section, int most_cells);
Frame revolved(const Frame& section, int most_cells);

}  // namespace scarp
