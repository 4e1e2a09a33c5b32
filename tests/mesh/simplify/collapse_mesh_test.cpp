#include "mesh/simplify/collapse_mesh.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>

#include "core/random.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

/// Whether a double holds no more than a float can.
bool is_float(double value) { return (std::bit_cast<std::uint64_t>(value) & 0x1fffffffU) == 0; }

TEST(CoarseDirection, IsRightToADegree) {
  const double cosine_of_degree = 0.99985;
  for (const Vec3d n :
       {Vec3d{1, 0, 0}, {0, -3, 0}, {1, 2, 3}, {-0.4, 1e-3, 0.7}, {1e-7, 0, 2e-7}}) {
    EXPECT_GT(dot(normalized(Vec3d(CoarseDirection(n))), normalized(n)), cosine_of_degree);
  }
  EXPECT_EQ(Vec3d(CoarseDirection(Vec3d{})), Vec3d{}) << "a facet of no area faces nowhere";
}

TEST(CollapseMesh, RoundsEveryCoordinateToFloat) {
  const CollapseMesh mesh(octahedral_sphere(30, 4, {100.7, -33.3, 812.1}), {});
  RandomStream random({.seed = 1});
  for (int i = 0; i < 1000; ++i) {
    const Vec3d r{random.uniform(), 10 * random.uniform(), random.uniform()};
    const Vec3d place = mesh.rounded(r) + mesh.centre;
    EXPECT_TRUE(is_float(place.x) && is_float(place.y) && is_float(place.z));
    EXPECT_NEAR(length(mesh.rounded(r) - r), 0, 1e-4);
  }
}

TEST(CollapseMesh, KnowsTheBoxAndTheAreaOfTheInput) {
  const CollapseMesh mesh(noisy_plane(30, 0), {});
  EXPECT_NEAR(mesh.area, 900, 1e-3);
  for (std::size_t v = 0; v < mesh.r.size(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GE(mesh.r[v][axis], mesh.box.lower[axis]);
      EXPECT_LE(mesh.r[v][axis], mesh.box.upper[axis]);
    }
  }
  EXPECT_EQ(length(mesh.box.lower + mesh.box.upper), 0) << "in the frame of the places";
  EXPECT_EQ(mesh.box.upper.x - mesh.box.lower.x, 30);
}

TEST(CollapseMesh, ExtractGivesTheInputBack) {
  const Grid grid{.cells = {12, 12, 12}, .noise = 0.05};
  const TriMesh input = polygonised(grid, random_landscape(grid.cells, 3));
  const TriMesh output = CollapseMesh(input, grid.sides()).extract();
  EXPECT_EQ(output.vertices, input.vertices);
  EXPECT_EQ(output.triangles, input.triangles);
}

TEST(CollapseMesh, TwinEdgesRunTheOtherWayOnTheOppositeSide) {
  const Grid grid{.cells = {30, 24, 24}, .noise = 0.05, .periodic = true};
  const CollapseMesh mesh(polygonised(grid, periodic_landscape(30, 24, 8)), grid.sides());
  int pairs = 0;
  for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); ++h) {
    const std::uint32_t t = mesh.twin_edge(h);
    EXPECT_EQ(t != HalfEdges::none, mesh.topology.opposite(h) == HalfEdges::none);
    if (t == HalfEdges::none) continue;
    ++pairs;
    EXPECT_EQ(mesh.twin_edge(t), h);
    EXPECT_EQ(mesh.edge(h), mesh.edge(t));
    const Vec3d here = mesh.r[mesh.topology.origin(h)];
    const Vec3d there = mesh.r[mesh.topology.target(t)];
    const int axis = here.x != there.x ? 0 : 1;
    EXPECT_EQ(std::abs(here[axis] - there[axis]), grid.cells[axis]);
    EXPECT_EQ(here[1 - axis], there[1 - axis]);
    EXPECT_EQ(here.z, there.z);
    EXPECT_EQ(mesh.twin_place(h, here), there);
  }
  EXPECT_GT(pairs, 150);
}

TEST(CollapseMesh, TwinEdgesAreCollapsedTogether) {
  const Grid grid{.cells = {30, 24, 24}, .noise = 0.05, .periodic = true};
  CollapseMesh mesh(polygonised(grid, periodic_landscape(30, 24, 8)), grid.sides());
  for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); h += 7) {
    if (!mesh.topology.alive(HalfEdges::facet(h))) continue;
    const std::uint32_t t = mesh.twin_edge(h);
    if (t == HalfEdges::none || merge_rule(mesh, h) != Merge::free) continue;
    if (!mesh.topology.can_collapse(h) || !mesh.topology.can_collapse(t)) continue;
    const std::uint32_t u = mesh.topology.origin(h);
    const std::uint32_t w = mesh.topology.origin(t);
    const Vec3d middle = mesh.rounded(0.5 * (mesh.r[u] + mesh.r[mesh.topology.target(h)]));
    mesh.collapse(h, middle);
    EXPECT_EQ(mesh.r[u], middle);
    EXPECT_EQ(mesh.twin[u], w);
    EXPECT_EQ(mesh.twin[w], u);
    EXPECT_EQ(mesh.r[w].z, middle.z);
  }
  // Every edge of a side still has its copy.
  for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); ++h) {
    if (!mesh.topology.alive(HalfEdges::facet(h))) continue;
    EXPECT_EQ(mesh.twin_edge(h) != HalfEdges::none, mesh.topology.opposite(h) == HalfEdges::none);
  }
}

class MergeRule : public testing::Test {
 protected:
  /// A flat square of 6 x 6 cells; material 1 for x < 3 and 2 beyond.
  MergeRule() : input_(noisy_plane(6, 0)) {
    for (std::size_t f = 0; f < input_.triangles.size(); ++f) {
      const auto p = corners(input_, f);
      input_.materials.push_back(p[0].x + p[1].x + p[2].x < 9 ? 1 : 2);
    }
  }

  /// The rule for the edge from one node to another; on the boundary it may only run the other way.
  Merge rule(const CollapseMesh& mesh, Vec3d from, Vec3d to) const {
    const auto at = [&mesh](std::uint32_t v, Vec3d place) {
      const Vec3d r = mesh.r[v] + mesh.centre;
      return r.x == place.x && r.y == place.y;
    };
    for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); ++h) {
      if (at(mesh.topology.origin(h), from) && at(mesh.topology.target(h), to)) {
        return merge_rule(mesh, h);
      }
      if (at(mesh.topology.origin(h), to) && at(mesh.topology.target(h), from) &&
          mesh.topology.opposite(h) == HalfEdges::none) {
        const Merge reversed = merge_rule(mesh, h);
        if (reversed == Merge::onto_origin) return Merge::onto_target;
        return reversed == Merge::onto_target ? Merge::onto_origin : reversed;
      }
    }
    ADD_FAILURE() << "no such edge";
    return Merge::forbidden;
  }

  TriMesh input_;
  Sides sides_{.lower = {0, 0}, .upper = {6, 6}};
};

TEST_F(MergeRule, InsideEverythingIsFree) {
  const CollapseMesh mesh(input_, sides_);
  EXPECT_EQ(rule(mesh, {1, 1}, {2, 1}), Merge::free);
}

TEST_F(MergeRule, SidesHoldTheirVertices) {
  const CollapseMesh mesh(input_, sides_);
  EXPECT_EQ(rule(mesh, {0, 1}, {0, 2}), Merge::free) << "along the side";
  EXPECT_EQ(rule(mesh, {0, 2}, {1, 2}), Merge::free) << "onto the side";
  EXPECT_EQ(rule(mesh, {0, 0}, {1, 0}), Merge::onto_origin) << "a corner stays";
  EXPECT_EQ(rule(mesh, {1, 0}, {0, 0}), Merge::onto_target);
  // One axis only is wide enough to have two different sides next to each other.
  const TriMesh strip = polygonised({.cells = {1, 6, 4}}, [](Vec3d r) { return r.z - 1.77; });
  const CollapseMesh narrow(strip, {.lower = {0, 0}, .upper = {1, 6}});
  EXPECT_EQ(rule(narrow, {0, 2}, {1, 2}), Merge::forbidden) << "between opposite sides";
}

TEST_F(MergeRule, PeriodicSidesGoWithTheirCopies) {
  Sides periodic = sides_;
  periodic.boundary[0] = Boundary::periodic;
  const CollapseMesh mesh(input_, periodic);
  EXPECT_EQ(rule(mesh, {0, 1}, {0, 2}), Merge::free);
  EXPECT_EQ(rule(mesh, {6, 1}, {6, 2}), Merge::free);
  EXPECT_EQ(rule(mesh, {0, 0}, {0, 1}), Merge::onto_origin) << "a corner stays";
  EXPECT_EQ(rule(mesh, {0, 2}, {1, 2}), Merge::onto_origin) << "its copy would stay behind";
  EXPECT_EQ(rule(mesh, {2, 0}, {1, 0}), Merge::free) << "the other axis is reflective";
}

TEST_F(MergeRule, VerticesOfPeriodicSidesWithoutACopyStay) {
  for (Vec3f& r : input_.vertices) {
    if (r.x == 6 && r.y == 2) r.y += 0.25F;
  }
  Sides periodic = sides_;
  periodic.boundary[0] = Boundary::periodic;
  const CollapseMesh mesh(input_, periodic);
  EXPECT_EQ(rule(mesh, {0, 1}, {0, 2}), Merge::forbidden);
  EXPECT_EQ(rule(mesh, {0, 2}, {0, 3}), Merge::forbidden);
  EXPECT_EQ(rule(mesh, {0, 3}, {0, 4}), Merge::free);
}

TEST_F(MergeRule, BordersBetweenMaterialsHoldTheirVertices) {
  const CollapseMesh mesh(input_, sides_);
  EXPECT_EQ(rule(mesh, {3, 2}, {3, 3}), Merge::onto_either) << "along the border";
  EXPECT_EQ(rule(mesh, {3, 2}, {4, 2}), Merge::onto_origin) << "onto the border";
  EXPECT_EQ(rule(mesh, {3, 0}, {3, 1}), Merge::onto_origin) << "its end on the side stays";
  EXPECT_EQ(rule(mesh, {3, 0}, {2, 0}), Merge::onto_origin);
}

TEST(AllowedPlaces, AreThoseOfTheSidesOfBothEnds) {
  const TriMesh plane = noisy_plane(6, 0);
  const CollapseMesh mesh(plane, {.lower = {0, 0}, .upper = {6, 6}});
  for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); ++h) {
    const SideMask mask = mesh.sides[mesh.topology.origin(h)] | mesh.sides[mesh.topology.target(h)];
    const Subspace places = allowed_places(mesh, h);
    EXPECT_EQ(places.dimension, 3 - (fixes(mask, 0) ? 1 : 0) - (fixes(mask, 1) ? 1 : 0));
  }
}

}  // namespace
}  // namespace scarp
