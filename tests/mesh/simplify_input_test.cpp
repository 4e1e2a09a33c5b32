#include "mesh/simplify/simplify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "core/error.h"
#include "mesh/distance.h"
#include "mesh/sides.h"
#include "tests/mesh/generated_surface.h"
#include "tests/mesh/quality.h"

// What the input may look like.

namespace scarp {
namespace {

using testing::HasSubstr;

TEST(SimplifyInput, MeasuresLargeFacetsAsDenselyAsTheInput) {
  TriMesh mesh = wavy_film(30, 3);
  mesh.triangles.resize(mesh.triangles.size() / 2);
  const SimplifyResult result =
      simplify(mesh, {.sides = sides_of(mesh), .spacing = 1, .vertices = 6});
  const double dense = surface_distance(mesh, result.mesh, 0.1).reverse.max;
  EXPECT_LE(result.reverse_max_distance, dense + 0.01);
  EXPECT_GE(result.reverse_max_distance, dense - 0.1);
}

TEST(SimplifyInput, VerticesOfNoTriangleDoNotCount) {
  TriMesh mesh = noisy_plane(10, 0.02);
  const SimplifyResult without = simplify(mesh, {.sides = sides_of(mesh), .spacing = 1});
  mesh.vertices.push_back({-50, 70, 9});
  const SimplifyResult with = simplify(mesh, {.sides = sides_of(mesh), .spacing = 1});
  EXPECT_EQ(with.mesh.vertices, without.mesh.vertices);
  EXPECT_EQ(with.mesh.triangles, without.mesh.triangles);
}

// An open boundary that leaves a side and comes back to it: a triangle less at the side of a plane.
TEST(SimplifyInput, FillsNoNotchAtASide) {
  TriMesh mesh = noisy_plane(10, 0);
  const auto at_side = [&](const Triangle& t) {
    return std::ranges::count_if(t, [&](std::uint32_t v) { return mesh.vertices[v].x == 0; }) == 2;
  };
  mesh.triangles.erase(std::find_if(mesh.triangles.begin() + 50, mesh.triangles.end(), at_side));
  const auto area = [](const TriMesh& surface) {
    double sum = 0;
    for (const double each : facet_areas(surface)) sum += each;
    return sum;
  };
  for (const SimplifyMethod method : {SimplifyMethod::curvature, SimplifyMethod::paper,
                                      SimplifyMethod::lindstrom_turk, SimplifyMethod::length}) {
    const SimplifyResult result = simplify(
        mesh, {.method = method, .sides = sides_of(mesh), .spacing = 1, .max_error = 0.02});
    EXPECT_LT(result.mesh.vertices.size(), mesh.vertices.size() / 2);
    EXPECT_NEAR(area(result.mesh), area(mesh), 0.02 * 2.5);
  }
}

TEST(SimplifyInput, ABoundOfZeroMovesNothing) {
  const TriMesh mesh = noisy_plane(6, 0.1);
  for (const SimplifyMethod method : {SimplifyMethod::curvature, SimplifyMethod::lindstrom_turk}) {
    const SimplifyResult result =
        simplify(mesh, {.method = method, .sides = sides_of(mesh), .spacing = 1, .max_error = 0});
    EXPECT_EQ(surface_distance(mesh, result.mesh).symmetric_max, 0);
  }
}

// Beside a vertex far out facets are as long as it is far, and their heights small against that.
TEST(SimplifyInput, FacetsThatAreThinAgainstTheirLengthKeepTheBound) {
  TriMesh mesh = noisy_plane(30, 0.1);
  mesh.vertices[mesh.vertices.size() / 2].x = 20'000;
  const SimplifyResult result =
      simplify(mesh, {.method = SimplifyMethod::lindstrom_turk, .spacing = 1, .max_error = 0.001});
  EXPECT_LE(surface_distance(mesh, result.mesh).forward.max, 0.001);
}

TEST(SimplifyInput, BadInputIsRefused) {
  const TriMesh mesh = noisy_plane(6, 0);
  const auto message = [](const TriMesh& input, const SimplifyOptions& options) {
    try {
      simplify(input, options);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(message({}, {}), HasSubstr("no triangles"));
  EXPECT_THAT(message({mesh.vertices, {{1, 1, 2}}, {}}, {}), HasSubstr("three different corners"));
  EXPECT_THAT(message(mesh, {.remove = 1.0}), HasSubstr("remove: 1.0"));
  EXPECT_THAT(message(mesh, {.remove = -0.1}), HasSubstr("outside [0, 1)"));
  EXPECT_THAT(message(mesh, {.l0 = -1}), HasSubstr("l0: -1"));
  EXPECT_THAT(message(mesh, {.max_error = std::nan("")}), HasSubstr("max_error"));
  EXPECT_THAT(message(mesh, {.l_max = std::numeric_limits<double>::infinity()}),
              HasSubstr("l_max"));
  TriMesh fin = mesh;
  fin.vertices.push_back({3, 3, 9});
  fin.triangles.push_back({fin.triangles[20][0], fin.triangles[20][1], 49});
  EXPECT_THAT(message(fin, {}), HasSubstr("not a 2-manifold"));
}

// Two sheets at one place, which pass through each other as soon as one of them moves: without a
// bound of the caller's it is halved until they do not, and then they are kept.
TEST(SimplifyInput, EndsWhereSheetsLieOnEachOther) {
  constexpr std::uint32_t count = 11;
  TriMesh mesh;
  for (std::uint32_t v = 0; v < count * count; ++v)
    mesh.vertices.push_back({static_cast<float>(v % count), static_cast<float>(v / count),
                             0.2F * std::sin(static_cast<float>(v))});
  for (std::uint32_t j = 0; j + 1 < count; ++j) {
    for (std::uint32_t i = 0; i + 1 < count; ++i) {
      const std::uint32_t v = j * count + i;
      mesh.triangles.push_back({v, v + 1, v + count + 1});
      mesh.triangles.push_back({v, v + count + 1, v + count});
    }
  }
  const std::size_t facets = mesh.triangles.size();
  for (std::size_t v = 0; v < count * count; ++v) mesh.vertices.push_back(mesh.vertices[v]);
  for (std::size_t f = 0; f < facets; ++f) {
    const Triangle t = mesh.triangles[f];
    mesh.triangles.push_back({t[0] + count * count, t[2] + count * count, t[1] + count * count});
  }
  for (const SimplifyMethod method : {SimplifyMethod::curvature, SimplifyMethod::lindstrom_turk})
    EXPECT_FALSE(simplify(mesh, {.method = method}).mesh.triangles.empty());
}

/// Of radius 1, its ends fans around their middles.
TriMesh drawn_cylinder(std::uint32_t corners_around, float height, std::uint32_t rings) {
  TriMesh mesh;
  for (std::uint32_t ring = 0; ring <= rings; ++ring) {
    for (std::uint32_t i = 0; i < corners_around; ++i) {
      const double phi = 2 * std::numbers::pi * i / corners_around;
      mesh.vertices.push_back({static_cast<float>(std::cos(phi)), static_cast<float>(std::sin(phi)),
                               height * static_cast<float>(ring) / static_cast<float>(rings)});
    }
  }
  const auto bottom = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back({0, 0, 0});
  mesh.vertices.push_back({0, 0, height});
  for (std::uint32_t i = 0; i < corners_around; ++i) {
    const std::uint32_t j = (i + 1) % corners_around;
    for (std::uint32_t ring = 0; ring < rings; ++ring) {
      const std::uint32_t a = ring * corners_around;
      const std::uint32_t b = a + corners_around;
      mesh.triangles.push_back({a + i, a + j, b + j});
      mesh.triangles.push_back({a + i, b + j, b + i});
    }
    const std::uint32_t top = rings * corners_around;
    mesh.triangles.push_back({bottom, j, i});
    mesh.triangles.push_back({bottom + 1, top + i, top + j});
  }
  return mesh;
}

// A prism of eleven sides is within .04 of a cylinder; .1 is asked for.
TEST(SimplifyInput, DrawnCylindersAreReducedAsFarAsTheBoundAllows) {
  struct Case {
    std::uint32_t corners_around;
    float height;
    std::uint32_t rings;
  };
  for (const Case& each : {Case{32, 10, 1}, Case{200, 1, 1}, Case{200, 10, 1}, Case{64, 2, 20}}) {
    const TriMesh mesh = drawn_cylinder(each.corners_around, each.height, each.rings);
    const SimplifyResult result =
        simplify(mesh, {.max_error = 0.1, .thin_facets = ThinFacets::exact});
    EXPECT_LE(result.mesh.vertices.size(), 28U) << each.corners_around << ' ' << each.height;
    EXPECT_LE(result.proven_distance, 0.1);
    EXPECT_LE(proven_distance(mesh, result.mesh, 0.02), 0.1);
    EXPECT_LE(proven_distance(result.mesh, mesh, 0.02), 0.1);
    EXPECT_EQ(find_defects(result.mesh, mesh, {}).non_manifold_edges, 0U);
    EXPECT_EQ(find_defects(result.mesh, mesh, {}).zero_area, 0U);
  }
}

}  // namespace
}  // namespace scarp
