#include "core/tri_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

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

std::vector<double> areas_around(const TriMesh& mesh, const Frame& frame) {
  std::vector<double> areas = facet_areas(mesh);
  for (std::size_t f = 0; f < areas.size(); ++f) {
    const auto [a, b, c] = corners(mesh, f);
    areas[f] *= frame.around((a.x + b.x + c.x) / 3);
  }
  return areas;
}

double guessed_spacing(const TriMesh& mesh) {
  const std::vector<double> areas = facet_areas(mesh);
  const double area = std::accumulate(areas.begin(), areas.end(), 0.0);
  return std::sqrt(2 * area / static_cast<double>(areas.size()));
}

std::optional<double> edge_beyond_cells(const TriMesh& mesh) {
  // The diagonal of a cube, and a tenth because the guess may be low.
  constexpr double longest_of_cell = 1.1 * std::numbers::sqrt3;
  double longest = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto [a, b, c] = corners(mesh, f);
    longest = std::max({longest, length(b - a), length(c - b), length(a - c)});
  }
  if (longest <= longest_of_cell * guessed_spacing(mesh)) return std::nullopt;
  return longest;
}

}  // namespace scarp
