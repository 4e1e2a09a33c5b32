#include "tests/mesh/quality.h"
#include "mesh/sides.h"

#include <gtest/gtest.h>

#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

TEST(AngleStatistics, OfKnownTriangles) {
  const TriMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {100, 1, 0}}, {{0, 1, 2}, {0, 3, 2}}, {}};
  const AngleStatistics angles = angle_statistics(mesh);
  EXPECT_NEAR(angles.lowest, 0.57294, 1e-4);  // arc tangent of 1/100
  EXPECT_NEAR(angles.mean_minimum, (45 + 0.57294) / 2, 1e-4);
  EXPECT_DOUBLE_EQ(angles.below_5, 0.5);
  EXPECT_DOUBLE_EQ(angles.below_20, 0.5);
}

class DefectsTest : public testing::Test {
 protected:
  DefectsTest() : original_(noisy_plane(10, 0.02)), sides_(sides_of(original_)) {}
  Defects of(const TriMesh& mesh) const { return find_defects(mesh, original_, sides_); }
  TriMesh original_;
  Sides sides_;
};

TEST_F(DefectsTest, AMeshHasNoneAgainstItself) {
  const Defects none = of(original_);
  EXPECT_EQ(none.non_manifold_edges, 0U);
  EXPECT_EQ(none.zero_area, 0U);
  EXPECT_EQ(none.flipped, 0U);
  EXPECT_EQ(none.off_plane, 0U);
  EXPECT_EQ(none.lost_corners, 0U);
}

TEST_F(DefectsTest, EachKindIsFound) {
  TriMesh mesh = original_;
  std::swap(mesh.triangles[30][0], mesh.triangles[30][1]);
  EXPECT_EQ(of(mesh).flipped, 1U);
  EXPECT_EQ(flipped_facets(mesh, original_), std::vector<std::uint32_t>{30});
  EXPECT_EQ(of(mesh).non_manifold_edges, 3U);

  mesh = original_;
  mesh.triangles.push_back({3, 4, 4});
  EXPECT_EQ(of(mesh).zero_area, 1U);

  mesh = original_;
  for (Vec3f& r : mesh.vertices) {
    if (r.x == 0 && r.y == 5) r.x = 0.1F;
    if (r.x == 10 && r.y == 10) r.z += 0.1F;
  }
  EXPECT_EQ(of(mesh).off_plane, 1U);
  EXPECT_EQ(of(mesh).lost_corners, 1U);

  mesh = original_;
  for (Vec3f& r : mesh.vertices) {
    if (r.x == 1 && r.y == 5) r.x = -0.1F;
  }
  EXPECT_EQ(of(mesh).off_plane, 1U);
}

}  // namespace
}  // namespace scarp
