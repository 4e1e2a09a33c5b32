#pragma once

#include "levelset/grid/layers.h"

namespace scarp {

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
