#include "mesh/spatial_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "core/random.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

/// The vertices of a mesh in random order.
TriMesh shuffled(const TriMesh& mesh) {
  SpatialOrder order;
  order.vertices.resize(mesh.vertices.size());
  order.triangles.resize(mesh.triangles.size());
  std::iota(order.vertices.begin(), order.vertices.end(), 0);
  std::iota(order.triangles.begin(), order.triangles.end(), 0);
  RandomStream random({.seed = 5});
  for (auto* numbers : {&order.vertices, &order.triangles}) {
    for (std::size_t i = numbers->size(); i > 1; --i) {
      std::swap((*numbers)[i - 1], (*numbers)[random.bits() % i]);
    }
  }
  return reordered(mesh, order);
}

double mean_step(const TriMesh& mesh) {
  double sum = 0;
  for (std::size_t v = 1; v < mesh.vertices.size(); ++v) {
    sum += length(mesh.vertices[v] - mesh.vertices[v - 1]);
  }
  return sum / static_cast<double>(mesh.vertices.size() - 1);
}

TEST(SpatialOrder, HoldsEverythingOnce) {
  const TriMesh mesh = noisy_plane(60, 0.05);
  SpatialOrder order = spatial_order(mesh);
  for (auto* numbers : {&order.vertices, &order.triangles}) {
    std::sort(numbers->begin(), numbers->end());
    for (std::uint32_t i = 0; i < numbers->size(); ++i) ASSERT_EQ((*numbers)[i], i);
  }
  EXPECT_EQ(order.vertices.size(), mesh.vertices.size());
  EXPECT_EQ(order.triangles.size(), mesh.triangles.size());
}

TEST(SpatialOrder, PutsTogetherWhatLiesTogether) {
  const TriMesh mesh = shuffled(noisy_plane(100, 0.05));
  EXPECT_GT(mean_step(mesh), 40);
  EXPECT_LT(mean_step(reordered(mesh, spatial_order(mesh))), 10) << "the size of a cube";
}

TEST(SpatialOrder, KeepsTheTrianglesAndTheirMaterials) {
  TriMesh mesh = shuffled(noisy_plane(20, 0.05));
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    mesh.materials.push_back(corners(mesh, f)[0].x < 10 ? 1 : 2);
  }
  const SpatialOrder order = spatial_order(mesh);
  const TriMesh result = reordered(mesh, order);
  for (std::size_t f = 0; f < result.triangles.size(); ++f) {
    ASSERT_EQ(corners(result, f), corners(mesh, order.triangles[f]));
    ASSERT_EQ(result.materials[f], mesh.materials[order.triangles[f]]);
  }
  const std::vector<float> x = [&] {
    std::vector<float> values;
    for (const Vec3f& r : mesh.vertices) values.push_back(r.x);
    return reordered(values, order);
  }();
  for (std::size_t v = 0; v < x.size(); ++v) ASSERT_EQ(x[v], result.vertices[v].x);
}

}  // namespace
}  // namespace scarp
