#pragma once

#include "mesh/collapse_mesh.h"

namespace scarp {

/// Removes facets without an area: needles by collapsing their short edge, caps by turning their
/// long one. Neither moves the surface by more than the rounding of its coordinates.
///
/// A facet stays if its neighbours forbid both; later collapses may remove it.
void remove_zero_area(CollapseMesh& mesh);

}  // namespace scarp
