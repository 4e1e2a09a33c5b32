#pragma once

#include <span>

#include "mesh/simplify/collapse_mesh.h"
#include "mesh/simplify/star.h"

namespace scarp {

/// How far a facet is from equal sides, by its area over its squared sides: 0 for equal sides, 1
/// for no area. Between them nearly linear in the smallest angle: .25 at 30 degrees, .57 at 15. n
/// is twice the area vector.
inline double facet_shape(Vec3d a, Vec3d b, Vec3d c, Vec3d n) {
  constexpr double equal_sides = 3.4641016151377544;  // 2 sqrt(3)
  const double squares = dot(b - a, b - a) + dot(c - b, c - b) + dot(a - c, a - c);
  return squares > 0 ? 1 - equal_sides * length(n) / squares : 1;
}

/// How much the sum over the facets of a star grows when its centre moves to r. normals: twice the
/// area vectors of its facets then.
double shape_growth(const CollapseMesh& mesh, const Star& star, Vec3d r,
                    std::span<const Vec3d> normals);

}  // namespace scarp
