#pragma once

#include <span>

#include "mesh/simplify/collapse.h"
#include "mesh/simplify/tracked_points.h"

namespace scarp {

/// Moves every vertex that is free to where the squared distances of the tracked points around it
/// are least, within the checks; shape_weight as in PassOrder, here it also draws vertices to
/// the middle of their neighbours. Only moves that gain are made.
///
/// reference: per facet, the normal that all moves and flips together may turn little against.
/// Vertices at the seams of the blocks stay, which lie elsewhere in the next pass (blocks.h).
void relocate(CollapseMesh& mesh, CollapseChecks& checks, TrackedPoints& points,
              double shape_weight, std::span<const Vec3d> reference, int pass);

}  // namespace scarp
