#include "mesh/diagonal_cut.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "mesh/distance.h"
#include "mesh/simplify/simplify.h"
#include "mesh/surface_fault.h"
#include "tests/mesh/generated_surface.h"
#include "tests/mesh/quality.h"
#include "tests/mesh/self_intersections.h"

namespace scarp {
namespace {

const Grid grid{.cells = {20, 20, 20}};

Sides triangle() {
  Sides sides = grid.sides();
  sides.diagonal = true;
  return sides;
}

// Its own mirror image, with a crease along the diagonal here and there.
TriMesh symmetric_surface(std::uint64_t seed) {
  const Shape landscape = random_landscape(grid.cells, seed);
  return polygonised(grid, [=](Vec3d r) {
    return landscape({std::max(r.x, r.y), std::min(r.x, r.y), r.z});
  });
}

double area_of(const TriMesh& mesh) {
  const std::vector<double> areas = facet_areas(mesh);
  return std::accumulate(areas.begin(), areas.end(), 0.0);
}

TEST(DiagonalCut, IsHalfOfTheSurfaceAndEndsOnTheDiagonal) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const TriMesh surface = symmetric_surface(seed);
    const TriMesh half = below_diagonal(surface, triangle(), 1);
    const auto fault = surface_fault(half, triangle());
    ASSERT_FALSE(fault) << seed << ": " << fault->text;
    for (const Vec3f& r : half.vertices) ASSERT_LE(r.y, r.x);
    EXPECT_NEAR(2 * area_of(half), area_of(surface), 5e-3 * area_of(surface)) << seed;
    Vec3d seen;
    for (std::size_t f = 0; f < half.triangles.size(); ++f) seen += area_vector(half, f);
    EXPECT_NEAR(seen.z, triangle().area(), 1e-3) << seed;
  }
}

TEST(DiagonalCut, VerticesNextToTheDiagonalMoveOntoItAndMeetThere) {
  // Two mirror images a hair apart, one on the diagonal but for rounding, one at a side.
  const TriMesh surface{
      .vertices = {{5.0002F, 5, 0},
                   {5, 5.0002F, 0},
                   {0, 0.0001F, 0},
                   {20, 19.9999F, 0},
                   {20, 0, 0},
                   {0, 20, 0}},
      .triangles = {{2, 4, 0}, {2, 0, 1}, {2, 1, 5}, {0, 4, 3}, {1, 0, 3}, {1, 3, 5}},
      .materials = {1, 2, 3, 4, 5, 6}};
  const TriMesh half = below_diagonal(surface, triangle(), 1);
  EXPECT_EQ(half.materials, (std::vector<MaterialId>{1, 4}));
  EXPECT_EQ(half.vertices,
            (std::vector<Vec3f>{{0, 0, 0}, {20, 0, 0}, {5.0001F, 5.0001F, 0}, {20, 20, 0}}));
  EXPECT_EQ(surface_fault(half, triangle()), std::nullopt);
}

TEST(DiagonalCut, IsSimplifiedAsBetweenOtherSides) {
  for (const SimplifyMethod method : {SimplifyMethod::curvature, SimplifyMethod::paper}) {
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      const TriMesh half = below_diagonal(symmetric_surface(seed), triangle(), 1);
      SimplifyOptions options{.method = method, .sides = triangle()};
      options.remove = 0.6;
      options.max_error = 0.3;
      const SimplifyResult result = simplify(half, options);
      EXPECT_LT(result.mesh.vertices.size(), 0.8 * static_cast<double>(half.vertices.size()));
      const auto fault = surface_fault(result.mesh, triangle());
      EXPECT_FALSE(fault) << seed << ": " << fault->text;
      const Defects defects = find_defects(result.mesh, half, triangle());
      EXPECT_EQ(defects.off_plane + defects.lost_corners + defects.non_manifold_edges, 0U) << seed;
      const SurfaceDistance distance = surface_distance(result.mesh, half, 1);
      EXPECT_LE(std::max(distance.forward.max, distance.reverse.max), 0.3) << seed;
    }
  }
}

}  // namespace
}  // namespace scarp
