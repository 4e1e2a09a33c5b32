#include "levelset/surface/creased_facets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace scarp {
namespace {

/// Three strips of two facets each along y: a floor, another one, and one that is turned up by an
/// angle in degrees.
TriMesh bent_strip(double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  const Vec3f bent(Vec3d{2 + std::cos(angle), 0, std::sin(angle)});
  TriMesh mesh;
  for (const Vec3f& r : {Vec3f{0, 0, 0}, Vec3f{1, 0, 0}, Vec3f{2, 0, 0}, bent}) {
    mesh.vertices.push_back(r);
    mesh.vertices.push_back(r + Vec3f{0, 1, 0});
  }
  for (std::uint32_t v = 0; v < 6; v += 2) {
    mesh.triangles.push_back({v, v + 2, v + 1});
    mesh.triangles.push_back({v + 2, v + 3, v + 1});
  }
  return mesh;
}

TEST(CreasedFacets, MeetOthersAtAnAngle) {
  const std::vector<bool> around_the_edge{false, false, true, true, true, true};
  EXPECT_EQ(creased_facets(bent_strip(90)), around_the_edge);
  EXPECT_EQ(creased_facets(bent_strip(41)), around_the_edge);
  EXPECT_EQ(creased_facets(bent_strip(15)), std::vector<bool>(6, false));
}

// Whatever their neighbours: nothing is known of their normal.
TEST(CreasedFacets, AreThoseAtFacetsWithoutArea) {
  TriMesh mesh = bent_strip(0);
  mesh.vertices[7] = mesh.vertices[6] = mesh.vertices[5];
  EXPECT_TRUE(creased_facets(mesh)[5]);
  EXPECT_TRUE(creased_facets(mesh)[3]);
  EXPECT_FALSE(creased_facets(mesh)[0]);
}

}  // namespace
}  // namespace scarp
