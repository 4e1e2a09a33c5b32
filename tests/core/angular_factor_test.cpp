#include "core/angular_factor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace scarp {
namespace {

constexpr double degree = std::numbers::pi / 180;

Vec3f direction(double theta, double phi) {
  return Vec3f(
      Vec3d{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)});
}

/// The derivatives of |p| F by p against differences, in directions away from kinks of F.
void expect_slopes(const AngularFactor& factor, Vec3f p) {
  const AngularRate rate = factor.rate(p);
  for (int axis = 0; axis < 3; ++axis) {
    Vec3f step;
    step[axis] = 0.01F;
    const float slope = (factor.rate(p + step).value - factor.rate(p - step).value) / 0.02F;
    EXPECT_NEAR(rate.slope[axis], slope, 0.02) << axis;
  }
}

TEST(BeamResponse, IsTheResponseAtTheCosine) {
  const Vec3d d{std::sin(0.3), 0, -std::cos(0.3)};
  const AngularFactor factor =
      BeamResponse(d, [](double c) { return c * c * (1 + 9.3 * (1 - c * c)); });
  for (double theta = 0; theta < 180 * degree; theta += 0.17) {
    for (double phi = 0; phi < 360 * degree; phi += 0.41) {
      const Vec3f n = direction(theta, phi);
      const double c = std::max(0.0, -dot(d, Vec3d(n)));
      EXPECT_NEAR(factor.value(n), c * c * (1 + 9.3 * (1 - c * c)), 1e-4);
    }
  }
  expect_slopes(factor, {0.3F, 0.5F, 0.7F});
  expect_slopes(factor, {-0.6F, 0.1F, 0.2F});
  expect_slopes(factor, {0.1F, 0.1F, -0.9F});
}

TEST(BeamResponse, OfTheCosineIsLinear) {
  const BeamResponse beam({0, 0, -1}, [](double c) { return c; });
  const AngularRate steep = beam.rate({0.9F, 0.1F, 0.2F});
  EXPECT_NEAR(steep.value, 0.2, 1e-6);
  EXPECT_NEAR(steep.slope.x, 0, 1e-6);
  EXPECT_NEAR(steep.slope.z, 1, 1e-6);
  EXPECT_EQ(beam.rate({0.5F, 0.5F, -0.1F}).slope, Vec3f{});
  const AngularFactor::Bounds bounds = AngularFactor(beam).bounds();
  EXPECT_NEAR(bounds.value, 1, 1e-6);
  EXPECT_NEAR(bounds.slopes, 1, 1e-5);
  EXPECT_NEAR(AngularFactor(beam).limiting_speed(), 1, 1e-6);
}

TEST(CubicResponse, IsThatOfABeamWithTheSameResponse) {
  const Vec3d d{std::sin(0.3), 0, -std::cos(0.3)};
  const AngularFactor factor = CubicResponse(d, 0.7F, -0.4F);
  const AngularFactor table = BeamResponse(d, [](double c) { return c * (0.7 - 0.4 * c * c); });
  for (double theta = 0; theta < 180 * degree; theta += 0.17) {
    for (double phi = 0; phi < 360 * degree; phi += 0.41) {
      const Vec3f p = 1.3F * direction(theta, phi);
      const AngularRate rate = factor.rate(p);
      const AngularRate same = table.rate(p);
      EXPECT_NEAR(rate.value, same.value, 1e-5);
      // The table's slope is constant in each of its 512 intervals.
      for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(rate.slope[axis], same.slope[axis], 5e-3);
    }
  }
  expect_slopes(factor, {0.3F, 0.5F, 0.7F});
  expect_slopes(factor, {-0.6F, 0.1F, 0.2F});
  EXPECT_EQ(factor.rate({0.1F, 0.1F, -0.9F}).value, 0);
  EXPECT_EQ(factor.rate({0.1F, 0.1F, -0.9F}).slope, Vec3f{});
}

/// 30 % KOH at 70 degrees Celsius, in um/min.
constexpr CrystalRates::Values koh{.r100 = 1, .r110 = 1.855, .r111 = 0.0073, .r311 = 1.801};

TEST(CrystalRates, HasTheGivenRatesAndThoseInBetween) {
  const AngularFactor factor = CrystalRates(koh, {Vec3d{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  const auto rate = [&](Vec3d plane) { return factor.value(Vec3f(normalized(plane))); };
  EXPECT_NEAR(rate({0, 0, 1}), 1, 1e-6);
  EXPECT_NEAR(rate({-1, 0, 1}), 1.855, 1e-5);
  EXPECT_NEAR(rate({1, -1, 1}), 0.0073, 1e-5);
  EXPECT_NEAR(rate({1, 1, 3}), 1.801, 1e-5);
  EXPECT_NEAR(rate({3, -1, -1}), 1.801, 1e-5);
  // Computed from the formula in another program.
  EXPECT_NEAR(rate({2, 1, 0}), 1.4275, 1e-5);
  EXPECT_NEAR(rate({2, 1, 1}), 1.35257, 1e-5);
  EXPECT_NEAR(rate({2, 2, 1}), 0.93115, 1e-5);
  EXPECT_NEAR(rate({3, 3, 1}), 1.23910, 1e-5);
  EXPECT_NEAR(rate({5, 1, 0}), 1.171, 1e-5);
  expect_slopes(factor, {0.3F, 0.5F, 0.8F});
  expect_slopes(factor, {0.9F, 0.1F, -0.2F});
  expect_slopes(factor, {-0.2F, 0.75F, 0.6F});
}

TEST(CrystalRates, TurnWithTheCrystal) {
  const double s = std::sqrt(0.5);
  const AngularFactor factor = CrystalRates(koh, {Vec3d{s, s, 0}, {-s, s, 0}, {0, 0, 1}});
  // The planes {111} rise from a wafer (100) along x and y at 54.74 degrees.
  EXPECT_NEAR(factor.value(direction(std::atan(std::sqrt(2.0)), 0)), 0.0073, 1e-5);
  EXPECT_NEAR(factor.value(direction(90 * degree, 45 * degree)), 1, 1e-5);
  expect_slopes(factor, {0.3F, 0.5F, 0.8F});
}

TEST(AngularFactor, StaysWithinItsBounds) {
  const double s = std::sqrt(0.5);
  const CrystalRates crystal(koh, {Vec3d{s, s, 0}, {-s, s, 0}, {0, 0, 1}});
  const AngularFactor::Bounds bounds = AngularFactor(crystal).bounds();
  for (double theta = 0; theta < 180 * degree; theta += 0.013) {
    for (double phi = 0; phi < 360 * degree; phi += 0.017) {
      const AngularRate rate = crystal.rate(direction(theta, phi));
      EXPECT_LE(std::abs(rate.value), 1.02 * bounds.value);
      EXPECT_LE(std::abs(rate.slope.x) + std::abs(rate.slope.y) + std::abs(rate.slope.z),
                1.02 * bounds.slopes);
    }
  }
}

TEST(AngularRate, IsZeroWithoutADirection) {
  const CrystalRates crystal(koh, {Vec3d{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  EXPECT_EQ(crystal.rate({}).value, 0);
  EXPECT_EQ(crystal.rate({}).slope, Vec3f{});
  EXPECT_EQ(BeamResponse({0, 0, -1}, [](double c) { return c; }).rate({}).slope, Vec3f{});
  EXPECT_EQ(CubicResponse({0, 0, -1}, 1, 1).rate({}).slope, Vec3f{});
}

}  // namespace
}  // namespace scarp
