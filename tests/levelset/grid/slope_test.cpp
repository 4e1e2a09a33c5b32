#include "levelset/grid/slope.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "levelset/grid/band.h"

namespace scarp {
namespace {

constexpr Frame slope_frame{.spacing = 0.5, .cells = {40, 24}};

LevelSet plane(double slope) {
  return LevelSet(
      slope_frame, [slope](Vec3d r) { return slope * (r.z - 0.1); }, -12, 12, std::max(slope, 1.0));
}

TEST(SurfaceSlopes, AreOneOnAnyPlane) {
  for (const Vec3d n : {Vec3d{0, 0, 1}, Vec3d{0.6, 0, 0.8}, Vec3d{2.0 / 3, -1.0 / 3, 2.0 / 3}}) {
    const LevelSet phi(
        slope_frame, [&](Vec3d r) { return dot(n, r) + 0.07; }, -24, 24);
    const SurfaceSlopes slopes = surface_slopes(phi);
    EXPECT_GE(slopes.nodes, 2U * 41 * 25);
    EXPECT_EQ(slopes.off, 0U);
    // Mirrored at the sides a tilted plane has edges there.
    if (n.z == 1) {
      EXPECT_NEAR(slopes.worst, 1, 1e-6);
    }
  }
}

TEST(SurfaceSlopes, AreNotOffOnASphereNorAtEdges) {
  const LevelSet sphere(
      slope_frame, [](Vec3d r) { return length(r) - 4.1; }, -6, 6);
  EXPECT_EQ(surface_slopes(sphere).off, 0U);
  const LevelSet groove(
      slope_frame, [](Vec3d r) { return std::max(r.z, -std::max(std::abs(r.x) - 3, -5 - r.z)); },
      -9, 4);
  EXPECT_EQ(surface_slopes(groove).off, 0U);
}

TEST(SurfaceSlopes, AreOffWherePhiIsTooSteepOrTooFlat) {
  for (const double slope : {1.9, 0.55}) EXPECT_EQ(surface_slopes(plane(slope)).off, 0U) << slope;
  for (const double slope : {2.1, 0.45}) {
    const SurfaceSlopes slopes = surface_slopes(plane(slope));
    EXPECT_EQ(slopes.off, slopes.nodes);
    EXPECT_EQ(slopes.nodes, 2U * 41 * 25);
    EXPECT_NEAR(slopes.worst, slope, 1e-5);
  }
}

TEST(SurfaceSlopes, FindTheNodeThatIsNotANumber) {
  LevelSet phi = plane(1);
  const Leaf& leaf = phi.band().leaves().front();
  const Node node{leaf.origin[0] + 3, leaf.origin[1] + 4, 0};
  for (Leaf& each : phi.band().leaves())
    if (each.origin == Node{leaf.origin[0], leaf.origin[1], 0})
      each.phi[leaf_offset(3, 4, 0)] = std::numeric_limits<float>::quiet_NaN();
  const SurfaceSlopes slopes = surface_slopes(phi);
  EXPECT_TRUE(std::isnan(slopes.worst));
  EXPECT_GE(slopes.off, 1U);
  EXPECT_LE(length(slopes.worst_at - slope_frame.node_position(node)), 1.01 * slope_frame.spacing);
}

}  // namespace
}  // namespace scarp
