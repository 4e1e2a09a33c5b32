#include "flux/sampling/portable_math.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace scarp {
namespace {

TEST(PortablePower, AgreesWithTheLibrary) {
  for (const double y : {-1.0, -0.5, 1e-3, 0.5, 1 / 3.0, 1.0, 2.0, 7.5}) {
    for (double x = 1e-6; x <= 1; x *= 1.37) {
      const double expected = std::pow(x, y);
      EXPECT_NEAR(portable_power(x, y), expected, 1e-13 * expected) << x << "^" << y;
    }
    EXPECT_EQ(portable_power(1, y), 1);
  }
  for (const double x : {1.7, 42.0, 1e4}) {
    EXPECT_NEAR(portable_power(x, 0.5), std::sqrt(x), 1e-13 * std::sqrt(x));
    EXPECT_NEAR(portable_power(x, -3), std::pow(x, -3), 1e-13 * std::pow(x, -3));
  }
  EXPECT_EQ(portable_power(0, 0.5), 0);
  EXPECT_EQ(portable_power(-1, 0.5), 0);
  EXPECT_EQ(portable_power(1e-6, 1000), 0);
}

TEST(PortablePower, OfManyIsThatOfEachToTheBit) {
  for (const double y : {-3.0, -0.5, 1e-3, 0.5, 1 / 1001.0, 1.0, 7.5, 1000.0}) {
    std::vector<double> many{0, -1, 1, 0.5, std::numbers::sqrt2 / 2, 2, 1e-300, 1e300};
    for (double x = 1e-17; x < 1e4; x *= 1.0137) many.push_back(x);
    for (std::size_t k = 1; k < 2000; ++k) many.push_back(1 - 0x1p-53 * static_cast<double>(k * k));
    const std::vector<double> given = many;
    portable_powers(many, y);
    for (std::size_t k = 0; k < many.size(); ++k)
      EXPECT_EQ(many[k], portable_power(given[k], y)) << given[k] << "^" << y;
  }
}

TEST(PortableLog, AgreesWithTheLibrary) {
  for (double x = 1e-9; x < 1e9; x *= 1.37)
    EXPECT_NEAR(portable_log(x), std::log(x), 2e-15 * (1 + std::abs(std::log(x)))) << x;
  EXPECT_EQ(portable_log(1), 0);
}

TEST(PortableExp, AgreesWithTheLibrary) {
  for (double x = -100; x <= 100; x += 0.37)
    EXPECT_NEAR(portable_exp(x), std::exp(x), 1e-13 * std::exp(x)) << x;
  EXPECT_EQ(portable_exp(-1e9), 0);
  EXPECT_TRUE(std::isinf(portable_exp(1e9)));
}

TEST(PortableExp, NoNumberStaysNone) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(portable_exp(none)));
  EXPECT_TRUE(std::isnan(portable_power(none, 0.5)));
}

TEST(PortableSineCosine, AgreesWithTheLibrary) {
  for (double angle = -std::numbers::pi / 4; angle <= std::numbers::pi / 4; angle += 0.01) {
    const auto [sine, cosine] = portable_sine_cosine(angle);
    EXPECT_NEAR(sine, std::sin(angle), 1e-15);
    EXPECT_NEAR(cosine, std::cos(angle), 1e-15);
  }
}

TEST(PortableSineCosine, TurnsByQuarters) {
  for (double quarters = -9; quarters <= 9; ++quarters) {
    const double angle = 0.3 + quarters * (std::numbers::pi / 2);
    const auto [sine, cosine] = portable_sine_cosine(0.3, quarters);
    EXPECT_NEAR(sine, std::sin(angle), 1e-14) << quarters;
    EXPECT_NEAR(cosine, std::cos(angle), 1e-14) << quarters;
  }
  EXPECT_EQ(portable_sine_cosine(0, 3).cosine, 0);
  EXPECT_EQ(portable_sine_cosine(0, 4e15 + 1).sine, 1);
}

}  // namespace
}  // namespace scarp
