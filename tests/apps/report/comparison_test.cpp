#include "apps/report/comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

namespace scarp {
namespace {

TEST(Judge, MovedIsWhatIsBeyondToleranceAndChance) {
  EXPECT_EQ(judge(0.9, 1, false), Verdict::within);
  EXPECT_EQ(judge(0.9, 1, true), Verdict::within);
  EXPECT_EQ(judge(1.1, 1, false), Verdict::noise);
  EXPECT_EQ(judge(1.1, 1, true), Verdict::moved);
}

TEST(DifferenceError, IsThatOfTwoMeans) {
  const std::array<double, 4> a{1, 2, 3, 4};
  const std::array<double, 2> b{5, 7};
  const auto error = difference_error(sample_of(a), sample_of(b));
  ASSERT_TRUE(error);
  // Squares about the means: 5 and 2; four degrees of freedom.
  EXPECT_NEAR(error->std_error, std::sqrt((5.0 + 2.0) / 4 * (1.0 / 4 + 1.0 / 2)), 1e-12);
  EXPECT_EQ(error->degrees_of_freedom, 4);
  EXPECT_NEAR(error->chance(2.77645 * error->std_error), 0.05, 1e-6);
  EXPECT_NEAR(error->chance(-2.77645 * error->std_error), 0.05, 1e-6);
}

TEST(DifferenceError, IsUnknownOfSingleRuns) {
  const std::array<double, 1> a{1};
  EXPECT_FALSE(difference_error(sample_of(a), sample_of(a)));
}

TEST(DifferenceError, WithoutSpreadAnyDifferenceIsNoChance) {
  const std::array<double, 2> a{1, 1};
  const std::array<double, 2> b{2, 2};
  EXPECT_EQ(difference_error(sample_of(a), sample_of(b))->chance(1), 0);
  EXPECT_EQ(difference_error(sample_of(a), sample_of(a))->chance(0), 1);
}

// Two groups of three from one distribution: the chance must be as small as in one of a hundred
// cases, and no oftener because there are but three.
TEST(DifferenceError, ChanceIsThatOfGroupsFromOneDistribution) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  constexpr int count = 40000;
  int rare = 0;
  for (int n = 0; n < count; ++n) {
    std::array<double, 3> a{};
    std::array<double, 3> b{};
    for (double& value : a) value = normal(random);
    for (double& value : b) value = normal(random);
    const Sample first = sample_of(a);
    const Sample second = sample_of(b);
    if (difference_error(first, second)->chance(second.mean - first.mean) < 0.01) ++rare;
  }
  const double expected = 0.01 * count;
  EXPECT_NEAR(rare, expected, 5 * std::sqrt(expected));
}

// Of all ways to deal out as many runs with an opening.
TEST(SplitChance, IsThatOfDealingOutRuns) {
  EXPECT_NEAR(split_chance(3, 3, 0, 3), 2.0 / 20, 1e-12);
  EXPECT_NEAR(split_chance(0, 3, 3, 3), 2.0 / 20, 1e-12);
  EXPECT_NEAR(split_chance(1, 3, 0, 3), 1, 1e-12);
  EXPECT_NEAR(split_chance(6, 6, 0, 6), 2.0 / 924, 1e-12);
  EXPECT_NEAR(split_chance(2, 2, 1, 4), 8.0 / 20, 1e-12);
  EXPECT_NEAR(split_chance(3, 3, 3, 3), 1, 1e-12);
}

}  // namespace
}  // namespace scarp
