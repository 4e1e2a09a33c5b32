#include "apps/comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

namespace scarp {
namespace {

TEST(Judge, ToleranceDecidesWithoutSeeds) {
  EXPECT_EQ(judge(0.9, 1, 0.9, std::nullopt), Verdict::within);
  EXPECT_EQ(judge(1.1, 1, 1.1, std::nullopt), Verdict::moved);
}

TEST(Judge, ADifferenceThatSeedsExplainIsNoise) {
  EXPECT_EQ(judge(1.1, 1, 1.1, 2), Verdict::noise);
  EXPECT_EQ(judge(1.1, 1, 1.1, 0.5), Verdict::moved);
}

// However small the spread, what is within the tolerance passes.
TEST(Judge, AKnownDifferenceWithinTheToleranceHasNotMoved) {
  EXPECT_EQ(judge(0.9, 1, 0.9, 1e-9), Verdict::within);
}

TEST(DifferenceError, IsThatOfTwoMeans) {
  const std::array<double, 4> a{1, 2, 3, 4};
  const std::array<double, 2> b{5, 7};
  const auto error = difference_error(sample_of(a), sample_of(b));
  ASSERT_TRUE(error);
  // Squares about the means: 5 and 2; four degrees of freedom.
  EXPECT_NEAR(error->std_error, std::sqrt((5.0 + 2.0) / 4 * (1.0 / 4 + 1.0 / 2)), 1e-12);
  EXPECT_NEAR(error->chance, 6.62 * error->std_error, 0.01 * error->std_error);
}

TEST(DifferenceError, IsUnknownOfSingleRuns) {
  const std::array<double, 1> a{1};
  EXPECT_FALSE(difference_error(sample_of(a), sample_of(a)));
}

// Two groups of three from one distribution, tolerance 0: the rule must be wrong in 0.27 % of all
// cases, and no oftener because there are but three.
TEST(DifferenceError, ChanceIsExceededAsOftenAsByThreeStandardErrors) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  constexpr int count = 40000;
  int moved = 0;
  for (int n = 0; n < count; ++n) {
    std::array<double, 3> a{};
    std::array<double, 3> b{};
    for (double& value : a) value = normal(random);
    for (double& value : b) value = normal(random);
    const Sample first = sample_of(a);
    const Sample second = sample_of(b);
    const double size = std::abs(second.mean - first.mean);
    const auto error = difference_error(first, second);
    if (judge(size, 0, size, error->chance) == Verdict::moved) ++moved;
  }
  const double expected = 0.0027 * count;
  EXPECT_NEAR(moved, expected, 5 * std::sqrt(expected));
}

}  // namespace
}  // namespace scarp
