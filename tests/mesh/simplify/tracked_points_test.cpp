#include "mesh/simplify/tracked_points.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "core/random.h"
#include "core/triangle_tree.h"
#include "mesh/sides.h"
#include "mesh/simplify/collapse_passes.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

const TriMesh& landscape() {
  static const Grid grid{.cells = {16, 16, 16}, .noise = 0.03, .seed = 3};
  static const TriMesh mesh = polygonised(grid, random_landscape(grid.cells, grid.seed));
  return mesh;
}

std::vector<Vec3d> normals_around(const CollapseMesh& mesh, const Star& star, Vec3d r) {
  std::vector<Vec3d> normals(star.count);
  for (int i = 0; i < star.count; ++i) {
    normals[i] = cross(mesh.r[star.ring[i]] - r, mesh.r[star.ring[i + 1]] - r);
  }
  return normals;
}

TEST(Fan, FindsTheNearestFacetAroundAVertex) {
  const CollapseMesh mesh(landscape(), {});
  RandomStream random({.seed = 5});
  int asked = 0;
  int missed = 0;
  for (std::uint32_t v = 0; v < mesh.r.size(); v += 3) {
    if (mesh.topology.outgoing(v) == HalfEdges::none || mesh.topology.on_boundary(v)) continue;
    Star star;
    ASSERT_TRUE(star.gather_vertex(mesh.topology, v));
    const Fan fan(mesh, star, mesh.r[v], normals_around(mesh, star, mesh.r[v]));
    for (int n = 0; n < 10; ++n) {
      const Vec3d step{random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5};
      const Vec3d p = mesh.r[v] + 0.3 * step;
      double nearest = 1e300;
      for (int i = 0; i < star.count; ++i) {
        const ClosestPoint point =
            closest_on_triangle(p, {mesh.r[v], mesh.r[star.ring[i]], mesh.r[star.ring[i + 1]]});
        nearest = std::min(nearest, point.distance);
      }
      const double found = std::sqrt(fan.nearest(p).squared_distance);
      // Never nearer than the fan with the facet behind the rim, and nearly always the fan itself.
      ++asked;
      missed += std::abs(found - nearest) > 1e-9 ? 1 : 0;
    }
  }
  EXPECT_GT(asked, 500);
  EXPECT_LT(missed, 0.1 * asked);
}

TEST(Fan, TakesALikelyFacetOnlyForAPointOverIt) {
  const CollapseMesh mesh(noisy_plane(6, 0), {});
  int taken = 0;
  for (std::uint32_t v = 0; v < mesh.r.size(); ++v) {
    if (mesh.topology.on_boundary(v)) continue;
    Star star;
    ASSERT_TRUE(star.gather_vertex(mesh.topology, v));
    const Fan fan(mesh, star, mesh.r[v], normals_around(mesh, star, mesh.r[v]));
    for (int i = 0; i < star.count; ++i) {
      const Vec3d inside =
          (mesh.r[v] + mesh.r[star.ring[i]] + mesh.r[star.ring[i + 1]]) / 3.0 + Vec3d{0, 0, 0.1};
      for (int likely = -1; likely < star.count; ++likely) {
        EXPECT_EQ(fan.nearest(inside, likely).facet, star.facet[i]) << likely;
        EXPECT_NEAR(fan.nearest(inside, likely).squared_distance, 0.01, 1e-9);
      }
      ++taken;
    }
  }
  EXPECT_GT(taken, 50);
}

TEST(Fan, HasTheDistanceOfAPointOverAPlane) {
  const CollapseMesh mesh(noisy_plane(6, 0), {});
  for (std::uint32_t v = 0; v < mesh.r.size(); ++v) {
    if (mesh.topology.on_boundary(v)) continue;
    Star star;
    ASSERT_TRUE(star.gather_vertex(mesh.topology, v));
    const Fan fan(mesh, star, mesh.r[v], normals_around(mesh, star, mesh.r[v]));
    EXPECT_NEAR(fan.nearest(mesh.r[v] + Vec3d{0.1, 0.2, 0.5}).squared_distance, 0.25, 1e-12);
    EXPECT_NEAR(fan.nearest(mesh.r[v] + Vec3d{0, 0, -0.5}).squared_distance, 0.25, 1e-12);
  }
}

TEST(TrackedPoints, LieOnTheInput) {
  const CollapseMesh mesh(landscape(), {});
  const TrackedPoints points(mesh);
  EXPECT_EQ(points.largest(mesh), 0);
  std::size_t count = 0;
  for (std::uint32_t f = 0; f < mesh.normals.size(); ++f) {
    points.for_each(f, [&](Vec3d) { ++count; });
  }
  EXPECT_EQ(count, mesh.live_vertices);
}

TEST(TrackedPoints, PerFacetAreHalfAsManyAsFacetsAtFirst) {
  const CollapseMesh mesh(octahedral_sphere(5, 8), {});
  const TrackedPoints points(mesh);
  double sum = 0;
  int stars = 0;
  for (std::uint32_t v = 0; v < mesh.r.size(); ++v) {
    Star star;
    ASSERT_TRUE(star.gather_vertex(mesh.topology, v));
    sum += points.per_facet(star);
    ++stars;
  }
  EXPECT_NEAR(sum / stars, 0.5, 0.02);
}

TEST(TrackedPoints, CostNothingWhenAVertexMovesThereAndBack) {
  CollapseMesh mesh(landscape(), {});
  TrackedPoints points(mesh);
  double there_sum = 0;
  for (std::uint32_t v = 0; v < mesh.r.size(); v += 5) {
    if (mesh.topology.outgoing(v) == HalfEdges::none || mesh.topology.on_boundary(v)) continue;
    Star star;
    ASSERT_TRUE(star.gather_vertex(mesh.topology, v));
    const Vec3d back = mesh.r[v];
    const Vec3d there = back + Vec3d{0.02, -0.01, 0.04};
    double growth[2]{};
    int n = 0;
    for (const Vec3d r : {there, back}) {
      const auto normals = normals_around(mesh, star, r);
      Fan fan(mesh, star, r, normals);
      growth[n++] = points.growth(star, fan);
      points.move(star, fan);
      mesh.r[v] = r;
      for (int i = 0; i < star.count; ++i) mesh.normals[star.facet[i]] = normals[i];
    }
    EXPECT_GE(growth[0], 0);
    EXPECT_NEAR(growth[0] + growth[1], 0, 1e-12);
    there_sum += growth[0];
  }
  EXPECT_GT(there_sum, 0.01);
  EXPECT_NEAR(points.largest(mesh), 0, 1e-7);
}

/// Moves every seventh inner vertex, with the points around it. Calls note(growth) for each.
template <class Note>
void disturb(CollapseMesh& mesh, TrackedPoints& points, const Note& note) {
  for (std::uint32_t v = 0; v < mesh.r.size(); v += 7) {
    if (mesh.topology.outgoing(v) == HalfEdges::none || mesh.topology.on_boundary(v)) continue;
    Star star;
    ASSERT_TRUE(star.gather_vertex(mesh.topology, v));
    const Vec3d r = mesh.r[v] + (1 + v % 3) * Vec3d{0.05, -0.04, 0.06};
    const auto normals = normals_around(mesh, star, r);
    Fan fan(mesh, star, r, normals);
    const double growth = points.growth(star, fan);
    points.move(star, fan);
    mesh.r[v] = r;
    for (int i = 0; i < star.count; ++i) mesh.normals[star.facet[i]] = normals[i];
    note(growth);
  }
}

TEST(TrackedPoints, GrowByWhatWasSaidOfAMove) {
  CollapseMesh mesh(landscape(), {});
  TrackedPoints points(mesh);
  double expected = 0;
  for (int i = 0; i < 2; ++i) {
    disturb(mesh, points, [&](double growth) { expected += growth; });
  }
  double sum = 0;
  std::size_t count = 0;
  for (std::uint32_t f = 0; f < mesh.normals.size(); ++f) {
    Star only;
    only.count = 1;
    only.facet[0] = f;
    only.dying = {HalfEdges::none, HalfEdges::none};
    sum += points.sum_of_squares(only);
    points.for_each(f, [&](Vec3d) { ++count; });
  }
  EXPECT_GT(expected, 0.1);
  EXPECT_NEAR(sum, expected, 1e-9);
  EXPECT_EQ(count, mesh.live_vertices) << "none is lost";
}

TEST(TrackedPoints, OneOfAllIsFurthest) {
  CollapseMesh mesh(landscape(), {});
  TrackedPoints points(mesh);
  disturb(mesh, points, [](double) {});
  double furthest = 0;
  for (std::uint32_t f = 0; f < mesh.normals.size(); ++f) {
    const std::array<Vec3d, 3> corners{mesh.r[mesh.topology.origin(3 * f)],
                                       mesh.r[mesh.topology.origin(3 * f + 1)],
                                       mesh.r[mesh.topology.origin(3 * f + 2)]};
    points.for_each(f, [&](Vec3d p) {
      furthest = std::max(furthest, closest_on_triangle(p, corners).distance);
    });
  }
  EXPECT_GT(furthest, 0.05);
  EXPECT_EQ(points.largest(mesh), furthest);
}

TEST(TrackedPoints, AreFoundAgainFromTheVerticesTheyWentInto) {
  CollapseMesh mesh(landscape(), sides_of(landscape()));
  LargeVector<Vec3d> places = mesh.r;
  CollapseChecks checks(mesh, {0.1}, 0.1);
  EdgeSizes sizes;
  CollapsePasses passes(mesh, checks, sizes, {});
  passes.approach(0, {});
  const std::span<const std::uint32_t> merged_into = passes.merged_into();
  const TrackedPoints points(mesh, places, merged_into, 0.1);
  const TriMesh simple = mesh.extract();
  const TriangleTree tree(simple);
  std::size_t count = 0;
  std::size_t missed = 0;
  for (std::uint32_t f = 0; f < mesh.topology.facet_count(); ++f) {
    if (!mesh.topology.alive(f)) continue;
    points.for_each(f, [&](Vec3d p) {
      const std::array<Vec3d, 3> corners{mesh.r[mesh.topology.origin(3 * f)],
                                         mesh.r[mesh.topology.origin(3 * f + 1)],
                                         mesh.r[mesh.topology.origin(3 * f + 2)]};
      const double found = closest_on_triangle(p, corners).distance;
      const double nearest = tree.closest(p + mesh.centre).distance;
      EXPECT_GE(found, nearest - 1e-6);
      missed += found > nearest + 1e-3 ? 1 : 0;
      ++count;
    });
  }
  EXPECT_EQ(count, places.size());
  EXPECT_LT(missed, 0.02 * count);
  EXPECT_LE(points.largest(mesh), 0.1);
}

}  // namespace
}  // namespace scarp
