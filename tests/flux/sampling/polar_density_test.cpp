#include "flux/sampling/polar_density.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "tests/flux/polar_tables.h"

namespace scarp {
namespace {

constexpr double pi = std::numbers::pi;

// Linear in between, a table is off by an eighth of the squared step times the second derivative,
// which for cos^n is n at most.
TEST(PolarDensity, OfATableOfCosinesIsThePowerCosine) {
  constexpr double step = pi / 720;
  for (const double power : {0.0, 1.0, 20.0, 500.0}) {
    const PolarDensity table = exact::power_cosine_table(power);
    const double error = (power + 0.1) * step * step;
    for (double u = 0; u < 0.999; u += 0.037) {
      const double cosine = std::pow(1 - u, 1 / (power + 1));
      EXPECT_NEAR(table.cosine(u), cosine, error) << power << " " << u;
      const double density = (power + 1) / (2 * pi) * std::pow(cosine, power);
      EXPECT_NEAR(table.at(cosine), density, error * (power + 1) / pi) << power << " " << u;
    }
  }
}

TEST(PolarDensity, IsLinearInTheAngleAndZeroOutside) {
  const PolarDensity ring(std::array{pi / 6, pi / 4, pi / 3}, std::array{0.0, 1.0, 0.0});
  EXPECT_EQ(ring.at(std::cos(pi / 6) + 1e-6), 0);
  EXPECT_EQ(ring.at(std::cos(pi / 3) - 1e-6), 0);
  const double peak = ring.at(std::cos(pi / 4));
  EXPECT_NEAR(ring.at(std::cos(pi * 5 / 24)), peak / 2, 2e-3 * peak);
  EXPECT_NEAR(ring.cosine(0), std::cos(pi / 6), 1e-7);
  EXPECT_NEAR(ring.cosine(1), std::cos(pi / 3), 1e-7);
  // What is drawn has the mean of the density.
  double sum = 0;
  constexpr int count = 10'000;
  for (int k = 0; k < count; ++k) sum += ring.cosine((k + 0.5) / count);
  const auto density = [](double theta) {
    return std::max(0.0, 1 - std::abs(theta - pi / 4) / (pi / 12));
  };
  EXPECT_NEAR(sum / count, exact::polar_mean(density, [](double t) { return std::cos(t); }), 2e-5);
}

TEST(PolarDensity, RefusesAnglesBeyondTheHorizon) {
  using testing::HasSubstr;
  using testing::ThrowsMessage;
  EXPECT_THAT(
      [] {
        PolarDensity(std::array{0.0, 2.0}, std::array{1.0, 1.0});
      },
      ThrowsMessage<InputError>(HasSubstr("between 0 and 90 deg")));
  EXPECT_THAT(
      [] {
        PolarDensity(std::array{-0.1, 1.0}, std::array{1.0, 1.0});
      },
      ThrowsMessage<InputError>(HasSubstr("between 0 and 90 deg")));
  EXPECT_THAT(
      [] {
        PolarDensity(std::array{0.5, 0.1}, std::array{1.0, 1.0});
      },
      ThrowsMessage<InputError>(HasSubstr("ascend")));
}

}  // namespace
}  // namespace scarp
