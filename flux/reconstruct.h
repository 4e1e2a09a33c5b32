#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/tri_mesh.h"

namespace scarp {

/// Values at the three corners of every facet from values on facets: linear on a facet, continuous
/// where the surface is smooth, with a step at edges and at borders of materials.
///
/// A corner takes the mean, weighted by area, over the facets around its vertex whose normal is
/// within 40 degrees of its own facet's and whose material is the same. Facets at a domain side
/// average over their side of it. The integral is kept where every facet around a vertex counts
/// for every other, which holds but for strong curvature. Means of standard errors bound those of
/// the corners.
///
/// Shape: facet_values and result have one entry per facet; corners in the order of the triangle.
/// Cost:  O(n).
std::vector<std::array<float, 3>> corner_values(const TriMesh& mesh,
                                                std::span<const float> facet_values);

}  // namespace scarp
