#pragma once

#include "core/frame.h"
#include "core/tri_mesh.h"

namespace scarp {

/// The part of a surface with y <= x, of one that is its own mirror image across x = y; facets that
/// the plane cuts end there.
///
/// Vertices within a thousandth of a spacing of the plane move onto it, so that no facet becomes a
/// sliver; of those that meet there one stays. What lies on another side stays on it.
///
/// Shape: sides are those of a square with a corner on the plane.
TriMesh below_diagonal(const TriMesh& surface, const Sides& sides, double spacing);

}  // namespace scarp
