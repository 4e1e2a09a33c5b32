#include "mesh/simplify/relocate.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

/// Moves every third inner vertex a little, with the points of its facets.
void disturb(CollapseMesh& mesh, CollapseChecks& checks, TrackedPoints& points) {
  RandomStream random({.seed = 9});
  const LargeVector<Vec3d> reference = mesh.normals;
  for (std::uint32_t v = 0; v < mesh.r.size(); v += 3) {
    if (mesh.sides[v] != 0 || mesh.topology.on_boundary(v)) continue;
    ASSERT_TRUE(checks.gather_vertex(mesh, v));
    const Vec3d step{random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5};
    const Vec3d r = mesh.rounded(mesh.r[v] + 0.2 * step);
    if (!checks.may_move(mesh, r, reference)) continue;
    Fan fan(mesh, checks.star(), r, checks.normals());
    points.move(checks.star(), fan);
    mesh.r[v] = r;
    for (int i = 0; i < checks.star().count; ++i) {
      mesh.normals[checks.star().facet[i]] = checks.normals()[i];
    }
  }
}

void relocate(CollapseMesh& mesh, CollapseChecks& checks, TrackedPoints& points,
              double shape_weight, int sweeps) {
  const LargeVector<Vec3d> reference = mesh.normals;
  for (int pass = 0; pass < sweeps; ++pass) {
    relocate(mesh, checks, points, shape_weight, reference, pass);
  }
}

TEST(Relocate, BringsDisturbedVerticesBackToTheSurface) {
  CollapseMesh mesh(octahedral_sphere(8, 8), {});
  TrackedPoints points(mesh);
  CollapseChecks checks(mesh, {}, 1);
  disturb(mesh, checks, points);
  const double before = points.largest(mesh);
  relocate(mesh, checks, points, 0, 10);
  EXPECT_GT(before, 0.05);
  EXPECT_LT(points.largest(mesh), 0.1 * before);
}

TEST(Relocate, LeavesTheInputAsItIs) {
  const Grid grid{.cells = {12, 12, 12}, .noise = 0.05};
  CollapseMesh mesh(polygonised(grid, random_landscape(grid.cells, 2)), grid.sides());
  const LargeVector<Vec3d> before = mesh.r;
  TrackedPoints points(mesh);
  CollapseChecks checks(mesh, {}, 1);
  relocate(mesh, checks, points, 0, 3);
  EXPECT_EQ(mesh.r, before);
}

TEST(Relocate, KeepsSidesAndCornersAndTheBound) {
  const Grid grid{.cells = {16, 16, 16}, .noise = 0.05};
  CollapseMesh mesh(polygonised(grid, random_landscape(grid.cells, 2)), grid.sides());
  const CollapseMesh before = mesh;
  TrackedPoints points(mesh);
  CollapseChecks checks(mesh, {0.02}, 1);
  relocate(mesh, checks, points, 1e-4, 5);
  int moved = 0;
  for (std::uint32_t v = 0; v < mesh.r.size(); ++v) {
    for (int axis = 0; axis < 2; ++axis) {
      if (fixes(mesh.sides[v], axis)) {
        EXPECT_EQ(mesh.r[v][axis], before.r[v][axis]);
      }
    }
    moved += mesh.r[v] == before.r[v] ? 0 : 1;
  }
  EXPECT_GT(moved, 50);
  EXPECT_LE(checks.proven_error(mesh.topology), 0.02);
  EXPECT_LE(points.largest(mesh), 0.02);
}

TEST(Relocate, MovesPairsOfPeriodicSidesTogether) {
  const Grid grid{.cells = {24, 24, 24}, .noise = 0.05, .periodic = true};
  CollapseMesh mesh(polygonised(grid, periodic_landscape(24, 24, 8)), grid.sides());
  const CollapseMesh before = mesh;
  TrackedPoints points(mesh);
  CollapseChecks checks(mesh, {0.1}, 1);
  relocate(mesh, checks, points, 1e-3, 5);
  int moved = 0;
  for (std::uint32_t v = 0; v < mesh.r.size(); ++v) {
    if (mesh.twin[v] == HalfEdges::none) continue;
    const Vec3d shift = mesh.r[mesh.twin[v]] - mesh.r[v];
    EXPECT_EQ(shift, before.r[mesh.twin[v]] - before.r[v]);
    moved += mesh.r[v] == before.r[v] ? 0 : 1;
  }
  EXPECT_GT(moved, 10);
}

}  // namespace
}  // namespace scarp
