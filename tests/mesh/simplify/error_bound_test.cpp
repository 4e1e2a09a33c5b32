#include "mesh/simplify/error_bound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "core/random.h"
#include "mesh/distance.h"
#include "mesh/simplify/collapse.h"
#include "mesh/simplify/placement.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

/// A flat hexagon of two rings with a tip of the given height in its middle.
TriMesh tent(float height) {
  TriMesh mesh{{{0, 0, height}}, {}, {}};
  for (const float radius : {1.0F, 2.0F}) {
    for (const Vec3f r :
         {Vec3f{2, 0, 0}, {1, 2, 0}, {-1, 2, 0}, {-2, 0, 0}, {-1, -2, 0}, {1, -2, 0}}) {
      mesh.vertices.push_back(radius * r);
    }
  }
  for (std::uint32_t i = 1; i <= 6; ++i) {
    const std::uint32_t j = i % 6 + 1;
    mesh.triangles.push_back({0, i, j});
    mesh.triangles.push_back({i, i + 6, j + 6});
    mesh.triangles.push_back({i, j + 6, j});
  }
  return mesh;
}

/// The half edge from the tip to rim vertex 1, and its star.
struct TipEdge {
  explicit TipEdge(const CollapseMesh& mesh) {
    mesh.topology.for_each_outgoing(0, [&](std::uint32_t g) {
      if (mesh.topology.target(g) == 1) h = g;
    });
    star.gather(mesh.topology, h);
  }
  std::uint32_t h = 0;
  Star star;
};

/// What a collapse asks of its checks, in the same order.
bool allows(CollapseChecks& checks, const CollapseMesh& mesh, std::uint32_t h, Vec3d r) {
  return checks.gather(mesh, h, r) && checks.keeps_surface(mesh, h) && checks.keeps_bound(mesh);
}

/// Two facets whose common edge, from vertex 0 to 1, lies .2 above that between the other two.
TriMesh saddle() {
  return {{{-1, 0, 0.1F}, {1, 0, 0.1F}, {0, 1, -0.1F}, {0, -1, -0.1F}}, {{0, 1, 2}, {1, 0, 3}}, {}};
}

TEST(ErrorBound, OfAFlipIsTheHeightBetweenTheEdges) {
  const CollapseMesh mesh(saddle(), {});
  Star star;
  star.gather_flip(mesh.topology, 0);
  ErrorBound strict(2, {0.199});
  EXPECT_FALSE(strict.allows_flip(mesh, star));
  ErrorBound bound(2, {1});
  ASSERT_TRUE(bound.allows_flip(mesh, star));
  bound.accept(star);
  EXPECT_NEAR(bound.largest(mesh.topology), 0.2, 1e-6);
  // What is there already adds to it.
  ASSERT_TRUE(bound.allows_flip(mesh, star));
  bound.accept(star);
  EXPECT_NEAR(bound.largest(mesh.topology), 0.4, 1e-6);

  // A wedge: seen along the mean of its normals, its smaller facet looks away.
  const CollapseMesh wedge(
      {{{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0.3F, 0.25F}}, {{0, 1, 2}, {1, 0, 3}}, {}}, {});
  Star folded;
  folded.gather_flip(wedge.topology, 0);
  EXPECT_FALSE(ErrorBound(2, {1}).allows_flip(wedge, folded));

  ErrorBound free(2, {});
  EXPECT_TRUE(free.allows_flip(mesh, star));
  const std::array<std::uint32_t, 1> kept{1};
  free.keep(kept);
  EXPECT_FALSE(free.allows_flip(mesh, star));
}

TEST(ErrorBound, OfATipThatIsCutOffIsItsHeight) {
  CollapseMesh mesh(tent(0.25F), {});
  const TipEdge tip(mesh);
  ErrorBound bound(mesh.normals.size(), {1});
  ASSERT_TRUE(bound.allows(mesh, tip.star, mesh.r[1]));
  bound.accept(tip.star);
  mesh.topology.collapse(tip.h);
  EXPECT_NEAR(bound.largest(mesh.topology), 0.25, 1e-6);

  ErrorBound strict(mesh.normals.size(), {0.2499});
  const CollapseMesh again(tent(0.25F), {});
  EXPECT_FALSE(strict.allows(again, TipEdge(again).star, again.r[1]));
}

TEST(ErrorBound, LetsNoKeptFacetChange) {
  const CollapseMesh mesh(tent(0.25F), {});
  const TipEdge tip(mesh);
  ErrorBound bound(mesh.normals.size(), {1, 0.5});
  ASSERT_TRUE(bound.allows(mesh, tip.star, mesh.r[1]));
  bound.keep(std::array{tip.star.dying[0]});
  EXPECT_FALSE(bound.allows(mesh, tip.star, mesh.r[1]));
  EXPECT_EQ(bound.largest(mesh.topology), 0);
}

TEST(ErrorBound, IsRaisedForWhatItRefusesButNotForWhatIsKept) {
  const CollapseMesh mesh(tent(0.25F), {});
  const TipEdge tip(mesh);
  const auto raises_after = [&](const std::vector<std::uint32_t>& kept) {
    CollapseChecks checks(mesh, {.limit = 0.1, .highest = 0.8}, 1);
    checks.keep(kept);
    EXPECT_FALSE(allows(checks, mesh, tip.h, mesh.r[1]));
    return checks.raise_bound();
  };
  EXPECT_TRUE(raises_after({}));
  EXPECT_FALSE(raises_after({tip.star.dying[0]}));
  EXPECT_FALSE(raises_after({tip.star.facet[0]}));
}

TEST(ErrorBound, OfAPlaneIsZeroWhereverTheVertexGoes) {
  const CollapseMesh mesh(tent(0), {});
  const TipEdge tip(mesh);
  ErrorBound bound(mesh.normals.size(), {1e-6});
  EXPECT_TRUE(bound.allows(mesh, tip.star, mesh.r[1]));
  EXPECT_TRUE(bound.allows(mesh, tip.star, 0.5 * (mesh.r[0] + mesh.r[1])));
}

TEST(ErrorBound, OfAFoldIsTheShiftOfTheVertices) {
  // The place lies outside the rim, so the new facets are no height field over the old ones.
  const CollapseMesh mesh(tent(0), {});
  const TipEdge tip(mesh);
  const Vec3d outside{5, 0, 0};
  ErrorBound bound(mesh.normals.size(), {4.9});
  EXPECT_FALSE(bound.allows(mesh, tip.star, outside));
  ErrorBound loose(mesh.normals.size(), {5.1});
  EXPECT_TRUE(loose.allows(mesh, tip.star, outside)) << "the tip has moved by 5";
}

TEST(ErrorBound, OfAnOpenBoundaryIsTheShiftOfTheVertices) {
  // One ring only: the rim itself moves, in the plane, and uncovers a part of it.
  TriMesh sheet = tent(0);
  sheet.triangles.erase(std::remove_if(sheet.triangles.begin(), sheet.triangles.end(),
                                       [](const Triangle& t) { return t[0] != 0; }),
                        sheet.triangles.end());
  const CollapseMesh mesh(sheet, {});
  const TipEdge tip(mesh);
  ErrorBound bound(mesh.normals.size(), {1.9});
  EXPECT_FALSE(bound.allows(mesh, tip.star, mesh.r[0]));
  ErrorBound loose(mesh.normals.size(), {2.1});
  EXPECT_TRUE(loose.allows(mesh, tip.star, mesh.r[0]));
}

struct Case {
  int seed;
  double noise;
  ErrorLimit limit{0.4};
};

class ErrorBoundOfRandomSurfaces : public testing::TestWithParam<Case> {};

TEST_P(ErrorBoundOfRandomSurfaces, IsNeverBelowTheDistanceOfDenseSamples) {
  const Grid grid{.cells = {16, 16, 16},
                  .noise = GetParam().noise,
                  .seed = static_cast<std::uint64_t>(GetParam().seed)};
  const TriMesh input = polygonised(grid, random_landscape(grid.cells, grid.seed));
  CollapseMesh mesh(input, grid.sides());
  CollapseChecks checks(mesh, GetParam().limit, 0.4);
  // Any order and any place inside the rules: the bound may not depend on a good choice.
  LindstromTurkPlacement placement(mesh);
  RandomStream random({.seed = grid.seed, .ray = 1});
  int collapses = 0;
  for (int i = 0; i < 6000; ++i) {
    const std::uint32_t h = random.bits() % mesh.topology.half_edge_count();
    if (!mesh.topology.alive(HalfEdges::facet(h))) continue;
    const Merge rule = merge_rule(mesh, h);
    if (rule == Merge::forbidden) continue;
    const Vec3d r = placement.place(mesh, h, rule).r;
    if (!allows(checks, mesh, h, r)) continue;
    const Star star = checks.star();
    checks.accept(mesh, h);
    mesh.topology.collapse(h);
    mesh.r[star.u] = r;
    mesh.sides[star.u] |= mesh.sides[star.v];
    mesh.kind[star.u] = std::max(mesh.kind[star.u], mesh.kind[star.v]);
    for (int k = 0; k < star.count; ++k) mesh.normals[star.facet[k]] = checks.normals()[k];
    placement.collapsed(mesh, star.u, star.v);
    ++collapses;
  }
  ASSERT_GT(collapses, 100);
  const double proven = checks.proven_error(mesh.topology);
  const SurfaceDistance measured = surface_distance(input, mesh.extract(), 0.1);
  EXPECT_LE(proven, 0.4);
  EXPECT_LE(measured.symmetric_max, proven);
  EXPECT_GT(measured.symmetric_max, 0.1 * proven) << "a bound that says nothing";
}
INSTANTIATE_TEST_SUITE_P(Seeds, ErrorBoundOfRandomSurfaces,
                         testing::Values(Case{1, 0}, Case{2, 0.01}, Case{3, 0.03}, Case{4, 0.1},
                                         Case{5, 0.1}, Case{1, 0, {0.4, 0.2}},
                                         Case{3, 0.03, {0.4, 0.2}}, Case{4, 0.1, {0.4, 0.4}}));

}  // namespace
}  // namespace scarp
