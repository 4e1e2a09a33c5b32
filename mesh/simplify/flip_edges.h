#pragma once

#include <span>

#include "mesh/simplify/collapse.h"
#include "mesh/simplify/edge_sizes.h"
#include "mesh/simplify/tracked_points.h"

namespace scarp {

/// Flips every inner edge whose flip lowers the sum of the squared distances of the tracked points
/// and of the shapes of the facets. Within the checks and the sizes; edges between two materials
/// stay.
///
/// shape_weight, reference, pass: as for relocate().
void flip_edges(CollapseMesh& mesh, CollapseChecks& checks, TrackedPoints& points,
                const EdgeSizes& sizes, double shape_weight, std::span<const Vec3d> reference,
                int pass);

}  // namespace scarp
