#include "tests/bench/equal_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace scarp::bench {
namespace {

TEST(MeanOf, SeveralValuesHaveTheStandardErrorOfTheirMean) {
  const MeanValue value = mean_of(std::array{1.0, 2.0, 6.0});

  EXPECT_DOUBLE_EQ(value.mean, 3);
  EXPECT_DOUBLE_EQ(value.std_error, std::sqrt(14.0 / 6));
}

TEST(MeanOf, OneValueHasNone) {
  const MeanValue value = mean_of(std::array{4.0});

  EXPECT_EQ(value.mean, 4);
  EXPECT_EQ(value.std_error, 0);
}

TEST(WorseOf, TwoStandardErrorsOfTheDifferenceDecide) {
  const MeanValue first{.mean = 1, .std_error = 0.3};
  const auto second = [](double mean) { return MeanValue{.mean = mean, .std_error = 0.4}; };

  EXPECT_EQ(worse_of(first, second(1.99)), Worse::neither);
  EXPECT_EQ(worse_of(first, second(0.01)), Worse::neither);
  EXPECT_EQ(worse_of(first, second(2.01)), Worse::second);
  EXPECT_EQ(worse_of(first, second(-0.01)), Worse::first);
}

/// Something whose error is a floor and what its target adds, known to .01.
struct Method {
  double floor = 0;
  double target = 0;
  MeanValue error{};
  int measurements = 0;
};

void measure(Method& method, double target) {
  method.target = target;
  method.error = {.mean = method.floor + target, .std_error = 0.01};
  ++method.measurements;
}

Method measured(double floor, double target) {
  Method method{.floor = floor};
  measure(method, target);
  return method;
}

TEST(BringToEqualError, EqualOnesAreLeftAlone) {
  Method first = measured(0.1, 0.4);
  Method second = measured(0.12, 0.4);

  EXPECT_TRUE(bring_to_equal_error(first, second, measure));

  EXPECT_EQ(first.measurements, 1);
  EXPECT_EQ(second.measurements, 1);
}

TEST(BringToEqualError, TheWorseOneIsRefinedUntilItIsNot) {
  Method first = measured(0.2, 0.1);
  Method second = measured(0.2, 0.4);

  EXPECT_TRUE(bring_to_equal_error(first, second, measure));

  EXPECT_EQ(first.target, 0.1);
  EXPECT_EQ(second.target, 0.1);
  EXPECT_EQ(second.measurements, 3);
}

TEST(BringToEqualError, OneThatOvershootsIsFollowedByTheOther) {
  Method first = measured(0.2, 0.4);
  Method second = measured(0.2, 0.44);

  EXPECT_TRUE(bring_to_equal_error(first, second, measure));

  EXPECT_EQ(first.target, 0.2);
  EXPECT_EQ(second.target, 0.22);
}

TEST(BringToEqualError, ThirdHalvingIsTheLast) {
  Method first = measured(0.1, 0.1);
  Method second = measured(0.5, 0.8);

  EXPECT_FALSE(bring_to_equal_error(first, second, measure));

  EXPECT_EQ(second.target, 0.1);
  EXPECT_EQ(first.measurements, 1);
}

TEST(BringToEqualError, EqualAfterTheThirdHalvingCounts) {
  Method first = measured(0.2, 0.1);
  Method second = measured(0.2, 0.8);

  EXPECT_TRUE(bring_to_equal_error(first, second, measure));

  EXPECT_EQ(second.measurements, 4);
}

}  // namespace
}  // namespace scarp::bench
