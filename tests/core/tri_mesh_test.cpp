#include "core/tri_mesh.h"

#include <gtest/gtest.h>

#include <cmath>

namespace scarp {
namespace {

// One triangle that faces up, one that faces -x, and one of zero area.
TriMesh three_triangles() {
  return {.vertices = {{0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, 4}},
          .triangles = {{0, 1, 2}, {0, 3, 2}, {0, 1, 1}},
          .materials = {}};
}

TEST(TriMesh, KnowsAreasAndNormals) {
  const TriMesh mesh = three_triangles();
  EXPECT_EQ(facet_areas(mesh), (std::vector<double>{3, 6, 0}));
  const std::vector<Vec3f> normals = facet_normals(mesh);
  EXPECT_EQ(normals[0], (Vec3f{0, 0, 1}));
  EXPECT_EQ(normals[1], (Vec3f{-1, 0, 0}));
  EXPECT_EQ(normals[2], (Vec3f{0, 0, 0}));
  EXPECT_EQ(area_vector(mesh, 0), (Vec3d{0, 0, 3}));
  EXPECT_EQ(corners(mesh, 1)[1], (Vec3d{0, 0, 4}));
}

TEST(TriMesh, KnowsItsBox) {
  TriMesh mesh = three_triangles();
  mesh.vertices.push_back({-9, 0, 9});  // of no triangle
  const Box box = bounding_box(mesh);
  EXPECT_EQ(box.lower, (Vec3d{0, 0, 0}));
  EXPECT_EQ(box.upper, (Vec3d{2, 3, 4}));
  const Box empty = bounding_box({});
  EXPECT_GT(empty.lower.x, empty.upper.x);
}

TEST(TriMesh, AnEdgeThatIsLongerThanACellTellsASimplifiedMesh) {
  TriMesh mesh;
  for (int n = 0; n < 36; ++n) mesh.vertices.push_back({n % 6 * 2.0F, n / 6 * 2.0F, 0});
  for (std::uint32_t n = 0; n < 30; ++n) {
    if (n % 6 == 5) continue;
    mesh.triangles.push_back({n, n + 1, n + 7});
    mesh.triangles.push_back({n, n + 7, n + 6});
  }
  EXPECT_NEAR(guessed_spacing(mesh), 2, 1e-9);
  EXPECT_FALSE(edge_beyond_cells(mesh));
  mesh.triangles.push_back({0, 5, 35});
  EXPECT_NEAR(edge_beyond_cells(mesh).value_or(0), std::sqrt(200.0), 1e-5);
}

}  // namespace
}  // namespace scarp
