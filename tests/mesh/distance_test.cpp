#include "mesh/distance.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

TEST(Distance, OfParallelPlanesIsTheirGapWhereTheyFace) {
  const TriMesh a = noisy_plane(10, 0);
  TriMesh b = a;
  for (Vec3f& r : b.vertices) r.z += 0.5F;
  const SurfaceDistance distance = surface_distance(a, b);
  for (const DistanceStatistics& d : {distance.forward, distance.reverse}) {
    EXPECT_NEAR(d.max, 0.5, 1e-6);
    EXPECT_NEAR(d.mean, 0.5, 1e-6);
    EXPECT_NEAR(d.rms, 0.5, 1e-6);
    EXPECT_NEAR(d.p99, 0.5, 1e-6);
  }
  EXPECT_NEAR(distance.symmetric_max, 0.5, 1e-6);
}

TEST(Distance, IsNotTheSameBothWays) {
  // A spike that stands between the vertices of a plane of two triangles.
  const TriMesh plane{{{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}};
  TriMesh spike = plane;
  spike.vertices.push_back({2, 1, 3});
  spike.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 0, 4}, {0, 2, 3}};
  const SurfaceDistance distance = surface_distance(plane, spike);
  EXPECT_EQ(distance.forward.max, 0) << "all vertices of the plane are in the spike";
  EXPECT_DOUBLE_EQ(distance.reverse.max, 3);
  EXPECT_DOUBLE_EQ(distance.symmetric_max, 3);
  EXPECT_GT(surface_distance(plane, spike, 0.05).forward.max, 0.3) << "samples see the hole";
}

TEST(Distance, StatisticsAreThoseOfTheValues) {
  std::vector<double> values;
  for (int i = 1; i <= 1000; ++i) values.push_back(i);
  const DistanceStatistics s = statistics(values);
  EXPECT_EQ(s.max, 1000);
  EXPECT_DOUBLE_EQ(s.mean, 500.5);
  EXPECT_DOUBLE_EQ(s.rms, std::sqrt(1001 * 2001 / 6.0));
  EXPECT_EQ(s.p99, 990);
  EXPECT_EQ(statistics({}).max, 0);
}

TEST(Distance, SamplesLeaveNoGapWiderThanTheirSpacing) {
  for (const Vec3f tip : {Vec3f{2, 5, 1}, {0.1F, 6, 0}, {3, 0.2F, 0.3F}, {9, 4, 1}}) {
    const TriMesh triangle{{{0, 0, 0}, {7, 0, 0}, tip}, {{0, 1, 2}}, {}};
    const std::vector<Vec3d> samples = surface_samples(triangle, 0.3);
    for (const Vec3d r : surface_samples(triangle, 0.03)) {
      double nearest = 1e9;
      for (const Vec3d s : samples) nearest = std::min(nearest, length(r - s));
      EXPECT_LE(nearest, 0.3 + 1e-9);
    }
  }
}

TEST(Distance, SamplesOfNeedlesAreAsManyAsTheirLengthAsksFor) {
  const TriMesh needle{{{0, 0, 0}, {1000, 0, 0}, {0, 0.01F, 0}}, {{0, 1, 2}}, {}};
  EXPECT_LT(surface_samples(needle, 0.1).size(), 10'000U);
}

TEST(Distance, VerticesWithoutATriangleAreNoPartOfTheSurface) {
  TriMesh mesh = noisy_plane(4, 0);
  mesh.vertices.insert(mesh.vertices.begin(), {0, 0, 99});
  for (Triangle& t : mesh.triangles) {
    for (std::uint32_t& v : t) ++v;
  }
  EXPECT_EQ(surface_vertices(mesh).size(), mesh.vertices.size() - 1);
}

TEST(Distance, OfNothingIsRefused) {
  EXPECT_THROW(surface_distance(TriMesh{}, noisy_plane(4, 0)), InputError);
  EXPECT_THROW(surface_distance(noisy_plane(4, 0), TriMesh{}), InputError);
}

TEST(Distance, IsTheSameOnAnyNumberOfThreads) {
  const TriMesh a = noisy_plane(40, 0.05, 1);
  const TriMesh b = noisy_plane(40, 0.05, 2);
  const auto on_threads = [&](int threads) {
    const ThreadLimit limit(threads);
    return distances(surface_vertices(a), TriangleTree(b));
  };
  EXPECT_EQ(on_threads(1), on_threads(2));
}

// A roof over a flat square of two facets: the ridge is farthest away, in the middle of an edge.
TEST(ProvenDistance, IsTheGreatestOneWithinTheSlack) {
  const TriMesh flat{.vertices = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}},
                     .triangles = {{0, 1, 2}, {0, 2, 3}},
                     .materials = {}};
  const TriMesh roof{.vertices = {{0, 0, 0}, {2, 0, 1}, {4, 0, 0}, {4, 4, 0}, {2, 4, 1}, {0, 4, 0}},
                     .triangles = {{0, 1, 4}, {0, 4, 5}, {1, 2, 3}, {1, 3, 4}},
                     .materials = {}};
  for (const double slack : {0.1, 0.001}) {
    const double there = proven_distance(roof, flat, slack);
    EXPECT_GE(there, 1);
    EXPECT_LE(there, 1 + slack);
    // No vertex of the square is off the roof: only what lies between them.
    const double back = proven_distance(flat, roof, slack);
    EXPECT_GE(back, 2 / std::sqrt(5.0) - 1e-6);
    EXPECT_LE(back, 2 / std::sqrt(5.0) + slack);
  }
}

}  // namespace
}  // namespace scarp
