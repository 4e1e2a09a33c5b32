#include "mesh/regions/remesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace scarp {
namespace {

constexpr int nothing = RegionMesh::nothing;

/// A surface z = height(x, y) over a square of cells, as the interface between two bodies without
/// sides.
template <class F>
RegionMesh sheet(std::uint32_t cells, const F& height) {
  RegionMesh mesh;
  mesh.upper = {static_cast<double>(cells), static_cast<double>(cells), 100};
  mesh.lower = {0, 0, -100};
  mesh.regions = {{.name = "Si"}, {.kind = MeshRegion::Kind::gas, .name = "gas"}};
  mesh.bodies = {{0}, {1}};
  for (std::uint32_t j = 0; j <= cells; ++j)
    for (std::uint32_t i = 0; i <= cells; ++i)
      mesh.vertices.push_back({1.0 * i, 1.0 * j, height(1.0 * i, 1.0 * j)});
  for (std::uint32_t j = 0; j < cells; ++j) {
    for (std::uint32_t i = 0; i < cells; ++i) {
      const std::uint32_t v = j * (cells + 1) + i;
      const auto add = [&](const Triangle& corners) {
        mesh.facets.push_back({.corners = corners, .bodies = {0, 1}, .side = nothing, .layer = 0});
      };
      add({v, v + 1, v + cells + 2});
      add({v, v + cells + 2, v + cells + 1});
    }
  }
  return mesh;
}

TriMesh surface_of(const RegionMesh& mesh) {
  TriMesh surface;
  for (const Vec3d& r : mesh.vertices) surface.vertices.emplace_back(r);
  for (const RegionMesh::Facet& facet : mesh.facets) surface.triangles.push_back(facet.corners);
  return surface;
}

double area(const RegionMesh& mesh) {
  double sum = 0;
  for (const RegionMesh::Facet& facet : mesh.facets) {
    const auto [a, b, c] = corners(mesh, facet);
    sum += length(cross(b - a, c - a)) / 2;
  }
  return sum;
}

TEST(Remesh, AFlatSheetBecomesCoarse) {
  const RegionMesh mesh = sheet(24, [](double, double) { return 1.0; });
  const std::vector<TriMesh> surfaces{surface_of(mesh)};
  const RegionMesh coarse = remesh(mesh, surfaces, {.spacing = 1, .size = 4, .max_distance = 0.05});
  EXPECT_LT(6 * coarse.facets.size(), mesh.facets.size());
  EXPECT_NEAR(area(coarse), 24 * 24, 1e-9);
  const RegionQuality found = quality(coarse, surfaces, 1, 4);
  EXPECT_LT(found.max_distance, 1e-9);
  EXPECT_EQ(found.thin_facets, 0U);
  EXPECT_GE(found.least_altitude, 0.3);
}

TEST(Remesh, AWaveKeepsItsDistance) {
  const RegionMesh mesh = sheet(24, [](double x, double y) { return std::sin(x / 3) + y / 10; });
  const std::vector<TriMesh> surfaces{surface_of(mesh)};
  const RegionMesh coarse = remesh(mesh, surfaces, {.spacing = 1, .size = 4, .max_distance = 0.05});
  EXPECT_LT(coarse.facets.size(), mesh.facets.size());
  const RegionQuality found = quality(coarse, surfaces, 1, 4);
  EXPECT_LE(found.max_distance, 0.1);
  EXPECT_LE(found.reverse_max_distance, 0.1);
}

// The reference has its edge between the rows of vertices.
TEST(Remesh, VerticesMoveToAnEdge) {
  constexpr double edge = 7.4;
  const auto roof = [](double x, double) { return 5 - std::abs(x - edge); };
  const RegionMesh mesh = sheet(16, roof);
  RegionMesh exact = mesh;
  for (Vec3d& r : exact.vertices)
    if (r.x == 7) r = {edge, r.y, 5};
  const std::vector<TriMesh> surfaces{surface_of(exact)};
  EXPECT_GT(quality(mesh, surfaces, 1, 1).max_distance, 0.2);
  EXPECT_LE(quality(mesh, surfaces, 1, 1).max_plain_distance, 1e-6);
  const RegionMesh sharp = remesh(mesh, surfaces, {.spacing = 1, .size = 1, .max_distance = 0.05});
  EXPECT_LE(quality(sharp, surfaces, 1, 1).max_distance, 0.05);
  EXPECT_LE(quality(sharp, surfaces, 1, 1).reverse_max_distance, 0.05);
}

/// Two bodies of a flat mesh with a roof between them, in rows of squares that the heights stretch.
template <class F>
RegionMesh flat_roof(std::uint32_t cells, const F& height) {
  RegionMesh mesh;
  const std::uint32_t half = cells / 2;
  const double top = cells;
  mesh.is_flat = true;
  mesh.upper = {top, 0, top};
  mesh.regions = {{.name = "Si"}, {.kind = MeshRegion::Kind::gas, .name = "gas"}};
  mesh.bodies = {{0}, {1}};
  for (std::uint32_t j = 0; j <= cells; ++j) {
    for (std::uint32_t i = 0; i <= cells; ++i) {
      const double z = height(1.0 * i);
      mesh.vertices.push_back(
          {1.0 * i, 0, j <= half ? z * j / half : z + (top - z) * (j - half) / half});
    }
  }
  for (std::uint32_t j = 0; j < cells; ++j) {
    for (std::uint32_t i = 0; i < cells; ++i) {
      const std::uint32_t v = j * (cells + 1) + i;
      const int body = j < half ? 0 : 1;
      const auto add = [&](const Triangle& corners) {
        mesh.facets.push_back({.corners = corners, .bodies = {body, nothing}, .layer = body});
      };
      add({v, v + 1, v + cells + 2});
      add({v, v + cells + 2, v + cells + 1});
    }
  }
  return mesh;
}

TEST(Remesh, VerticesOfAFlatMeshMoveToACorner) {
  constexpr double ridge = 7.4;
  const auto roof = [](double x) { return 10 - (x < ridge ? 0.2 : 0.8) * std::abs(x - ridge); };
  const RegionMesh mesh = flat_roof(16, roof);
  TriMesh exact;
  for (const double x : {0.0, ridge, 16.0})
    for (const double y : {-1.0, 1.0}) exact.vertices.emplace_back(Vec3d{x, y, roof(x)});
  exact.triangles = {{0, 2, 3}, {0, 3, 1}, {2, 4, 5}, {2, 5, 3}};
  const std::vector<TriMesh> surfaces{exact};
  EXPECT_GT(quality(mesh, surfaces, 1, 1).max_distance, 0.15);
  const RegionMesh sharp = remesh(mesh, surfaces, {.spacing = 1, .size = 1, .max_distance = 0.05});
  EXPECT_LE(quality(sharp, surfaces, 1, 1).max_distance, 1e-3);
  EXPECT_LE(quality(sharp, surfaces, 1, 1).reverse_max_distance, 1e-3);
  const double below = (roof(0) + 10) / 2 * ridge + (10 + roof(16)) / 2 * (16 - ridge);
  EXPECT_NEAR(region_volumes(sharp)[0], below, 1e-3 * 16);
}

TEST(Remesh, ANeedleGoes) {
  RegionMesh mesh = sheet(8, [](double, double) { return 0.0; });
  mesh.vertices[4 * 9 + 4] = {4.95, 4.02, 0};
  const std::vector<TriMesh> surfaces{surface_of(mesh)};
  EXPECT_LT(quality(mesh, surfaces, 1, 1).least_altitude, 0.1);
  const RegionMesh good = remesh(mesh, surfaces, {.spacing = 1, .size = 1, .max_distance = 0.05});
  EXPECT_GE(quality(good, surfaces, 1, 1).least_altitude, 0.3);
  EXPECT_NEAR(area(good), 64, 1e-9);
}

// Three tenths of a spacing are little next to facets of four.
TEST(Remesh, AFacetIsThinForItsTargetSize) {
  RegionMesh mesh = sheet(4, [](double, double) { return 0.0; });
  const std::vector<TriMesh> surfaces{surface_of(mesh)};
  for (Vec3d& r : mesh.vertices) r.y *= 0.35;
  EXPECT_EQ(quality(mesh, surfaces, 1, 1).thin_facets, 0U);
  const RegionQuality found = quality(mesh, surfaces, 1, 4);
  EXPECT_EQ(found.thin_facets, mesh.facets.size());
  EXPECT_NEAR(found.least_relative_altitude, found.least_altitude / 4, 1e-12);
}

// What happens to a vertex on a periodic side happens to its image.
TEST(Remesh, PeriodicSidesStayAlike) {
  const auto wave = [](double x, double y) {
    const auto angle = [](double place) { return std::numbers::pi / 8 * std::fmod(place, 16); };
    return std::sin(angle(x)) * std::cos(angle(y));
  };
  RegionMesh mesh = sheet(16, wave);
  // Facets stand on the sides, too: from the sheet down to the lower end, 8 below.
  mesh.lower[2] = -8;
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (std::uint32_t v = 0; v < first; ++v) {
    Vec3d r = mesh.vertices[v];
    r.z = -8;
    mesh.vertices.push_back(r);
  }
  const auto add_side = [&](std::uint32_t a, std::uint32_t b, int side) {
    for (const Triangle& corners : {Triangle{a, b, a + first}, Triangle{b, b + first, a + first}}) {
      RegionMesh::Facet facet{.corners = corners, .bodies = {0, nothing}, .side = side};
      if (side % 2 != side / 2) std::swap(facet.corners[1], facet.corners[2]);
      mesh.facets.push_back(facet);
    }
  };
  for (std::uint32_t n = 0; n < 16; ++n) {
    add_side(17 * n, 17 * (n + 1), 0);
    add_side(17 * n + 16, 17 * (n + 1) + 16, 1);
    add_side(n, n + 1, 2);
    add_side(17 * 16 + n, 17 * 16 + n + 1, 3);
  }
  ASSERT_TRUE(sides_match(mesh, 0));
  ASSERT_TRUE(sides_match(mesh, 1));
  const std::vector<TriMesh> surfaces{surface_of(sheet(16, wave))};
  for (const bool is_periodic : {true, false}) {
    mesh.is_periodic = {is_periodic, is_periodic};
    const RegionMesh coarse =
        remesh(mesh, surfaces, {.spacing = 1, .size = 4, .max_distance = 0.05});
    EXPECT_LT(coarse.facets.size(), mesh.facets.size());
    EXPECT_EQ(sides_match(coarse, 0) && sides_match(coarse, 1), is_periodic);
  }
}

// The room between two sheets is thinner than they may move.
TEST(Remesh, SheetsDoNotCross) {
  const auto lower = [](double x, double y) { return std::sin(0.8 * x) * std::sin(y); };
  RegionMesh mesh = sheet(16, lower);
  const RegionMesh upper = sheet(16, [&](double x, double y) { return lower(x, y) + 0.15; });
  std::vector<TriMesh> surfaces{surface_of(mesh), surface_of(upper)};
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), upper.vertices.begin(), upper.vertices.end());
  mesh.bodies.push_back({1});
  for (RegionMesh::Facet facet : upper.facets) {
    for (std::uint32_t& v : facet.corners) v += first;
    facet.bodies = {1, 2};
    facet.layer = 1;
    mesh.facets.push_back(facet);
  }
  const RegionMesh coarse = remesh(mesh, surfaces, {.spacing = 1, .size = 4, .max_distance = 0.6});
  for (const RegionMesh::Facet& facet : coarse.facets) {
    const auto [a, b, c] = corners(coarse, facet);
    const Vec3d n = cross(b - a, c - a);
    EXPECT_GT(n.z, 0);
    // Centres of the upper sheet lie over all of the lower one.
    if (facet.layer != 1) continue;
    const Vec3d centre = (a + b + c) / 3.0;
    for (const RegionMesh::Facet& other : coarse.facets) {
      if (other.layer != 0) continue;
      const auto [p, q, s] = corners(coarse, other);
      const Vec3d m = cross(q - p, s - p);
      const auto inside = [&](const Vec3d& from, const Vec3d& to) {
        return (to.x - from.x) * (centre.y - from.y) - (to.y - from.y) * (centre.x - from.x) >= 0;
      };
      if (!inside(p, q) || !inside(q, s) || !inside(s, p)) continue;
      EXPECT_GT(dot(centre - p, m), 0);
    }
  }
}

}  // namespace
}  // namespace scarp
