#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/tri_mesh.h"

namespace scarp {

/// An order of the vertices and triangles of a mesh in which what lies close together is close in
/// memory.
struct SpatialOrder {
  std::vector<std::uint32_t> vertices;   ///< the vertex of the mesh at each place of the order
  std::vector<std::uint32_t> triangles;  ///< the same for triangles
};

/// Vertices by the cube of about 100 of them that they lie in, triangles by their first corner in
/// that order. Does not depend on the number of threads.
///
/// Cost: O(vertices + triangles), 0.1 us per vertex.
SpatialOrder spatial_order(const TriMesh& mesh);

TriMesh reordered(const TriMesh& mesh, const SpatialOrder& order);

/// Values of the vertices of the mesh, in the order; none for none.
std::vector<float> reordered(std::span<const float> values, const SpatialOrder& order);

}  // namespace scarp
