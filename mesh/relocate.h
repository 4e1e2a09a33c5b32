#pragma once

#include "mesh/collapse.h"
#include "mesh/tracked_points.h"

namespace scarp {

/// Moves every vertex that is free to where the squared distances of the tracked points around it
/// are least, within the checks, several times; shape_weight as in CurvatureOrder, here it also
/// draws vertices to the middle of their neighbours. Only moves that gain are made.
void relocate(CollapseMesh& mesh, CollapseChecks& checks, TrackedPoints& points,
              double shape_weight, int sweeps);

}  // namespace scarp
