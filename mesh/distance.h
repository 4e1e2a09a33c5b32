#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/tri_mesh.h"
#include "core/triangle_tree.h"

namespace scarp {

/// How far one surface is from another, over the places that were measured.
///
/// Units: as the meshes.
struct DistanceStatistics {
  double max = 0;
  double mean = 0;
  double rms = 0;
  double p99 = 0;  ///< 99 of 100 places are nearer
};

/// From A to B and from B to A.
struct SurfaceDistance {
  DistanceStatistics forward;
  DistanceStatistics reverse;
  double symmetric_max = 0;
};

/// Distance of each place to the surface of a tree.
///
/// Shape: one value per place. Cost: about 1 us per place, on all threads.
std::vector<double> distances(std::span<const Vec3d> places, const TriangleTree& to);

/// The vertices of a mesh that a triangle uses, in their order.
std::vector<Vec3d> surface_vertices(const TriMesh& mesh);

/// Places that cover a mesh: no point of it is further than spacing from one of them. Corners and
/// edges are included.
std::vector<Vec3d> surface_samples(const TriMesh& mesh, double spacing);

/// A number that no point of a mesh is further from the surface of another one than. It is at most
/// `slack` above the distance of some point, unless the facets would have to be cut more than a
/// thousandfold along their edges for that, or to more than 600 000 parts and 64 for each.
///
/// Cost: four queries per facet, and as many per quarter of those that reach across an edge of the
///       other mesh beyond the slack.
double proven_distance(const TriMesh& from, const TriMesh& to, double slack);

/// All zero if there are no values.
DistanceStatistics statistics(std::span<const double> distances);

/// Vertices of one mesh against the surface of the other, both ways. With a spacing above 0, dense
/// samples (surface_samples) instead of the vertices.
///
/// Throws: InputError if a mesh has no triangles.
SurfaceDistance surface_distance(const TriMesh& a, const TriMesh& b, double spacing = 0);

}  // namespace scarp
