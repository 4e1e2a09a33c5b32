#include "flux/reconstruct.h"

#include <cstdint>
#include <string>

#include "core/error.h"
#include "core/parallel.h"

namespace scarp {

namespace {

constexpr double least_cosine = 0.766;  // of 40 degrees

}  // namespace

SmoothCorners::SmoothCorners(const TriMesh& mesh)
    : mesh_(mesh),
      first_(mesh.vertices.size() + 1),
      areas_(facet_areas(mesh)),
      normals_(facet_normals(mesh)) {
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) ++first_[v + 1];
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) first_[v + 1] += first_[v];
  around_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f)
    for (const std::uint32_t v : mesh.triangles[f]) around_[next[v]++] = f;
}

bool SmoothCorners::belongs(std::uint32_t f, std::uint32_t g) const {
  if (!mesh_.materials.empty() && mesh_.materials[f] != mesh_.materials[g]) return false;
  return f == g || dot(Vec3d(normals_[f]), Vec3d(normals_[g])) > least_cosine;
}

std::vector<std::array<float, 3>> corner_values(const TriMesh& mesh,
                                                std::span<const float> facet_values) {
  SCARP_ASSERT(facet_values.size(), ==, mesh.triangles.size());
  const SmoothCorners corners(mesh);
  std::vector<std::array<float, 3>> values(mesh.triangles.size());
  parallel_for(values.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (auto f = static_cast<std::uint32_t>(begin); f < end; ++f) {
      for (std::size_t corner = 0; corner < 3; ++corner) {
        double sum = 0;
        double area = 0;
        corners.for_each(f, corner, [&](std::uint32_t g, double area_of_g) {
          sum += area_of_g * static_cast<double>(facet_values[g]);
          area += area_of_g;
        });
        values[f][corner] = area > 0 ? static_cast<float>(sum / area) : facet_values[f];
      }
    }
  });
  return values;
}

}  // namespace scarp
