#include "core/angular_factor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

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
  const AngularFactor beam = BeamResponse({0, 0, -1}, [](double c) { return c; });
  const AngularRate steep = beam.rate({0.9F, 0.1F, 0.2F});
  EXPECT_NEAR(steep.value, 0.2, 1e-6);
  EXPECT_NEAR(steep.slope.x, 0, 1e-6);
  EXPECT_NEAR(steep.slope.z, 1, 1e-6);
  EXPECT_EQ(beam.rate({0.5F, 0.5F, -0.1F}).slope, Vec3f{});
  EXPECT_NEAR(beam.bounds().value, 1, 1e-6);
  EXPECT_NEAR(beam.bounds().slopes, 1, 1e-5);
  EXPECT_NEAR(LimitingSpeed({&beam, 1})(0, [](std::size_t) { return 1.0F; }), 1, 1e-6);
}

TEST(CosineResponse, IsThatOfABeamWithTheSameResponse) {
  const Vec3d d{std::sin(0.3), 0, -std::cos(0.3)};
  const AngularFactor factor = CosineResponse(d);
  const AngularFactor table = BeamResponse(d, [](double c) { return c; });
  for (double theta = 0; theta < 180 * degree; theta += 0.17) {
    for (double phi = 0; phi < 360 * degree; phi += 0.41) {
      const Vec3f p = 1.3F * direction(theta, phi);
      const AngularRate rate = factor.rate(p);
      const AngularRate same = table.rate(p);
      EXPECT_NEAR(rate.value, same.value, 1e-5);
      for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(rate.slope[axis], same.slope[axis], 1e-4);
    }
  }
  EXPECT_EQ(factor.rate({0.1F, 0.1F, -0.9F}).value, 0);
  EXPECT_EQ(factor.rate({0.1F, 0.1F, -0.9F}).slope, Vec3f{});
}

/// The cosine times what is 2 at 0 degrees, 5 at 60 and 1 from a cosine of 0.1 on.
std::vector<AngularFactor> slope_factors(Vec3d direction) {
  return {SlopeResponse(direction, 0.5F, 1, 2), SlopeResponse(direction, 0.1F, 0.5F, 1),
          SlopeResponse(direction, -1, 0.1F, 0.5F)};
}
constexpr std::array<float, 3> slope_amplitudes{2, 5, 1};

TEST(SlopeResponse, IsLinearInTheCosineBetweenSlopes) {
  const Vec3d d{std::sin(0.3), 0, -std::cos(0.3)};
  const std::vector<AngularFactor> factors = slope_factors(d);
  for (double theta = 0; theta < 180 * degree; theta += 0.17) {
    for (double phi = 0; phi < 360 * degree; phi += 0.41) {
      const Vec3f n = direction(theta, phi);
      const double c = std::max(0.0, -dot(d, Vec3d(n)));
      const double beyond = 1 + 4 * std::clamp((c - 0.1) / 0.4, 0.0, 1.0);
      const double expected = c * (c > 0.5 ? 5 - 6 * (c - 0.5) : beyond);
      float sum = 0;
      for (std::size_t k = 0; k < factors.size(); ++k)
        sum += slope_amplitudes[k] * factors[k].value(n);
      EXPECT_NEAR(sum, expected, 1e-5);
    }
  }
  for (const AngularFactor& factor : factors) {
    expect_slopes(factor, {0.3F, 0.5F, 0.7F});
    expect_slopes(factor, {-0.6F, 0.1F, 0.6F});
  }
}

TEST(SlopeResponse, IsZeroWhereItSaysSo) {
  for (const AngularFactor& factor : slope_factors({0, 0, -1})) {
    const SlopeResponse& slopes = *factor.between_slopes();
    for (int n = 0; n < 100; ++n) {
      const float cosine = 0.01F * (static_cast<float>(n) + 0.5F);  // beside its bends
      const AxialRate rate = slopes.at(cosine);
      EXPECT_EQ(slopes.is_zero_between(cosine, cosine), rate.value == 0 && rate.rise == 0);
    }
    EXPECT_TRUE(slopes.is_zero_between(0, 0));
    EXPECT_EQ(factor.value({0.6F, 0, -0.8F}), 0);
    EXPECT_FALSE(slopes.is_zero_between(0, 1));
  }
}

TEST(AxialRate, AddsUpAboutAnAxis) {
  const Vec3f d{0.6F, 0, -0.8F};
  const std::vector<AngularFactor> factors = slope_factors(Vec3d(d));
  for (const Vec3f p : {Vec3f{-0.3F, 0.5F, 0.7F}, Vec3f{0.6F, 0.1F, 0.6F}, Vec3f{0, 0, -1}}) {
    const Vec3f n = normalized(p);
    AngularRate expected;
    AxialRate together;
    for (std::size_t k = 0; k < factors.size(); ++k) {
      const AngularRate one = factors[k].rate(p);
      expected.value += slope_amplitudes[k] * one.value;
      expected.slope += slope_amplitudes[k] * one.slope;
      const AxialRate at = factors[k].between_slopes()->at(axial_cosine(d, n));
      together.value += slope_amplitudes[k] * at.value;
      together.rise += slope_amplitudes[k] * at.rise;
    }
    const AngularRate rate = rate_about(d, length(p), n, together);
    EXPECT_NEAR(rate.value, expected.value, 1e-5);
    EXPECT_NEAR(length(rate.slope - expected.slope), 0, 1e-4);
  }
}

// Of several factors of an axis what they do together; of one that is taken from another, less.
TEST(LimitingSpeed, IsThatOfTheSumOfFactors) {
  for (const Vec3d d : {Vec3d{0, 0, -1}, Vec3d{std::sin(0.3), 0, -std::cos(0.3)}}) {
    const std::vector<AngularFactor> factors = slope_factors(d);
    const LimitingSpeed limiting_speed(factors);
    double most = 0;
    for (double theta = 0; theta < 180 * degree; theta += 0.01) {
      for (double phi = 0; phi < 360 * degree; phi += 0.1) {
        AngularRate sum;
        for (std::size_t k = 0; k < factors.size(); ++k) {
          const AngularRate rate = factors[k].rate(direction(theta, phi));
          sum.value += slope_amplitudes[k] * rate.value;
          sum.slope += slope_amplitudes[k] * rate.slope;
        }
        const double slopes = static_cast<double>(std::abs(sum.slope.x)) + std::abs(sum.slope.y) +
                              std::abs(sum.slope.z);
        most = std::max({most, static_cast<double>(sum.value), slopes / std::sqrt(3.0)});
      }
    }
    const double limit = limiting_speed(0, [](std::size_t k) { return slope_amplitudes[k]; });
    EXPECT_GT(limit, 0.97 * most);
    EXPECT_LT(limit, (d.x == 0 ? 1.03 : 1.5) * most);
    EXPECT_EQ(limiting_speed(0.5F, [](std::size_t) { return 0.0F; }), 0.5F);
  }
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

// Along an axis: where a cosine to an axis of the crystal is zero, or two are as large.
TEST(CrystalRates, HaveCreasesWhereCosinesMeet) {
  const double s = std::sqrt(0.5);
  const std::array<Vec3d, 3> axes{
      Vec3d{0.6, 0.8, 0}, {-0.8 * s, 0.6 * s, s}, {0.8 * s, -0.6 * s, s}};
  const CrystalRates crystal(koh, axes);
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3d p{0.37, -0.21, 0.53};
    std::vector<double> expected;
    const auto add = [&](const Vec3d& normal) {
      Vec3d start = p;
      start[axis] = 0;
      if (std::abs(normal[axis]) > 1e-3) expected.push_back(-dot(normal, start) / normal[axis]);
    };
    for (std::size_t n = 0; n < 3; ++n) {
      add(axes[n]);
      add(axes[n] - axes[(n + 1) % 3]);
      add(axes[n] + axes[(n + 1) % 3]);
    }
    const CrystalRates::Creases found = crystal.creases(Vec3f(p), axis);
    ASSERT_EQ(static_cast<std::size_t>(found.count), expected.size()) << axis;
    for (std::size_t n = 0; n < expected.size(); ++n) EXPECT_NEAR(found.at[n], expected[n], 1e-4);
  }
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
  const AngularFactor beam = BeamResponse({0, 0, -1}, [](double c) { return c; });
  EXPECT_EQ(beam.rate({}).slope, Vec3f{});
  const AngularFactor cosine = CosineResponse({0, 0, -1});
  EXPECT_EQ(cosine.rate({}).slope, Vec3f{});
}

}  // namespace
}  // namespace scarp
