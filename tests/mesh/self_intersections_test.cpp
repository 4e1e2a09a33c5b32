#include "tests/mesh/self_intersections.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

TEST(SelfIntersections, AreCountedByThePair) {
  TriMesh mesh = noisy_plane(10, 0.05);
  EXPECT_EQ(self_intersections(mesh), 0U);
  // A triangle upright through the middle of one facet.
  const auto p = corners(mesh, 57);
  const Vec3d middle = (p[0] + p[1] + p[2]) / 3.0;
  const auto v = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const Vec3d d : {Vec3d{0, 0, -1}, {0.01, 0, 1}, {0, 0.01, 1}}) {
    mesh.vertices.push_back(Vec3f(middle + d));
  }
  mesh.triangles.push_back({v, v + 1, v + 2});
  EXPECT_EQ(self_intersections(mesh), 1U);
  // One that shares a vertex with the facet it passes through.
  mesh.triangles.back()[2] = mesh.triangles[57][0];
  EXPECT_EQ(self_intersections(mesh), 1U);
  // One that touches it with this vertex only.
  mesh.triangles.back() = {v + 1, v + 2, mesh.triangles[57][0]};
  EXPECT_EQ(self_intersections(mesh), 0U);
}

TEST(SelfIntersections, OfATangleAreThoseOfAllPairs) {
  TriMesh tangle;
  RandomStream random({.seed = 3});
  const auto draw = [&random] { return static_cast<float>(random.uniform()); };
  for (std::uint32_t f = 0; f < 300; ++f) {
    const Vec3f centre{5 * draw(), 5 * draw(), 5 * draw()};
    for (int i = 0; i < 3; ++i) {
      tangle.vertices.push_back(centre + Vec3f{draw(), draw(), draw()});
    }
    tangle.triangles.push_back({3 * f, 3 * f + 1, 3 * f + 2});
  }
  std::size_t count = 0;
  for (std::uint32_t f = 0; f < 300; ++f) {
    for (std::uint32_t g = 0; g < f; ++g) {
      using self_intersections_detail::edge_pierces;
      count += edge_pierces(tangle, f, g) || edge_pierces(tangle, g, f) ? 1 : 0;
    }
  }
  EXPECT_GT(count, 20U);
  EXPECT_EQ(self_intersections(tangle), count);
}

}  // namespace
}  // namespace scarp
