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

TEST(IsWorse, TwoStandardErrorsOfTheDifferenceDecide) {
  const MeanValue error{.mean = 1, .std_error = 0.3};
  const auto other = [](double mean) { return MeanValue{.mean = mean, .std_error = 0.4}; };

  EXPECT_FALSE(is_worse(error, other(0.01)));
  EXPECT_TRUE(is_worse(error, other(-0.01)));
  EXPECT_FALSE(is_worse(error, other(3)));
}

/// Something whose error is a floor and what its target adds, known to .01. Its work is a power of
/// its error.
struct Method {
  double floor = 0;
  double target = 0;
  MeanValue error{};
  double work = 0;
  int measurements = 0;
};

void measure(Method& method, double target) {
  method.target = target;
  method.error = {.mean = method.floor + target, .std_error = 0.01};
  method.work = std::pow(method.error.mean, -2);
  ++method.measurements;
}

Method between(const Method& before, const Method& after, double weight) {
  Method method = after;
  method.work = std::pow(before.work, 1 - weight) * std::pow(after.work, weight);
  return method;
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

TEST(BringToEqualError, OneThatBecomesBetterIsTakenBetweenItsLastTwo) {
  Method first = measured(0, 0.3);
  Method second = measured(0, 0.8);

  EXPECT_TRUE(bring_to_equal_error(first, second, measure));

  EXPECT_EQ(second.measurements, 3);
  EXPECT_NEAR(second.work, std::pow(0.3, -2), 1e-9);
  EXPECT_EQ(first.measurements, 1);
}

TEST(BringToEqualError, TheFirstMayBeTheWorseOne) {
  Method first = measured(0.2, 0.2);
  Method second = measured(0.2, 0.1);

  EXPECT_TRUE(bring_to_equal_error(first, second, measure));

  EXPECT_EQ(first.target, 0.1);
  EXPECT_EQ(second.measurements, 1);
}

TEST(BringToEqualError, WithinTheNoiseAHalvingThatGoesTooFarFlattersNobody) {
  Method first = measured(0, 0.09);
  Method second = measured(0, 0.16);

  EXPECT_TRUE(bring_to_equal_error(first, second, measure));

  EXPECT_FALSE(is_worse({.mean = 0.09, .std_error = 0.01}, {.mean = 0.08, .std_error = 0.01}));
  EXPECT_NEAR(second.work, std::pow(0.09, -2), 1e-9);
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
