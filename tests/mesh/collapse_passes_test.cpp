#include "mesh/collapse_passes.h"
#include "mesh/quality.h"

#include <gtest/gtest.h>

#include "mesh/distance.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

const Grid& grid() {
  static const Grid grid{.cells = {30, 30, 24}, .noise = 0.02, .seed = 9};
  return grid;
}

const TriMesh& landscape() {
  static const TriMesh mesh = polygonised(grid(), random_landscape(grid().cells, grid().seed));
  return mesh;
}

TEST(CollapsePasses, RemoveMostWithinTheBoundAndSayWhereTheVerticesWent) {
  CollapseMesh mesh(landscape(), grid().sides());
  CollapseChecks checks(mesh, {0.1}, 0.1);
  EdgeSizes sizes;
  const std::uint32_t before = mesh.live_vertices;
  const std::vector<std::uint32_t> merged_into = collapse_in_passes(mesh, checks, sizes);
  EXPECT_LT(mesh.live_vertices, 0.5 * before);
  EXPECT_TRUE(checks.bound_was_met());
  EXPECT_LE(checks.proven_error(mesh.topology), 0.1);
  EXPECT_LE(surface_distance(landscape(), mesh.extract(), 0.3).symmetric_max, 0.1);
  std::uint32_t living = 0;
  for (std::uint32_t v = 0; v < merged_into.size(); ++v) {
    const bool lives = mesh.topology.outgoing(v) != HalfEdges::none;
    EXPECT_EQ(merged_into[v] == v, lives) << v;
    living += lives ? 1 : 0;
  }
  EXPECT_EQ(living, mesh.live_vertices);
}

TEST(CollapsePasses, NormalsOfTheMeshAreUpToDate) {
  CollapseMesh mesh(landscape(), grid().sides());
  CollapseChecks checks(mesh, {0.2}, 0.2);
  EdgeSizes sizes;
  collapse_in_passes(mesh, checks, sizes);
  for (std::uint32_t f = 0; f < mesh.topology.facet_count(); ++f) {
    if (!mesh.topology.alive(f)) continue;
    EXPECT_NEAR(length(mesh.normals[f] - mesh.normal_of(f)), 0, 1e-12) << f;
  }
}

TEST(CollapsePasses, LeaveKeptFacetsAsTheyAre) {
  CollapseMesh mesh(landscape(), grid().sides());
  CollapseChecks checks(mesh, {0.2}, 0.2);
  std::vector<std::uint32_t> kept;
  for (std::uint32_t f = 0; f < mesh.topology.facet_count(); f += 50) kept.push_back(f);
  checks.keep(kept);
  const LargeVector<Vec3d> normals = mesh.normals;
  EdgeSizes sizes;
  const std::uint32_t before = mesh.live_vertices;
  collapse_in_passes(mesh, checks, sizes);
  EXPECT_LT(mesh.live_vertices, 0.9 * before);
  for (const std::uint32_t f : kept) {
    ASSERT_TRUE(mesh.topology.alive(f)) << f;
    EXPECT_EQ(mesh.normal_of(f), normals[f]) << f;
  }
}

TEST(CollapsePasses, KeepToTheLimitsOfEdges) {
  constexpr double l_max = 1.5;
  for (const bool per_vertex : {false, true}) {
    CollapseMesh mesh(landscape(), grid().sides());
    CollapseChecks checks(mesh, {0.3}, 0.3);
    EdgeSizes sizes;
    if (per_vertex) {
      sizes.limit.assign(mesh.r.size(), static_cast<float>(l_max));
    } else {
      sizes.l_max = l_max;
    }
    const std::uint32_t before = mesh.live_vertices;
    collapse_in_passes(mesh, checks, sizes);
    EXPECT_LT(mesh.live_vertices, 0.8 * before);
    for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); ++h) {
      if (!mesh.topology.alive(HalfEdges::facet(h))) continue;
      EXPECT_LT(mesh.squared_length(h), 4.0001 * l_max * l_max) << h;
    }
  }
}

TEST(CollapsePasses, OfAPlaneEndWithItsCorners) {
  CollapseMesh mesh(noisy_plane(40, 0), sides_of(noisy_plane(40, 0)));
  CollapseChecks checks(mesh, {1e-4}, 1);
  EdgeSizes sizes;
  collapse_in_passes(mesh, checks, sizes);
  EXPECT_EQ(mesh.live_vertices, 4U);
}

}  // namespace
}  // namespace scarp
