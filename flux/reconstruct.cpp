#include "flux/reconstruct.h"

#include <cstdint>
#include <string>

#include "core/error.h"
#include "core/parallel.h"

namespace scarp {

namespace {

constexpr double least_cosine = 0.766;  // of 40 degrees

// The facets around each vertex in one array: those of vertex v from first[v] to first[v + 1].
struct VertexFacets {
  std::vector<std::uint32_t> first;
  std::vector<std::uint32_t> facets;
};

VertexFacets vertex_facets(const TriMesh& mesh) {
  VertexFacets result;
  result.first.resize(mesh.vertices.size() + 1);
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) ++result.first[v + 1];
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) result.first[v + 1] += result.first[v];
  result.facets.resize(result.first.back());
  std::vector<std::uint32_t> next(result.first.begin(), result.first.end() - 1);
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f)
    for (const std::uint32_t v : mesh.triangles[f]) result.facets[next[v]++] = f;
  return result;
}

}  // namespace

std::vector<std::array<float, 3>> corner_values(const TriMesh& mesh,
                                                std::span<const float> facet_values) {
  SCARP_ASSERT(facet_values.size(), ==, mesh.triangles.size());
  const VertexFacets around = vertex_facets(mesh);
  const std::vector<double> areas = facet_areas(mesh);
  const std::vector<Vec3f> normals = facet_normals(mesh);
  const auto belongs = [&](std::uint32_t f, std::uint32_t g) {
    if (!mesh.materials.empty() && mesh.materials[f] != mesh.materials[g]) return false;
    return f == g || dot(Vec3d(normals[f]), Vec3d(normals[g])) > least_cosine;
  };

  std::vector<std::array<float, 3>> values(mesh.triangles.size());
  parallel_for(values.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (auto f = static_cast<std::uint32_t>(begin); f < end; ++f) {
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const std::uint32_t v = mesh.triangles[f][corner];
        double sum = 0;
        double area = 0;
        for (std::uint32_t i = around.first[v]; i < around.first[v + 1]; ++i) {
          const std::uint32_t g = around.facets[i];
          if (!belongs(f, g)) continue;
          sum += areas[g] * static_cast<double>(facet_values[g]);
          area += areas[g];
        }
        values[f][corner] = area > 0 ? static_cast<float>(sum / area) : facet_values[f];
      }
    }
  });
  return values;
}

}  // namespace scarp
