#include "core/region_mesh.h"

#include <gtest/gtest.h>

namespace scarp {
namespace {

constexpr int nothing = RegionMesh::nothing;

/// Two boxes of 2 by 2, one on the other: 3 high in front of 1 high.
RegionMesh two_boxes() {
  RegionMesh mesh;
  mesh.lower = {0, 0, 0};
  mesh.upper = {2, 2, 4};
  mesh.regions = {{.name = "Si"}, {.name = "SiO2"}};
  mesh.bodies = {{0}, {1}};
  for (const double z : {0.0, 3.0, 4.0})
    for (const Vec3d r : {Vec3d{0, 0, z}, Vec3d{2, 0, z}, Vec3d{2, 2, z}, Vec3d{0, 2, z}})
      mesh.vertices.push_back(r);
  const auto quad = [&](const std::array<std::uint32_t, 4>& v, std::array<int, 2> bodies, int side,
                        int layer) {
    mesh.facets.push_back(
        {.corners = {v[0], v[1], v[2]}, .bodies = bodies, .side = side, .layer = layer});
    mesh.facets.push_back(
        {.corners = {v[0], v[2], v[3]}, .bodies = bodies, .side = side, .layer = layer});
  };
  quad({0, 3, 2, 1}, {0, nothing}, 4, nothing);
  quad({4, 5, 6, 7}, {0, 1}, nothing, 0);
  quad({8, 9, 10, 11}, {1, nothing}, nothing, 1);
  constexpr std::array<int, 4> sides{2, 1, 3, 0};
  for (std::uint32_t box = 0; box < 2; ++box) {
    for (std::uint32_t n = 0; n < 4; ++n) {
      const std::uint32_t a = 4 * box + n;
      const std::uint32_t b = 4 * box + (n + 1) % 4;
      quad({a, b, b + 4, a + 4}, {static_cast<int>(box), nothing}, sides[n], nothing);
    }
  }
  return mesh;
}

TEST(RegionMesh, AltitudeAndShapeOfATriangle) {
  const std::array<Vec3d, 3> right{Vec3d{0, 0, 0}, Vec3d{3, 0, 0}, Vec3d{0, 4, 0}};
  EXPECT_DOUBLE_EQ(least_altitude(right), 12.0 / 5);
  EXPECT_DOUBLE_EQ(shape_of(right), 12.0 / 25);
  EXPECT_EQ(least_altitude({Vec3d{1, 1, 1}, Vec3d{1, 1, 1}, Vec3d{1, 1, 1}}), 0);
}

TEST(RegionMesh, VolumesOfTwoBoxes) {
  RegionMesh mesh = two_boxes();
  const std::vector<double> volumes = region_volumes(mesh);
  EXPECT_NEAR(volumes[0], 12, 1e-12);
  EXPECT_NEAR(volumes[1], 4, 1e-12);
  mesh.regions[1].is_meshed = false;
  EXPECT_EQ(region_volumes(mesh)[1], 0);
}

TEST(RegionMesh, SidesMatchByFacetsAndMaterials) {
  RegionMesh mesh = two_boxes();
  EXPECT_FALSE(sides_match(mesh, 1));  // their diagonals cross
  const auto across = [](std::uint32_t v) { return v - v % 4 + (3 - v % 4); };
  std::erase_if(mesh.facets, [](const RegionMesh::Facet& facet) { return facet.side == 3; });
  const std::vector<RegionMesh::Facet> facets = mesh.facets;
  for (RegionMesh::Facet facet : facets) {
    if (facet.side != 2) continue;
    const auto [a, b, c] = facet.corners;
    facet.corners = {across(a), across(c), across(b)};
    facet.side = 3;
    mesh.facets.push_back(facet);
  }
  EXPECT_TRUE(sides_match(mesh, 1));
  RegionMesh other = mesh;
  other.facets.back().bodies[0] = 0;
  EXPECT_FALSE(sides_match(other, 1));
  mesh.vertices[6].z += 1e-9;
  EXPECT_FALSE(sides_match(mesh, 1));
}

TEST(RegionMesh, InnerPointsLieInTheirBodies) {
  const auto points = inner_points(two_boxes());
  ASSERT_TRUE(points[0] && points[1]);
  for (const auto& point : points) {
    EXPECT_GT(point->x, 0.1);
    EXPECT_LT(point->x, 1.9);
    EXPECT_GT(point->y, 0.1);
    EXPECT_LT(point->y, 1.9);
  }
  EXPECT_GT(points[0]->z, 0.1);
  EXPECT_LT(points[0]->z, 2.9);
  EXPECT_GT(points[1]->z, 3.1);
  EXPECT_LT(points[1]->z, 3.9);
}

TEST(RegionMesh, SidesOfAPlace) {
  const RegionMesh mesh = two_boxes();
  EXPECT_EQ(sides_at(mesh, {0, 1, 1}), 1U);
  EXPECT_EQ(sides_at(mesh, {2, 2, 4}), 2U + 8U + 32U);
  EXPECT_EQ(sides_at(mesh, {1, 1, 3}), 0U);
}

// Two triangles of different bodies in a square.
TEST(RegionMesh, LinesOfAFlatMesh) {
  RegionMesh mesh;
  mesh.is_flat = true;
  mesh.upper = {1, 0, 1};
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}};
  mesh.regions = {{.name = "Si"}, {.name = "SiO2"}};
  mesh.bodies = {{0}, {1}};
  mesh.facets = {{.corners = {0, 1, 2}, .bodies = {0, nothing}, .layer = 0},
                 {.corners = {0, 2, 3}, .bodies = {1, nothing}, .layer = 1}};
  const std::vector<RegionLine> lines = lines_of(mesh);
  ASSERT_EQ(lines.size(), 5U);
  int interfaces = 0;
  std::array<int, 6> sides{};
  for (const RegionLine& line : lines) {
    if (line.side != nothing) ++sides[static_cast<std::size_t>(line.side)];
    if (line.bodies[1] == nothing) continue;
    ++interfaces;
    EXPECT_EQ(line.bodies, (std::array<int, 2>{0, 1}));
    EXPECT_EQ(line.layer, 0);
    EXPECT_EQ(line.ends, (std::array<std::uint32_t, 2>{2, 0}));
  }
  EXPECT_EQ(interfaces, 1);
  EXPECT_EQ(sides, (std::array<int, 6>{1, 1, 0, 0, 1, 1}));
  EXPECT_NEAR(region_volumes(mesh)[0], 0.5, 1e-12);
}

}  // namespace
}  // namespace scarp
