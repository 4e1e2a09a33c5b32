#include "core/many_tests.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace scarp {
namespace {

std::vector<LookedAt> alike(const std::vector<double>& chances) {
  std::vector<LookedAt> all;
  for (const double chance : chances) all.push_back({.chance = chance});
  return all;
}

TEST(BeyondChance, OneAloneIsAskedForTheChanceByTheCount) {
  std::vector<LookedAt> all(100);
  all[7].chance = 0.011 / 100;
  EXPECT_FALSE(beyond_chance(all, 0.01)[7]);
  all[7].chance = 0.0099 / 100;
  const std::vector<bool> found = beyond_chance(all, 0.01);
  EXPECT_TRUE(found[7]);
  EXPECT_EQ(std::ranges::count(found, true), 1);
}

TEST(BeyondChance, OneOfHalfTheWeightIsAskedForHalfTheChance) {
  std::vector<LookedAt> all(100);
  all[7] = {.chance = 0.0051, .weight = 99};
  EXPECT_FALSE(beyond_chance(all, 0.01)[7]);
  all[7].chance = 0.0049;
  EXPECT_TRUE(beyond_chance(all, 0.01)[7]);
}

TEST(BeyondChance, ManyTogetherAreAskedForTheChanceItself) {
  EXPECT_EQ(beyond_chance(alike(std::vector<double>(5, 0.009)), 0.01), std::vector<bool>(5, true));
  EXPECT_EQ(beyond_chance(alike(std::vector<double>(5, 0.011)), 0.01), std::vector<bool>(5, false));
  // One of a chance of 0 helps no other one.
  EXPECT_EQ(beyond_chance(alike({0, 0.02, 0.02}), 0.01), (std::vector<bool>{true, false, false}));
}

/// How often any of fifty differences of nothing is found, which share a part of their variance.
double false_alarms(double shared, double wanted) {
  constexpr int trials = 20000;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  int alarms = 0;
  for (int n = 0; n < trials; ++n) {
    const double common = normal(random);
    std::vector<LookedAt> all;
    for (int each = 0; each < 50; ++each) {
      const double z = std::sqrt(shared) * common + std::sqrt(1 - shared) * normal(random);
      all.push_back(
          {.chance = std::erfc(std::abs(z) / std::sqrt(2.0)), .weight = each == 0 ? 49.0 : 1.0});
    }
    const std::vector<bool> found = beyond_chance(all, wanted);
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
