#include "flux/energy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "core/error.h"

namespace scarp {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// Mean of (quantile - about)^power over u.
template <class Quantile>
double moment(const Quantile& quantile, double about, int power) {
  constexpr int count = 100'000;
  double sum = 0;
  for (int n = 0; n < count; ++n) sum += std::pow(quantile((n + 0.5) / count) - about, power);
  return sum / count;
}

double moment(const EnergyDistribution& energy, double about, int power) {
  return moment([&](double u) { return energy.quantile(u); }, about, power);
}

TEST(StandardNormal, HasTheMomentsOfTheNormalDistribution) {
  EXPECT_NEAR(moment(standard_normal, 0, 1), 0, 1e-6);
  EXPECT_NEAR(moment(standard_normal, 0, 2), 1, 2e-3);
  EXPECT_NEAR(moment(standard_normal, 0, 4), 3, 3e-2);
  EXPECT_NEAR(standard_normal(0.5), 0, 1e-6);
  EXPECT_NEAR(standard_normal(0.975), 1.959964, 1e-4);
  EXPECT_NEAR(standard_normal(1), 4.2, 0.05);
}

TEST(Energy, IsGaussianAndNeverNegative) {
  const EnergyDistribution narrow = EnergyDistribution::gaussian(100, 10);
  EXPECT_NEAR(narrow.mean(), 100, 1e-3);
  EXPECT_NEAR(std::sqrt(moment(narrow, 100, 2)), 10, 0.01);

  // Cut at 0 the standard normal distribution has the mean sqrt(2 / pi) and the mean square 1.
  const EnergyDistribution half = EnergyDistribution::gaussian(0, 1);
  EXPECT_GE(half.quantile(0), 0);
  EXPECT_NEAR(half.mean(), std::sqrt(2 / 3.14159265358979), 1e-3);
  EXPECT_NEAR(moment(half, 0, 2), 1, 2e-3);

  const EnergyDistribution sharp = EnergyDistribution::gaussian(50, 0);
  EXPECT_EQ(sharp.quantile(0), 50);
  EXPECT_EQ(sharp.quantile(0.999), 50);
  EXPECT_EQ(EnergyDistribution::gaussian(-5, 0).quantile(0.5), 0);
}

TEST(Energy, OfASheathHasTwoPeaks) {
  const EnergyDistribution energy = EnergyDistribution::bimodal(200, 60);
  EXPECT_NEAR(energy.mean(), 200, 1e-3);
  EXPECT_NEAR(moment(energy, 200, 2), 30 * 30 / 2.0, 0.1);
  EXPECT_NEAR(energy.quantile(0), 170, 1e-3);
  EXPECT_NEAR(energy.largest(), 230, 1e-3);
}

TEST(Energy, FollowsATable) {
  // Rising linearly from 0: a part u lies below sqrt(u).
  const EnergyDistribution rising =
      EnergyDistribution::tabulated(std::array{0.0, 100.0}, std::array{0.0, 5.0});
  for (const double u : {0.01, 0.25, 0.5, 0.81})
    EXPECT_NEAR(rising.quantile(u), 100 * std::sqrt(u), 0.02) << u;
  // Nothing between two boxes.
  const EnergyDistribution boxes = EnergyDistribution::tabulated(
      std::array{10.0, 20.0, 20.001, 79.999, 80.0, 90.0}, std::array{1., 1., 0., 0., 3., 3.});
  EXPECT_EQ(boxes.quantile(0), 10);
  EXPECT_EQ(boxes.largest(), 90);
  EXPECT_NEAR(boxes.quantile(0.125), 15, 0.01);
  EXPECT_NEAR(boxes.quantile(0.625), 85, 0.01);
}

TEST(Energy, OfATableEndsWhereItsDensityDoes) {
  const EnergyDistribution one_peak = EnergyDistribution::tabulated(
      std::array{0.0, 10.0, 40.0, 50.0, 60.0, 80.0, 90.0}, std::array{0., 0., 0., 1., 0., 0., 0.});
  EXPECT_EQ(one_peak.quantile(0), 40);
  EXPECT_EQ(one_peak.largest(), 60);
  EXPECT_NEAR(one_peak.quantile(0.125), 45, 0.01);
  EXPECT_NEAR(one_peak.quantile(0.875), 55, 0.01);
}

TEST(Energy, RefusesTablesThatMakeNoSense) {
  const auto make = [](const std::vector<double>& energy, const std::vector<double>& density) {
    return [=] { EnergyDistribution::tabulated(energy, density); };
  };
  EXPECT_THAT(make({1}, {1}), ThrowsMessage<InputError>(HasSubstr("at least two")));
  EXPECT_THAT(make({1, 2}, {1}), ThrowsMessage<InputError>(HasSubstr("at least two")));
  EXPECT_THAT(make({1, 1}, {1, 1}), ThrowsMessage<InputError>(HasSubstr("ascend")));
  EXPECT_THAT(make({-1, 1}, {1, 1}), ThrowsMessage<InputError>(HasSubstr("ascend")));
  EXPECT_THAT(make({1, 2}, {1, -1}), ThrowsMessage<InputError>(HasSubstr("negative")));
  EXPECT_THAT(make({1, 2}, {0, 0}), ThrowsMessage<InputError>(HasSubstr("zero everywhere")));
  EXPECT_THAT(make({1, 2}, {std::nan(""), 1}), ThrowsMessage<InputError>(HasSubstr("negative")));
}

}  // namespace
}  // namespace scarp
