#pragma once

#include <span>

#include "mesh/collapse.h"
#include "mesh/curvature_order.h"
#include "mesh/tracked_points.h"

namespace scarp {

/// Flips every inner edge whose flip lowers what the order of the collapses weighs: the squared
/// distances of the tracked points, and the shapes of the facets. Within the checks and the order's
/// sizes; edges between two materials stay.
///
/// reference, pass: as for relocate().
void flip_edges(CollapseMesh& mesh, CollapseChecks& checks, TrackedPoints& points,
                const CurvatureOrder& order, std::span<const Vec3d> reference, int pass);

}  // namespace scarp
