#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/tri_mesh.h"
#include "levelset/grid/distance.h"

namespace scarp {

/// The number of edges with one triangle only; 0 for a closed mesh.
std::size_t mesh_border(const TriMesh& mesh);

/// The parts of a welded mesh that no edge joins, in the order of their first triangles.
std::vector<TriMesh> separate_parts(const TriMesh& mesh);

/// How far a mesh reaches, along an axis or across its largest triangle, whichever is least.
double thickness(const TriMesh& mesh);

/// Why a welded mesh is neither the surface of bodies (closed, normals outwards, or inwards for
/// cavities of a body) nor one open patch over the whole domain (its border on the sides or beyond,
/// normals upwards), or that it is folded: triangles of one part lie on each other. Names the
/// place. Cost: two closest-point queries per triangle.
std::optional<std::string> mesh_fault(const Frame& frame, const TriMesh& mesh);

/// What is inside a closed mesh, or below an open patch: signed distance, negative inside.
///
/// Parts may overlap and contain each other: solid is what lies in any body and not in a cavity of
/// that body, which is where the mesh winds around a point more often than not at all. Exact for
/// parts that do not cut through themselves, except inside, where parts overlap: the distance is
/// that of solids put together.
/// Shape:  a welded mesh without mesh_fault.
/// Cost:   a closest-point query (see TriangleTree) for every part that may be the nearest one.
/// Source: sign by the angle-weighted normal of the closest face, edge or vertex, Baerentzen and
///         Aanaes 2005.
class MeshSolid {
 public:
  explicit MeshSolid(const TriMesh& mesh);
  ~MeshSolid();

  Distance operator()(Vec3d r) const;

 private:
  class Part;
  struct Body;

  std::vector<Body> bodies_;
};

}  // namespace scarp
