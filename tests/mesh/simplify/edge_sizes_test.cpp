#include "mesh/simplify/edge_sizes.h"

#include <gtest/gtest.h>

#include <cmath>

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

TEST(EdgeSizes, LimitsAreHardAndTheFieldIsSoft) {
  EdgeSizes sizes;
  EXPECT_FALSE(sizes.has_limits());
  EXPECT_EQ(sizes.stretch(0, 1, 1e6), 1);
  sizes.l_max = 3;
  EXPECT_EQ(sizes.limit_between(0, 1), 3);
  sizes.limit = {10, 2};
  EXPECT_EQ(sizes.limit_between(0, 1), 2);
  sizes.field = {1, 5};
  // Up to twice the size is free, then the cost grows with the square.
  EXPECT_EQ(sizes.stretch(0, 1, 3.9), 1);
  EXPECT_EQ(sizes.stretch(0, 1, 400), 100);
  sizes.merged(1, 0);
  EXPECT_EQ(sizes.limit[1], 2);
  EXPECT_EQ(sizes.field[1], 1);
}

TEST(EdgeSizes, MayLimitWhatIsCollapsedAndNotWhatBecomesOfIt) {
  const CollapseMesh mesh(noisy_plane(6, 0), {});
  CollapseChecks checks(mesh, {}, 1);
  const std::uint32_t h = mesh.topology.outgoing(vertex_at(mesh, 3, 3));
  ASSERT_TRUE(checks.gather(mesh, h, mesh.r[mesh.topology.origin(h)]));
  EdgeSizes sizes;
  sizes.l_max = 0.6;
  EXPECT_TRUE(sizes.limit_new_edges());
  EXPECT_FALSE(sizes.allows(mesh, checks));
  sizes.only_old = true;
  EXPECT_TRUE(sizes.has_limits());
  EXPECT_TRUE(sizes.allows(mesh, checks));
}

}  // namespace
}  // namespace scarp
