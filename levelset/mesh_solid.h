#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/frame.h"
#include "core/tri_mesh.h"
#include "core/triangle_tree.h"
#include "levelset/distance.h"

namespace scarp {

/// The mesh with corners at the same place made one vertex, and without triangles that this
/// collapses.
TriMesh welded(const TriMesh& mesh);

/// The number of edges with one triangle only; 0 for a closed mesh.
std::size_t mesh_border(const TriMesh& mesh);

/// Why a welded mesh is neither the surface of a body (closed, normals outwards) nor an open patch
/// over the whole domain (its border on the sides or beyond, normals upwards). Names the place.
std::optional<std::string> mesh_fault(const Frame& frame, const TriMesh& mesh);

/// What is inside a closed mesh, or below an open patch: signed distance, negative inside.
///
/// Exact for meshes that do not cut through themselves.
/// Shape:  a welded mesh without mesh_fault.
/// Cost:   a closest-point query; see TriangleTree.
/// Source: sign by the angle-weighted normal of the closest face, edge or vertex, Baerentzen and
///         Aanaes 2005.
class MeshSolid {
 public:
  explicit MeshSolid(const TriMesh& mesh);

  Distance operator()(Vec3d r) const;

 private:
  Vec3d outside(const ClosestPoint& closest) const;

  std::vector<Triangle> triangles_;
  std::vector<Vec3d> face_normals_;
  std::vector<Vec3d> vertex_normals_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3d> edge_normals_;  ///< lower vertex first
  TriangleTree tree_;
};

}  // namespace scarp
