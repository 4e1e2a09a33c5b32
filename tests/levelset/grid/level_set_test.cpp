#include "levelset/grid/level_set.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "levelset/grid/band.h"

namespace scarp {
namespace {

LevelSet tilted_plane(const Frame& frame) {
  return LevelSet(
      frame, [](Vec3d r) { return 0.8 * r.z - 0.6 * r.x - 0.1; }, -40, 40);
}

TEST(LevelSet, IsTheDistanceInTheBandAndClampedOutside) {
  const Frame frame{.spacing = 0.5, .cells = {30, 12}};
  const LevelSet phi = tilted_plane(frame);
  for (const Vec3d r : {Vec3d{1.3, 0.2, 0.7}, Vec3d{-2.1, -1.4, -1.9}, Vec3d{7.5, 3, 6}}) {
    const double exact = 0.8 * r.z - 0.6 * r.x - 0.1;
    EXPECT_NEAR(phi.distance(r), exact, 1e-5) << r.x;
  }
  EXPECT_EQ(phi.distance({0, 0, 30}), 2.0);  // half_width spacings
  EXPECT_EQ(phi.distance({0, 0, -30}), -2.0);
  const Vec3d n = phi.normal({1, 1, 0.9});
  EXPECT_NEAR(n.x, -0.6, 1e-4);
  EXPECT_NEAR(n.y, 0, 1e-4);
  EXPECT_NEAR(n.z, 0.8, 1e-4);
}

TEST(LevelSet, IsMirroredAtReflectiveSidesAndWrappedAtPeriodicOnes) {
  const Frame frame{
      .spacing = 1, .cells = {20, 13}, .boundary = {Boundary::reflective, Boundary::periodic}};
  const LevelSet phi(
      frame, [](Vec3d r) { return 0.5 * (r.z - 0.3 * r.x - std::sin(r.y * 2 * M_PI / 13)); }, -9,
      9);
  for (int k = -3; k < 4; ++k) {
    EXPECT_EQ(phi.node(-2, 3, k), phi.node(2, 3, k));
    EXPECT_EQ(phi.node(22, 3, k), phi.node(18, 3, k));
    EXPECT_EQ(phi.node(4, -1, k), phi.node(4, 12, k));
    EXPECT_EQ(phi.node(4, 14, k), phi.node(4, 1, k));
  }
}

// However far the middles of leaves and of their parts are from the surface.
TEST(LevelSet, HasTheDistanceAtEveryNodeOfTheBand) {
  const Frame frame{.spacing = 0.7, .cells = {40, 36}};
  const auto ball = [](Vec3d r) { return length(r - Vec3d{0.21, -0.13, 1.17}) - 8.9; };
  const LevelSet phi(frame, ball, -9, 12);
  int near = 0;
  for (int i = 0; i <= frame.cells[0]; ++i) {
    for (int j = 0; j <= frame.cells[1]; ++j) {
      for (int k = -14; k <= 18; ++k) {
        const double distance = ball(frame.node_position({i, j, k})) / frame.spacing;
        const double held =
            std::clamp<double>(distance, -LevelSet::half_width, LevelSet::half_width);
        EXPECT_NEAR(phi.node(i, j, k), held, 1e-3) << i << ' ' << j << ' ' << k;
        near += std::abs(distance) < LevelSet::half_width ? 1 : 0;
      }
    }
  }
  EXPECT_GT(near, 5000);
}

// Where cells reach beyond the stored nodes.
TEST(LevelSet, GoesOnBeyondTheSides) {
  for (const Boundary boundary : {Boundary::reflective, Boundary::periodic}) {
    const Frame frame{.spacing = 1, .cells = {28, 26}, .boundary = {boundary, boundary}};
    const LevelSet phi(
        frame, [](Vec3d r) { return r.z - 0.8 * std::cos(0.2 * r.x) - 0.3; }, -4, 4, 1.1);
    for (int axis = 0; axis < 2; ++axis) {
      const double side = 0.5 * frame.cells[axis];
      for (const double beyond : {0.3, 1.4, 2.6, 5.7}) {
        Vec3d outside{3.3, 4.2, 0.4};  // its cell is within a leaf
        Vec3d image = outside;
        outside[axis] = side + beyond;
        image[axis] = boundary == Boundary::periodic ? beyond - side : side - beyond;
        EXPECT_NEAR(phi.distance(outside), phi.distance(image), 1e-6) << axis << ' ' << beyond;
      }
    }
  }
}

// Of the whole and of a quarter from its middle on, at points that are no nodes: the same bits at
// mirror images of a point, also across the diagonal.
TEST(LevelSet, HasMirroredDistancesToTheLastBit) {
  const auto pit = [](Vec3d r) { return r.z + 9 - 0.8 * std::hypot(r.x, r.y); };
  const Frame frame{.spacing = 0.7, .cells = {24, 24}};
  const LevelSet whole(frame, pit, -20, 20, 1.3);
  const Frame quarter_frame{.spacing = 0.7, .cells = {12, 12}, .half = {true, true}};
  const LevelSet quarter(quarter_frame, pit, -20, 20, 1.3);
  int near = 0;
  for (int n = 1; n < 400; ++n) {
    const Vec3d r{8 * std::abs(std::sin(1.7 * n)), 8 * std::abs(std::sin(2.3 * n)),
                  -9 + 7 * std::abs(std::sin(0.9 * n))};
    const double distance = whole.distance(r);
    near += std::abs(distance) < 2 ? 1 : 0;
    EXPECT_EQ(whole.distance({-r.x, r.y, r.z}), distance) << n;
    EXPECT_EQ(whole.distance({r.x, -r.y, r.z}), distance) << n;
    EXPECT_EQ(whole.distance({r.y, r.x, r.z}), distance) << n;
    EXPECT_EQ(quarter.distance(r), distance) << n;
  }
  EXPECT_GT(near, 100);
}

// Of what goes around an axis as well, whose distance depends on y.
TEST(LevelSet, HasTheSameInBothRowsOfTwoDimensions) {
  Frame frame{.spacing = 1, .cells = {20, 1}};
  frame.two_dimensional = true;
  const LevelSet phi(
      frame, [](Vec3d r) { return std::max(r.z, 4.3 - std::hypot(r.x, r.y)); }, -9, 9);
  for (int i = 0; i <= 20; ++i) {
    for (int k = -3; k < 4; ++k) {
      EXPECT_EQ(phi.node(i, 0, k), phi.node(i, 1, k));
      const double x = frame.node_position(0, i);
      const double exact = std::max<double>(k, 4.3 - std::abs(x));
      const double half_width{LevelSet::half_width};
      EXPECT_NEAR(phi.node(i, 0, k), std::clamp(exact, -half_width, half_width), 1e-5);
    }
  }
}

TEST(LevelSet, BandIsCountedExactly) {
  const Frame frame{.spacing = 1, .cells = {10, 20}};
  const LevelSet phi(
      frame, [](Vec3d r) { return r.z - 0.5; }, -8, 8);
  // Heights -3..4: eight nodes in each of the 11 x 21 columns.
  EXPECT_EQ(phi.active_count(), 11U * 21U * 8U);
  EXPECT_GT(phi.memory_bytes(), phi.active_count() * sizeof(float));
  EXPECT_FALSE(phi.empty());
}

TEST(LevelSet, CopiesAreIndependentAndHashTellsThemApart) {
  const Frame frame{.spacing = 1, .cells = {10, 20}};
  LevelSet phi = tilted_plane(frame);
  const LevelSet copied = phi.copy();
  EXPECT_EQ(copied.hash(), phi.hash());
  phi.band().leaves()[0].phi[5] *= 1.0000001F;
  phi.band().leaves()[0].phi[5] = std::nextafter(phi.band().leaves()[0].phi[5], 10.0F);
  EXPECT_NE(copied.hash(), phi.hash());
  EXPECT_EQ(copied.hash(), tilted_plane(frame).hash());
}

TEST(Band, MissingLeavesHaveTheSideOfTheNextLeafAbove) {
  const Frame frame{.spacing = 1, .cells = {40, 8}};
  // A cavity so large that whole leaves inside it are missing.
  const LevelSet phi(
      frame,
      [](Vec3d r) {
        const double cavity = std::max(std::abs(r.x) - 18.5, std::abs(r.z + 40) - 25.5);
        return std::max(r.z - 0.3, -cavity);
      },
      -80, 10);
  EXPECT_EQ(phi.node(20, 3, 500), LevelSet::half_width);
  EXPECT_EQ(phi.node(20, 3, -40), LevelSet::half_width);
  EXPECT_EQ(phi.node(20, 3, -500), -LevelSet::half_width);
  EXPECT_EQ(phi.node(20, 3, -9), -LevelSet::half_width);
  EXPECT_EQ(phi.band().find(2, 0, -5), Band::missing_gas);
  EXPECT_EQ(phi.band().find(2, 0, -50), Band::missing_solid);
}

}  // namespace
}  // namespace scarp
