#include "core/many_tests.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace scarp {
namespace {

TEST(BeyondChance, OneAloneIsAskedForTheChanceByTheCount) {
  std::vector<double> chances(100, 1);
  chances[7] = 0.011 / 100;
  EXPECT_FALSE(beyond_chance(chances, 0.01)[7]);
  chances[7] = 0.0099 / 100;
  const std::vector<bool> found = beyond_chance(chances, 0.01);
  EXPECT_TRUE(found[7]);
  EXPECT_EQ(std::ranges::count(found, true), 1);
}

TEST(BeyondChance, ManyTogetherAreAskedForTheChanceItself) {
  EXPECT_EQ(beyond_chance(std::vector<double>(5, 0.009), 0.01), std::vector<bool>(5, true));
  EXPECT_EQ(beyond_chance(std::vector<double>(5, 0.011), 0.01), std::vector<bool>(5, false));
  // One of a chance of 0 helps no other one.
  EXPECT_EQ(beyond_chance(std::vector<double>{0, 0.02, 0.02}, 0.01),
            (std::vector<bool>{true, false, false}));
}

/// How often any of fifty differences of nothing is found, which share a part of their variance.
double false_alarms(double shared, double wanted) {
  constexpr int trials = 20000;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  int alarms = 0;
  for (int n = 0; n < trials; ++n) {
    const double common = normal(random);
    std::vector<double> chances;
    for (int each = 0; each < 50; ++each) {
      const double z = std::sqrt(shared) * common + std::sqrt(1 - shared) * normal(random);
      chances.push_back(std::erfc(std::abs(z) / std::sqrt(2.0)));
    }
    const std::vector<bool> found = beyond_chance(chances, wanted);
    alarms += std::ranges::count(found, true) > 0 ? 1 : 0;
  }
  return static_cast<double>(alarms) / trials;
}

TEST(BeyondChance, WhereNothingDiffersAnythingIsFoundWithTheWantedChanceAtMost) {
  constexpr double wanted = 0.01;
  const double noise = std::sqrt(wanted / 20000);
  for (const double shared : {0.0, 0.5, 0.95, 1.0})
    EXPECT_LT(false_alarms(shared, wanted), wanted + 5 * noise) << shared;
  EXPECT_GT(false_alarms(0, wanted), wanted - 5 * noise);
}

}  // namespace
}  // namespace scarp
