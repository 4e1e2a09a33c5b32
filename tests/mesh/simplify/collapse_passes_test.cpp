#include "mesh/simplify/collapse_passes.h"
#include "mesh/sides.h"
#include "tests/mesh/quality.h"

#include <gtest/gtest.h>

#include <numeric>

#include "core/parallel.h"
#include "core/random.h"
#include "mesh/distance.h"
#include "mesh/simplify/tracked_points.h"
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
  CollapsePasses passes(mesh, checks, sizes, {});
  passes.approach(0, {});
  const std::span<const std::uint32_t> merged_into = passes.merged_into();
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
  CollapsePasses(mesh, checks, sizes, {}).approach(0, {});
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
  CollapsePasses(mesh, checks, sizes, {}).approach(0, {});
  EXPECT_LT(mesh.live_vertices, 0.9 * before);
  for (const std::uint32_t f : kept) {
    ASSERT_TRUE(mesh.topology.alive(f)) << f;
    EXPECT_EQ(mesh.normal_of(f), normals[f]) << f;
  }
}

// A higher bound would not help: the surface stops where it is, and nobody raises it.
TEST(CollapsePasses, KeptFacetsDoNotMeetTheBound) {
  const TriMesh plane = noisy_plane(20, 0);
  CollapseMesh mesh(plane, sides_of(plane));
  CollapseChecks checks(mesh, {.limit = 1, .rough = 0, .highest = 4}, 1);
  std::vector<std::uint32_t> all(mesh.topology.facet_count());
  std::iota(all.begin(), all.end(), 0U);
  checks.keep(all);
  EdgeSizes sizes;
  const std::uint32_t before = mesh.live_vertices;
  CollapsePasses(mesh, checks, sizes, {}).run_to(before / 2);
  EXPECT_EQ(mesh.live_vertices, before);
  EXPECT_FALSE(checks.bound_was_met());
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
    CollapsePasses(mesh, checks, sizes, {}).approach(0, {});
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
  CollapsePasses(mesh, checks, sizes, {}).approach(0, {});
  EXPECT_EQ(mesh.live_vertices, 4U);
}

/// Every way to go first.
const PassOrder orders[]{{},
                         {.measure = Measure::volume},
                         {.measure = Measure::volume, .shortest_first = true},
                         {.measure = Measure::volume, .by_planes = true},
                         {.looks_twice = true},
                         {.looks_twice = true, .shape_weight = 1e-4}};

TEST(CollapsePasses, EndWithExactlySoManyVerticesOnAnyNumberOfThreads) {
  const Grid grid{.cells = {80, 80, 24}, .noise = 0.02, .seed = 3, .periodic = true};
  const TriMesh input = polygonised(grid, periodic_landscape(80, 80, 6));
  for (const PassOrder& order : orders) {
    std::vector<TriMesh> results;
    for (const int threads : {1, 2}) {
      const ThreadLimit limit(threads);
      CollapseMesh mesh(input, grid.sides());
      CollapseChecks checks(mesh, {}, 1);
      EdgeSizes sizes;
      CollapsePasses(mesh, checks, sizes, order).run_to(1500);
      results.push_back(mesh.extract());
    }
    EXPECT_EQ(results[0].vertices.size(), 1500U);
    EXPECT_EQ(results[0].vertices, results[1].vertices);
    EXPECT_EQ(results[0].triangles, results[1].triangles);
  }
}

TEST(CollapsePasses, EndWithAnyNumberAlsoWherePairsGoTogether) {
  const Grid grid{.cells = {24, 24, 16}, .noise = 0.02, .seed = 3, .periodic = true};
  const TriMesh input = polygonised(grid, periodic_landscape(24, 24, 4));
  for (std::uint32_t target = 100; target < 130; ++target) {
    CollapseMesh mesh(input, grid.sides());
    CollapseChecks checks(mesh, {}, 1);
    EdgeSizes sizes;
    CollapsePasses(mesh, checks, sizes, {}).run_to(target);
    EXPECT_EQ(mesh.live_vertices, target);
  }
}

TEST(CollapsePasses, ApproachNoNearerThanAskedFor) {
  CollapseMesh mesh(landscape(), grid().sides());
  CollapseChecks checks(mesh, {}, 1);
  EdgeSizes sizes;
  const std::uint32_t target = mesh.live_vertices / 2;
  CollapsePasses passes(mesh, checks, sizes, {});
  passes.approach(target, {});
  EXPECT_GE(mesh.live_vertices, target);
  EXPECT_LT(mesh.live_vertices, target + 500);
}

TEST(CollapsePasses, GoOnWhenTheBoundIsRaised) {
  CollapseMesh mesh(landscape(), grid().sides());
  CollapseChecks checks(mesh, {.limit = 0.01, .rough = 0, .highest = 1}, 1);
  EdgeSizes sizes;
  CollapsePasses passes(mesh, checks, sizes, {});
  const std::uint32_t target = mesh.live_vertices / 4;
  passes.run_to(target);
  const std::uint32_t left = mesh.live_vertices;
  EXPECT_GT(left, target);
  ASSERT_TRUE(checks.raise_bound());
  passes.run_to(target);
  EXPECT_EQ(mesh.live_vertices, left);
  passes.forget_refusals();
  passes.run_to(target);
  EXPECT_LT(mesh.live_vertices, left);
}

TEST(CollapsePasses, GoOnWhenSizesAllowMore) {
  CollapseMesh mesh(landscape(), grid().sides());
  CollapseChecks checks(mesh, {}, 1);
  EdgeSizes sizes;
  sizes.only_old = true;
  sizes.limit.assign(mesh.r.size(), 0.5F);
  CollapsePasses passes(mesh, checks, sizes, {});
  const std::uint32_t before = mesh.live_vertices;
  passes.approach(0, {});
  const std::uint32_t left = mesh.live_vertices;
  EXPECT_LT(left, before);
  sizes.limit.assign(mesh.r.size(), 2);
  passes.approach(0, {});
  EXPECT_LT(mesh.live_vertices, 0.8 * left);
}

/// Greatest distance of a vertex of the input once a share of them is left.
double greatest_distance(const TriMesh& input, const Sides& sides, double left, bool looks_twice) {
  CollapseMesh mesh(input, sides);
  CollapseChecks checks(mesh, {}, 1);
  EdgeSizes sizes;
  CollapsePasses(mesh, checks, sizes, {.looks_twice = looks_twice})
      .run_to(static_cast<std::uint32_t>(left * mesh.live_vertices));
  return surface_distance(input, mesh.extract()).forward.max;
}

TEST(CollapsePasses, PutEdgesOffThatMoveAnEndFarWhateverTheirArea) {
  // Slivers at a side.
  EXPECT_LT(greatest_distance(landscape(), grid().sides(), 0.5, true),
            0.8 * greatest_distance(landscape(), grid().sides(), 0.5, false));
  // Without sides: noise.
  double once = 0;
  double twice = 0;
  for (std::uint32_t seed = 0; seed < 8; ++seed) {
    TriMesh sphere = octahedral_sphere(10, 12);
    RandomStream random({.seed = seed});
    for (Vec3f& r : sphere.vertices) {
      for (int axis = 0; axis < 3; ++axis) r[axis] += 0.3F * random.uniform();
    }
    once += greatest_distance(sphere, {}, 0.83, false);
    twice += greatest_distance(sphere, {}, 0.83, true);
  }
  EXPECT_LT(twice, 0.85 * once);
}

TEST(CollapsePasses, LookOnceUnlessAskedTo) {
  const auto vertices = [](const PassOrder& order) {
    CollapseMesh mesh(landscape(), grid().sides());
    CollapseChecks checks(mesh, {}, 1);
    EdgeSizes sizes;
    CollapsePasses(mesh, checks, sizes, order).run_to(mesh.live_vertices / 2);
    return mesh.extract().vertices;
  };
  EXPECT_EQ(vertices({}), vertices({.looks_twice = false}));
  EXPECT_NE(vertices({}), vertices({.looks_twice = true}));
}

TEST(CollapsePasses, StayNearerToThePointsThatTheyFollow) {
  const auto rms = [](bool follows) {
    CollapseMesh mesh(landscape(), grid().sides());
    CollapseChecks checks(mesh, {}, 1);
    EdgeSizes sizes;
    TrackedPoints points(mesh);
    CollapsePasses passes(mesh, checks, sizes, {.looks_twice = true});
    if (follows) passes.follow(points);
    passes.run_to(mesh.live_vertices / 4);
    const SurfaceDistance distance = surface_distance(landscape(), mesh.extract());
    if (follows) {
      EXPECT_NEAR(points.largest(mesh), distance.forward.max, 0.02);
      std::size_t count = 0;
      for (std::uint32_t f = 0; f < mesh.topology.facet_count(); ++f) {
        if (mesh.topology.alive(f)) points.for_each(f, [&count](Vec3d) { ++count; });
      }
      EXPECT_EQ(count, landscape().vertices.size());
    }
    return distance.forward.rms;
  };
  EXPECT_LT(rms(true), 0.9 * rms(false));
}

TEST(CollapsePasses, MakeBetterShapesWhereTheyWeighMore) {
  const auto angle = [](double shape_weight) {
    CollapseMesh mesh(landscape(), grid().sides());
    CollapseChecks checks(mesh, {}, 1);
    EdgeSizes sizes;
    CollapsePasses(mesh, checks, sizes, {.looks_twice = true, .shape_weight = shape_weight})
        .run_to(mesh.live_vertices / 3);
    return angle_statistics(mesh.extract()).mean_minimum;
  };
  EXPECT_GT(angle(1e-3), angle(0) + 1);
}

}  // namespace
}  // namespace scarp
