#pragma once

#include "mesh/simplify/collapse_mesh.h"

namespace scarp {

/// Removes facets without an area: needles by collapsing their short edge, caps by turning their
/// long one. Returns how far the surface has moved at most, which is the rounding of coordinates
/// unless facets are large.
///
/// A facet stays if its neighbours forbid both, or if the surface would move further than `most`;
/// later collapses may remove it.
double remove_zero_area(CollapseMesh& mesh, double most);

}  // namespace scarp
