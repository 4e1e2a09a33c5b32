#pragma once

#include <span>

#include "mesh/collapse_mesh.h"
#include "mesh/star.h"

namespace scarp {

/// How far a facet is from equal sides: its squared sides over its area, 1 for equal sides, at most
/// 20 (so that one needle does not outweigh everything else). n is twice the area vector.
double facet_shape(Vec3d a, Vec3d b, Vec3d c, Vec3d n);

/// How much the sum over the facets of a star grows when its centre moves to r. normals: twice the
/// area vectors of its facets then.
double shape_growth(const CollapseMesh& mesh, const Star& star, Vec3d r,
                    std::span<const Vec3d> normals);

}  // namespace scarp
