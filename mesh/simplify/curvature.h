#pragma once

#include <span>
#include <vector>

#include "mesh/simplify/collapse_mesh.h"

namespace scarp {

/// Mean curvature at each vertex, positive where the solid bulges into the gas.
///
/// Vertices on a side of the domain see the mirrored surface behind it; on other boundaries, and
/// where no facet has an area, the curvature is 0.
///
/// Shape:  one value per vertex (copies of touching sheets included).
/// Units:  1 / length of the mesh. A sphere of radius R has 1/R, a cylinder 1/(2R).
/// Source: Meyer, Desbrun, Schroeder and Barr 2003, eq. 8 (with the sum of the cotangents) and the
///         mixed area of fig. 4.
std::vector<double> mean_curvature(const CollapseMesh& mesh);

/// One pass of averaging over the neighbours, which takes most of the noise of a mesh away.
std::vector<double> smoothed(std::span<const double> values, const HalfEdges& half_edges);

/// The |curvature| above which a vertex belongs to a feature rather than to noise.
///
/// The noise is what a value differs from the mean of its neighbours: a smooth surface, however
/// curved, differs little. Never below the curvature of an edge rounded over 8 mean edge lengths.
double feature_threshold(std::span<const double> curvature, const CollapseMesh& mesh);

}  // namespace scarp
