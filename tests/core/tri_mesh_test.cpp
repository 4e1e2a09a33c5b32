#include "core/tri_mesh.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace scarp
