#include "levelset/motion/godunov.h"

#include <gtest/gtest.h>

#include <cmath>

namespace scarp {
namespace {

/// A field on one node of a crystal with a <110> direction along x, which grows or is etched.
SpeedField crystal_field(float amplitude) {
  const double s = std::sqrt(0.5);
  const AngularFactor koh = CrystalRates({.r100 = 1, .r110 = 1.855, .r111 = 0.0073, .r311 = 1.801},
                                         {Vec3d{s, s, 0}, {-s, s, 0}, {0, 0, 1}});
  SpeedField field{.speed = {0}};
  field.angular.push_back({koh, {amplitude}});
  return field;
}

const float wall_x = -std::sqrt(2.0F / 3);
const float wall_z = std::sqrt(1.0F / 3);

TEST(Godunov, OnAPlaneIsItsRate) {
  const SpeedField field = crystal_field(-1);
  EXPECT_FLOAT_EQ(godunov_rate(field, 0, {0, 0, 1}, {0, 0, 1}), -1);
  EXPECT_NEAR(godunov_rate(field, 0, {wall_x, 0, wall_z}, {wall_x, 0, wall_z}), -0.0073, 1e-5);
}

// Where a floor meets a wall beyond the plane of {111}, which lies between neither both ends nor
// places between them at random: the rate of {111}, by as much of it as is there.
TEST(Godunov, TakesTheSlowestPlaneOfAConcaveCorner) {
  const float rate = godunov_rate(crystal_field(-1), 0, {0, 0, 1}, {-1.63F, 0, 1});
  EXPECT_NEAR(rate, -0.0073 * std::sqrt(3.0), 1e-4);
}

TEST(Godunov, TakesTheFastestPlaneOfAConvexCorner) {
  const SpeedField field = crystal_field(-1);
  // Between {100} and {111} lies {311}, at 25 degrees.
  const float rate = godunov_rate(field, 0, {-1.42F, 0, 1}, {0, 0, 1});
  EXPECT_LT(rate, -1.7);
  EXPECT_GT(rate, -2.2);
}

TEST(Godunov, GrowthIsTheOtherWayRound) {
  const SpeedField field = crystal_field(1);
  EXPECT_GT(godunov_rate(field, 0, {0, 0, 1}, {-1.63F, 0, 1}), 1.8);
  EXPECT_NEAR(godunov_rate(field, 0, {-1.63F, 0, 1}, {0, 0, 1}), 0.0073 * std::sqrt(3.0), 1e-4);
}

TEST(Godunov, MirrorImagesHaveTheSameBits) {
  const SpeedField field = crystal_field(-1);
  const float here = godunov_rate(field, 0, {-0.3F, 0.21F, 0.9F}, {-1.1F, 0.47F, 0.7F});
  EXPECT_EQ(godunov_rate(field, 0, {1.1F, 0.21F, 0.9F}, {0.3F, 0.47F, 0.7F}), here);
  EXPECT_EQ(godunov_rate(field, 0, {-0.3F, -0.47F, 0.9F}, {-1.1F, -0.21F, 0.7F}), here);
}

// Also where one of the two asks for the least value and the other for the largest.
TEST(Godunov, ExchangeOfXAndYKeepsTheBits) {
  const SpeedField field = crystal_field(-1);
  for (const float end : {0.47F, -0.2F}) {
    const float here = godunov_rate(field, 0, {-0.3F, 0.21F, 0.9F}, {-1.1F, end, 0.7F});
    EXPECT_EQ(godunov_rate(field, 0, {0.21F, -0.3F, 0.9F}, {end, -1.1F, 0.7F}), here) << end;
  }
}

}  // namespace
}  // namespace scarp
