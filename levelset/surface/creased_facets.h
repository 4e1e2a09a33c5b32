#pragma once

#include <vector>

#include "core/tri_mesh.h"

namespace scarp {

/// Of each facet whether it may meet another one, at an edge or a vertex, across which the surface
/// is not smooth (core/smooth_edge.h). It errs on the side of creases.
std::vector<bool> creased_facets(const TriMesh& mesh);

}  // namespace scarp
