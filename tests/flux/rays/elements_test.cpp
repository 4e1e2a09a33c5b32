#include "flux/rays/elements.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/random.h"
#include "flux/sampling/sampling.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

using exact::Builder;
using exact::Shape;

TEST(Elements, CoverTheirFacetsAndAreShort) {
  const RayScene scene = scene_of(exact::hole(5));
  const Elements elements(scene, 3);
  EXPECT_GT(elements.count(), scene.facet_count());
  for (std::size_t f = 0; f < scene.facet_count(); ++f) {
    double area = 0;
    for (const std::uint32_t e : elements.pieces_of_facet(f)) {
      EXPECT_EQ(elements.piece(e).facet, f);
      EXPECT_EQ(elements.element_of(e), e);
      const auto& [a, b, c] = elements.piece(e).corners;
      EXPECT_LE(std::max({length(b - a), length(c - b), length(a - c)}), 3);
      // Places are rounded to 1e-5 of a spacing, 100 spacings from the middle.
      EXPECT_NEAR(length(cross(b - a, c - a)) / 2, elements.area(e), 1e-5 * 3);
      EXPECT_GT(dot(cross(b - a, c - a), scene.normal(f)), 0);
      area += elements.area(e);
    }
    EXPECT_NEAR(area, scene.area(f), 1e-12 * area);
  }
}

TEST(Elements, AreFacetsWhereTheseAreShort) {
  const RayScene scene = scene_of(exact::flat_wafer(20, 10));
  const Elements elements(scene, 3);
  EXPECT_EQ(elements.count(), scene.facet_count());
  EXPECT_EQ(elements.piece_at(17, {0, 0, 0}), 17U);
}

TEST(Elements, AreFoundFromAPlaceOnTheFacet) {
  const RayScene scene = scene_of(exact::flat_wafer(100, 2));
  const Elements elements(scene, 3);
  RandomStream random({.seed = 1});
  for (std::uint32_t f = 0; f < scene.facet_count(); ++f) {
    for (int i = 0; i < 500; ++i) {
      const Vec3d w = sample_triangle({random.uniform(), random.uniform()});
      const auto& [a, b, c] = scene.corners(f);
      const Vec3d r = w.x * Vec3d(a) + w.y * Vec3d(b) + w.z * Vec3d(c);
      const auto& [p, q, s] = elements.piece(elements.piece_at(f, r)).corners;
      const Vec3d n = scene.normal(f);
      EXPECT_GE(dot(n, cross(q - p, r - p)), -1e-9);
      EXPECT_GE(dot(n, cross(s - q, r - q)), -1e-9);
      EXPECT_GE(dot(n, cross(p - s, r - s)), -1e-9);
    }
  }
}

TEST(JoinedElements, AreMadeOfNeighboursInACell) {
  Shape shape = exact::fine_trench();
  shape.mesh.materials.assign(shape.mesh.triangles.size(), 0);
  for (std::size_t f = 0; f < shape.mesh.triangles.size(); ++f)
    if (corners(shape.mesh, f)[0].z < -9.5) shape.mesh.materials[f] = 1;
  const RayScene scene = scene_of(shape);
  Elements elements(scene, 3);
  elements.join(shape.mesh, 2);
  EXPECT_LT(elements.count(), 0.2 * static_cast<double>(scene.facet_count()));
  std::vector<int> seen(scene.facet_count());
  for (std::uint32_t e = 0; e < elements.count(); ++e) {
    double area = 0;
    const std::uint32_t first = elements.piece(elements.pieces_of(e).front()).facet;
    Box box;
    for (const std::uint32_t p : elements.pieces_of(e)) {
      const Elements::Piece& piece = elements.piece(p);
      EXPECT_EQ(elements.element_of(p), e);
      EXPECT_EQ(shape.mesh.materials[piece.facet], shape.mesh.materials[first]);
      EXPECT_EQ(scene.normal(piece.facet).x, scene.normal(first).x);
      for (const Vec3d& corner : piece.corners) box.add(corner);
      area += piece.area;
      ++seen[piece.facet];
    }
    EXPECT_NEAR(area, elements.area(e), 1e-12);
    const Vec3d size = box.upper - box.lower;
    EXPECT_LE(std::max({size.x, size.y, size.z}), 4);
  }
  EXPECT_THAT(seen, ::testing::Each(1));
}

// Whether a mesh is fine or simplified hardly changes how many unknowns there are.
TEST(JoinedElements, AreMadeOfPiecesOfLongFacetsAsWell) {
  for (const int cells : {1, 4, 32}) {
    const Shape shape = exact::flat_wafer(32, cells);
    const RayScene scene = scene_of(shape);
    Elements elements(scene, 3);
    elements.join(shape.mesh, 4);
    EXPECT_EQ(elements.count(), 64U) << cells;
    for (std::uint32_t e = 0; e < elements.count(); ++e) EXPECT_NEAR(elements.area(e), 16, 8);
  }
}

// Down walls the flux changes faster than along them.
TEST(JoinedElements, AreTwiceAsLongAlongWalls) {
  const Shape shape = exact::fine_trench(16, 16);
  const RayScene scene = scene_of(shape);
  Elements elements(scene, 3);
  elements.join(shape.mesh, 4);
  for (std::uint32_t e = 0; e < elements.count(); ++e) {
    Box box;
    for (const std::uint32_t p : elements.pieces_of(e))
      for (const Vec3d& corner : elements.piece(p).corners) box.add(corner);
    const Vec3d size = box.upper - box.lower;
    const bool is_wall = std::abs(elements.normal(e).x) > 0.5;
    EXPECT_NEAR(size.y, is_wall ? 8 : 4, 1);
    EXPECT_LE(is_wall ? size.z : size.x, 5);
  }
}

TEST(JoinedElements, AreAsWideAsTheirFacetsSay) {
  const Shape shape = exact::flat_wafer(32, 32);
  const RayScene scene = scene_of(shape);
  std::vector<float> widths;
  for (std::size_t f = 0; f < scene.facet_count(); ++f)
    widths.push_back(corners(shape.mesh, f)[0].x < 16 ? 4.0F : 2.0F);
  Elements elements(scene, 3);
  elements.join(shape.mesh, widths);
  int wide = 0;
  int narrow = 0;
  for (std::uint32_t e = 0; e < elements.count(); ++e) {
    const std::uint32_t facet = elements.piece(elements.pieces_of(e).front()).facet;
    const float width = elements.cell_width(facet);
    EXPECT_EQ(width, widths[facet]);
    EXPECT_LE(elements.area(e), (width + 1) * (width + 1));
    ++(width == 4 ? wide : narrow);
  }
  EXPECT_EQ(wide, 32);
  EXPECT_EQ(narrow, 128);
}

// A quarter of a cylinder with a radius of 16 spacings turns by 28 degrees in a cell of 8.
TEST(JoinedElements, AreSmallerWhereTheSurfaceTurns) {
  Builder builder;
  for (int k = 0; k < 32; ++k) {
    const auto at = [&](int n) {
      const double angle = (n / 32.0 - 0.5) * std::numbers::pi / 2;
      return Vec3d{16 * std::sin(angle), 0, 16 * std::cos(angle)};
    };
    builder.grid(at(k), at(k + 1) - at(k), 1, {0, 16, 0}, 16);
  }
  const Shape shape{builder.mesh, {.lower = {-16, 0}, .upper = {16, 16}}};
  const RayScene scene = scene_of(shape);
  Elements elements(scene, 3);
  elements.join(shape.mesh, 8);
  for (std::uint32_t e = 0; e < elements.count(); ++e) {
    EXPECT_GT(length(elements.normal(e)), 0.99);
    EXPECT_LT(elements.area(e), 8 * 5);
  }
}

// Both slopes of a roof of 20 degrees face upwards.
TEST(JoinedElements, EndAtAnEdge) {
  Builder builder;
  const double rise = std::tan(20 * std::numbers::pi / 180);
  builder.grid({0, 0, 0}, {5, 0, 5 * rise}, 5, {0, 8, 0}, 8);
  builder.grid({5, 0, 5 * rise}, {5, 0, -5 * rise}, 5, {0, 8, 0}, 8);
  const Shape shape{builder.mesh, {.lower = {0, 0}, .upper = {10, 8}}};
  const RayScene scene = scene_of(shape);
  Elements elements(scene, 3);
  elements.join(shape.mesh, 2);
  EXPECT_LT(elements.count(), 0.3 * static_cast<double>(scene.facet_count()));
  for (std::uint32_t e = 0; e < elements.count(); ++e) {
    const auto pieces = elements.pieces_of(e);
    const double x = scene.normal(elements.piece(pieces.front()).facet).x;
    for (const std::uint32_t p : pieces)
      EXPECT_NEAR(scene.normal(elements.piece(p).facet).x, x, 1e-6);
  }
}

// Two sheets in one cell that face the same way are apart.
TEST(JoinedElements, AreConnected) {
  Builder builder;
  builder.grid({0, 0, 0}, {8, 0, 0}, 8, {0, 8, 0}, 8);
  builder.grid({0, 0, 0.5}, {8, 0, 0}, 8, {0, 8, 0}, 8);
  const Shape shape{builder.mesh, {.lower = {0, 0}, .upper = {8, 8}}};
  const RayScene scene = scene_of(shape);
  Elements elements(scene, 3);
  elements.join(shape.mesh, 2);
  for (std::uint32_t e = 0; e < elements.count(); ++e) {
    const auto pieces = elements.pieces_of(e);
    for (const std::uint32_t p : pieces)
      EXPECT_EQ(elements.piece(p).corners[0].z, elements.piece(pieces.front()).corners[0].z);
  }
  EXPECT_LE(elements.count(), 2U * 25);
}

// What holds for all facets of an element is its mean by area; on a facet it is that of its pieces.
TEST(JoinedElements, TakeMeansByArea) {
  const Shape shape = exact::fine_trench();
  const RayScene scene = scene_of(shape);
  Elements elements(scene, 3);
  elements.join(shape.mesh, 2);
  for (std::uint32_t e = 0; e < elements.count(); ++e) {
    double sum = 0;
    for (const std::uint32_t p : elements.pieces_of(e))
      sum += elements.piece(p).area * elements.piece(p).facet;
    EXPECT_NEAR(elements.mean(e, [](std::uint32_t f) { return f; }), sum / elements.area(e), 1e-9);
    for (const std::uint32_t p : elements.pieces_of(e))
      EXPECT_EQ(elements.mean_on_facet(elements.piece(p).facet, [](std::uint32_t k) { return k; }),
                e);
  }
}

}  // namespace
}  // namespace scarp
