#include "core/tri_mesh.h"

#include <algorithm>

namespace scarp {

Box bounding_box(const TriMesh& mesh) {
  Box box;
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) box.add(Vec3d(mesh.vertices[v]));
  }
  return box;
}

std::array<Vec3d, 3> corners(const TriMesh& mesh, std::size_t triangle) {
  const Triangle& t = mesh.triangles[triangle];
  return {Vec3d(mesh.vertices[t[0]]), Vec3d(mesh.vertices[t[1]]), Vec3d(mesh.vertices[t[2]])};
}

Vec3d area_vector(const TriMesh& mesh, std::size_t triangle) {
  const auto [a, b, c] = corners(mesh, triangle);
  return 0.5 * cross(b - a, c - a);
}

std::vector<Vec3f> facet_normals(const TriMesh& mesh) {
  std::vector<Vec3f> normals(mesh.triangles.size());
  for (std::size_t f = 0; f < normals.size(); ++f)
    normals[f] = Vec3f(normalized(area_vector(mesh, f)));
  return normals;
}

std::vector<double> facet_areas(const TriMesh& mesh) {
  std::vector<double> areas(mesh.triangles.size());
  for (std::size_t f = 0; f < areas.size(); ++f) areas[f] = length(area_vector(mesh, f));
  return areas;
}

}  // namespace scarp
