#include "mesh/simplify/curvature.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

std::vector<double> moduli(std::vector<double> values) {
  for (double& value : values) value = std::abs(value);
  return values;
}

TEST(Curvature, OfASphereIsOneOverTheRadiusEverywhere) {
  const TriMesh sphere = octahedral_sphere(30, 24);
  for (const double kappa : mean_curvature({sphere, {}})) {
    EXPECT_NEAR(kappa, 1 / 30.0, 0.02 / 30.0);
  }
}

TEST(Curvature, OfAMarchingCubesSphereHasTheRightMedian) {
  const Grid grid{.cells = {36, 36, 36}};
  const TriMesh cap = polygonised(grid, [](Vec3d r) { return length(r - Vec3d{0, 0, 0}) - 30.02; });
  const std::vector<double> kappa = mean_curvature({cap, grid.sides()});
  EXPECT_NEAR(quantile(kappa, 0.5), 1 / 30.02, 0.01 / 30.02);
}

TEST(Curvature, OfAHollowIsNegativeAndOfACylinderHalf) {
  const Grid grid{.cells = {30, 8, 30}};
  const TriMesh cylinder = polygonised(grid, [](Vec3d r) { return 24.03 - std::hypot(r.x, r.z); });
  const std::vector<double> kappa = mean_curvature({cylinder, grid.sides()});
  EXPECT_NEAR(quantile(kappa, 0.5), -1 / 48.06, 0.02 / 48.06);
}

TEST(Curvature, SeesTheMirrorImageBehindASide) {
  // A quarter of a cylinder whose axis lies on the side x = 0: the sides cut it at right angles.
  const Grid grid{.cells = {30, 8, 30}};
  const TriMesh cylinder = polygonised(grid, [](Vec3d r) { return std::hypot(r.x, r.z) - 24.03; });
  const std::vector<double> with_sides = mean_curvature({cylinder, grid.sides()});
  const std::vector<double> without = mean_curvature({cylinder, {}});
  std::vector<double> on_sides;
  for (std::size_t v = 0; v < with_sides.size(); ++v) {
    const Vec3f r = cylinder.vertices[v];
    if (r.y != 0 && r.y != 8) continue;
    EXPECT_EQ(without[v], 0);
    on_sides.push_back(with_sides[v]);
  }
  ASSERT_GT(on_sides.size(), 80U);
  EXPECT_NEAR(quantile(on_sides, 0.5), 1 / 48.06, 0.05 / 48.06);
}

TEST(Curvature, OfNoiseOnAPlaneHasTheSpreadOfTheFivePointStencil) {
  // On right triangles the curvature is half the five-point Laplacian of the heights. A height
  // comes from two noisy nodes, .23 and .77 away. 2.576 standard deviations are the 99th
  // percentile.
  const double expected = 2.576 * std::sqrt(5.0) * std::sqrt(0.23 * 0.23 + 0.77 * 0.77);
  for (const double noise : {0.01, 0.05}) {
    const TriMesh plane = noisy_plane(80, noise);
    const std::vector<double> kappa = moduli(mean_curvature({plane, {}}));
    EXPECT_NEAR(quantile(kappa, 0.99), expected * noise, 0.1 * expected * noise);
  }
}

TEST(Curvature, IsZeroWhereNoFacetHasAnArea) {
  const TriMesh line{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}, {}};
  for (const double kappa : mean_curvature({line, {}})) EXPECT_EQ(kappa, 0);
}

TEST(Curvature, IsTheSameOnAnyNumberOfThreads) {
  const TriMesh plane = noisy_plane(60, 0.05);
  const CollapseMesh work(plane, {});
  const auto on_threads = [&](int threads) {
    const ThreadLimit limit(threads);
    return smoothed(mean_curvature(work), work.topology);
  };
  EXPECT_EQ(on_threads(1), on_threads(2));
}

class FeatureThreshold : public testing::TestWithParam<double> {};

TEST_P(FeatureThreshold, FindsEdgesAndNotNoise) {
  // A step with sharp edges across a noisy plane.
  const Grid grid{.cells = {60, 60, 14}, .noise = GetParam()};
  const TriMesh mesh = polygonised(
      grid, [](Vec3d r) { return std::min(r.z - 3.3, std::max(r.z - 9.6, 30.4 - r.x)); });
  const CollapseMesh work(mesh, grid.sides());
  const std::vector<double> kappa = smoothed(mean_curvature(work), work.topology);
  const double threshold = feature_threshold(kappa, work);
  int noise = 0;
  int plain = 0;
  int missed = 0;
  int edge = 0;
  for (std::size_t v = 0; v < kappa.size(); ++v) {
    const Vec3f r = mesh.vertices[v];
    const bool found = std::abs(kappa[v]) > threshold;
    if (std::abs(r.x - 30.4F) > 4) {
      ++plain;
      noise += found ? 1 : 0;
    } else if (std::abs(r.x - 30.4F) < 1 && r.z > 8.5F) {
      ++edge;
      missed += found ? 0 : 1;
    }
  }
  EXPECT_LT(noise, 0.003 * plain) << "threshold " << threshold;
  EXPECT_LT(missed, 0.05 * edge + 1) << "threshold " << threshold;
  EXPECT_GT(edge, 50);
}
INSTANTIATE_TEST_SUITE_P(Noise, FeatureThreshold, testing::Values(0.0, 0.01, 0.05));

}  // namespace
}  // namespace scarp
