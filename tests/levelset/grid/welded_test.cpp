#include "levelset/grid/welded.h"

#include <gtest/gtest.h>

#include "levelset/start/mesh_solid.h"

namespace scarp {
namespace {

/// Two tetrahedra that share an edge along z, on either side of it; 8 vertices.
TriMesh pair_at_an_edge() {
  TriMesh mesh;
  for (const float side : {-1.0F, 1.0F}) {
    const auto n = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), {{0, 0, 0}, {0, 0, 1}, {side, -1, 0}, {side, 1, 0}});
    mesh.triangles.insert(
        mesh.triangles.end(),
        {{n, n + 2, n + 1}, {n, n + 1, n + 3}, {n, n + 3, n + 2}, {n + 1, n + 2, n + 3}});
    if (side < 0) continue;
    for (std::size_t f = 4; f < 8; ++f) std::swap(mesh.triangles[f][1], mesh.triangles[f][2]);
  }
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

TEST(Welded, JoinsWhatLiesAtOnePlaceAndKeepsMaterials) {
  TriMesh square{.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}},
                 .triangles = {{0, 1, 2}, {0, 3, 1}, {3, 4, 5}},
                 .materials = {1, 2, 3}};
  EXPECT_TRUE(is_unwelded(square));
  const TriMesh joined = welded(square);
  EXPECT_EQ(joined.vertices, (std::vector<Vec3f>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
  EXPECT_EQ(joined.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(joined.materials, (std::vector<MaterialId>{1, 3}));
  EXPECT_FALSE(is_unwelded(joined));
}

TEST(Welded, BodiesThatMeetAtAnEdgeKeepVerticesOfTheirOwn) {
  const TriMesh pair = pair_at_an_edge();
  EXPECT_FALSE(is_unwelded(pair));
  const TriMesh apart = welded(pair);
  EXPECT_EQ(apart.vertices.size(), 8U);
  EXPECT_EQ(separate_parts(apart).size(), 2U);
  // Of one vertex at each place only the solid says what belongs together.
  TriMesh shared = pair;
  for (Triangle& t : shared.triangles) {
    for (std::uint32_t& v : t) v = v == 4 || v == 5 ? v - 4 : v;
  }
  const std::vector<TriMesh> parts = separate_parts(welded(shared));
  ASSERT_EQ(parts.size(), 2U);
  for (const TriMesh& part : parts) EXPECT_EQ(mesh_border(part), 0U);
}

TEST(Welded, WhatCannotBeToldApartStays) {
  TriMesh three = pair_at_an_edge();
  three.triangles.pop_back();
  three.triangles.push_back({0, 1, 7});
  for (Triangle& t : three.triangles) {
    for (std::uint32_t& v : t) v = v == 4 || v == 5 ? v - 4 : v;
  }
  EXPECT_EQ(welded(three).vertices.size(), 6U);
}

}  // namespace
}  // namespace scarp
