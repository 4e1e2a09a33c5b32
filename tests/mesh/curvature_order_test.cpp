#include "mesh/curvature_order.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/triangle_tree.h"
#include "mesh/facet_shape.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

std::uint32_t vertex_at(const CollapseMesh& mesh, double x, double y) {
  for (std::uint32_t v = 0; v < mesh.r.size(); ++v) {
    const Vec3d r = mesh.r[v] + mesh.centre;
    if (r.x == x && r.y == y) return v;
  }
  ADD_FAILURE() << "no such vertex";
  return 0;
}

TEST(GradedSizes, GrowAsTheRingsOfThePublishedMethod) {
  const CollapseMesh mesh(noisy_plane(12, 0), {});
  std::vector<bool> is_feature(mesh.r.size(), false);
  for (int y = 0; y <= 12; ++y) is_feature[vertex_at(mesh, 0, y)] = true;
  const double l0 = 0.6;
  const double step_length = 2;
  const std::vector<float> sizes = graded_sizes(mesh.topology, is_feature, l0, step_length, 1);
  for (int x = 0; x <= 12; ++x) {
    EXPECT_FLOAT_EQ(sizes[vertex_at(mesh, x, 6)],
                    static_cast<float>(std::sqrt(l0 * l0 + 2 * step_length * x)));
  }
}

TEST(GradedSizes, HaveNoLimitWithoutFeatures) {
  const CollapseMesh mesh(noisy_plane(4, 0), {});
  for (const float size : graded_sizes(mesh.topology, std::vector<bool>(mesh.r.size()), 1, 1, 1)) {
    EXPECT_TRUE(std::isinf(size));
  }
}

struct Bump {
  CollapseMesh mesh{noisy_plane(12, 0.02), {}};
  TrackedPoints points{mesh};
  std::uint32_t h = mesh.topology.outgoing(vertex_at(mesh, 6, 6));
  std::size_t count = mesh.r.size();

  CurvatureOrder order(float field, std::vector<float> limit, double l_max, double shape_weight) {
    return {
        mesh, points, {std::vector<float>(count, field), std::move(limit), l_max}, shape_weight};
  }
};

TEST(CurvatureOrder, LimitsAreHardAndTheFieldIsSoft) {
  Bump bump;
  const double square = bump.mesh.squared_length(bump.h);
  const double longer = 1.01 * std::sqrt(square);
  EXPECT_TRUE(bump.order(1e-3F, {}, longer, 0).wanted(bump.mesh, bump.h, square));
  EXPECT_FALSE(
      bump.order(1e-3F, {}, 0.99 * std::sqrt(square), 0).wanted(bump.mesh, bump.h, square));
  std::vector<float> limit(bump.count, 10);
  limit[bump.mesh.topology.target(bump.h)] = 0.01F;
  EXPECT_FALSE(bump.order(1e-3F, limit, longer, 0).wanted(bump.mesh, bump.h, square));

  // Half of it is free, then the key grows with the square.
  const auto key = [&](double size) {
    return bump.order(static_cast<float>(size), {}, longer, 0)
        .key(bump.mesh, bump.h, {.r = {}, .cost = 1}, square);
  };
  EXPECT_EQ(key(longer), key(0.51 * std::sqrt(square)));
  EXPECT_NEAR(key(0.05 * std::sqrt(square)), 100 * key(longer), 1e-4 * key(longer));
}

TEST(CurvatureOrder, ExactKeyIsTheSumOfTheSquaredDistances) {
  Bump bump;
  const CurvatureOrder order = bump.order(10, {}, 10, 0);
  CollapseChecks checks(bump.mesh, {}, 1);
  const std::uint32_t u = bump.mesh.topology.origin(bump.h);
  const std::uint32_t v = bump.mesh.topology.target(bump.h);
  // Onto u: only v leaves its place, and the rest of its facets with it.
  ASSERT_TRUE(checks.gather(bump.mesh, bump.h, bump.mesh.r[u]));
  double nearest = 1e300;
  const Star& star = checks.star();
  for (int i = 0; i < star.count; ++i) {
    const ClosestPoint point = closest_on_triangle(
        bump.mesh.r[v], {bump.mesh.r[u], bump.mesh.r[star.ring[i]], bump.mesh.r[star.ring[i + 1]]});
    nearest = std::min(nearest, point.distance);
  }
  EXPECT_NEAR(order.exact_key(bump.mesh, checks), nearest * nearest, 0.02 * nearest * nearest);
  EXPECT_GT(nearest, 1e-3);
}

TEST(CurvatureOrder, EstimateHasTheShapesWithAsManyPointsAsTheAreaHasOnAverage) {
  // Flat, so that the shapes are all there is.
  CollapseMesh mesh(noisy_plane(12, 0), {});
  TrackedPoints points(mesh);
  const std::vector<float> field(mesh.r.size(), 10);
  const CurvatureOrder order(mesh, points, {field, {}, 10}, 1);
  double twice_area = 0;
  for (const Vec3d n : mesh.normals) twice_area += length(n);

  CollapseChecks checks(mesh, {}, 1);
  const std::uint32_t h = mesh.topology.outgoing(vertex_at(mesh, 6, 6));
  const Vec3d r = mesh.r[mesh.topology.origin(h)] + Vec3d{0.3, 0.2, 0};
  ASSERT_TRUE(checks.gather(mesh, h, r));
  const Star& star = checks.star();
  double twice_area_here = 0;
  for (int i = 0; i < star.count; ++i) twice_area_here += length(checks.normals()[i]);
  const double points_here = mesh.live_vertices * twice_area_here / twice_area;
  const double per_facet = points_here / (star.count + star.dying_count());
  const double shapes = shape_growth(mesh, star, r, checks.normals());
  EXPECT_GT(std::abs(shapes), 0.1);
  EXPECT_NEAR(order.key(mesh, h, {.r = r, .cost = 0}, 1), per_facet * shapes, 1e-5);
  // The exact key knows the points, which do not leave the plane.
  EXPECT_NEAR(order.exact_key(mesh, checks), points.per_facet(star) * shapes, 1e-5);
}

TEST(CurvatureOrder, KnowsTheShapesThatCollapsesMake) {
  Bump bump;
  CurvatureOrder order = bump.order(10, {}, 10, 1);
  CollapseMesh& mesh = bump.mesh;
  CollapseChecks checks(mesh, {}, 1);
  const std::uint32_t u = mesh.topology.origin(bump.h);
  const Vec3d r = mesh.r[u] + Vec3d{0.3, 0.2, 0};
  ASSERT_TRUE(checks.gather(mesh, bump.h, r));
  order.accept(mesh, checks);
  mesh.collapse(bump.h, r);
  const Star& star = checks.star();
  for (int i = 0; i < star.count; ++i) mesh.normals[star.facet[i]] = checks.normals()[i];

  const std::uint32_t h = mesh.topology.outgoing(u);
  ASSERT_TRUE(checks.gather(mesh, h, r));
  const CurvatureOrder fresh = bump.order(10, {}, 10, 1);
  EXPECT_NEAR(order.exact_key(mesh, checks), fresh.exact_key(mesh, checks), 1e-6);
  EXPECT_GT(std::abs(fresh.exact_key(mesh, checks)), 1e-2);
}

}  // namespace
}  // namespace scarp
