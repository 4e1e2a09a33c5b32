// A public header: installed as scarp/core/tri_mesh.h.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/frame.h"
#include "core/material.h"
#include "core/vec3.h"

namespace scarp {

using Triangle = std::array<std::uint32_t, 3>;

/// A triangle mesh with shared vertices and, when it comes from a wafer, a material per triangle.
///
/// Shape: triangles index into vertices, counter-clockwise seen from the gas; materials is empty or
/// has one entry per triangle. Units: nm (for mesh files without a grid: the unit of the file).
struct TriMesh {
  std::vector<Vec3f> vertices;
  std::vector<Triangle> triangles;
  std::vector<MaterialId> materials;
};

/// An axis-aligned box; empty (lower > upper) until a point is added.
struct Box {
  Vec3d lower{1e300, 1e300, 1e300};
  Vec3d upper{-1e300, -1e300, -1e300};

  void add(Vec3d r) {
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = std::min(lower[axis], r[axis]);
      upper[axis] = std::max(upper[axis], r[axis]);
    }
  }
};

/// The box around the triangles; vertices that none of them uses do not count.
Box bounding_box(const TriMesh& mesh);

/// The three corners of a triangle in double precision.
std::array<Vec3d, 3> corners(const TriMesh& mesh, std::size_t triangle);

/// Half the cross product of two edges: length is the area, direction the outward normal.
Vec3d area_vector(const TriMesh& mesh, std::size_t triangle);

/// Outward unit normals, one per triangle; zero for triangles of zero area.
std::vector<Vec3f> facet_normals(const TriMesh& mesh);

/// Areas, one per triangle.
std::vector<double> facet_areas(const TriMesh& mesh);
/// The same, with what goes around the axis in axisymmetric frames.
std::vector<double> areas_around(const TriMesh& mesh, const Frame& frame);

/// The spacing of the grid that a mesh came from if it has two facets per cell, as marching cubes
/// gives them; too large for a simplified mesh.
double guessed_spacing(const TriMesh& mesh);

/// The longest edge of a mesh that looks simplified: one that is longer than a cell of the guessed
/// grid allows.
std::optional<double> edge_beyond_cells(const TriMesh& mesh);

}  // namespace scarp
