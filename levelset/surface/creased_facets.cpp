#include "levelset/surface/creased_facets.h"

#include <algorithm>
#include <cmath>

#include "core/smooth_edge.h"

namespace scarp {

namespace {

/// 0 of a facet without area.
Vec3d unit_normal(const TriMesh& mesh, std::uint32_t f) {
  const Vec3d area = area_vector(mesh, f);
  return length(area) > 0 ? normalized(area) : Vec3d{};
}

}  // namespace

std::vector<bool> creased_facets(const TriMesh& mesh) {
  std::vector<Vec3d> sums(mesh.vertices.size());
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    const Vec3d normal = unit_normal(mesh, f);
    for (const std::uint32_t v : mesh.triangles[f]) sums[v] += normal;
  }

  // Facets that all turn by less than half of the angle from their mean turn by less than it from
  // each other.
  const double cosine_of_half = std::sqrt(0.5 * (1 + smooth_cosine));
  std::vector<bool> is_creased(mesh.vertices.size(), false);
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    const Vec3d normal = unit_normal(mesh, f);
    for (const std::uint32_t v : mesh.triangles[f]) {
      if (!(dot(normal, sums[v]) > cosine_of_half * length(sums[v]))) is_creased[v] = true;
    }
  }

  std::vector<bool> result;
  result.reserve(mesh.triangles.size());
  for (const Triangle& corners : mesh.triangles)
    result.push_back(std::ranges::any_of(corners, [&](std::uint32_t v) { return is_creased[v]; }));
  return result;
}

}  // namespace scarp
