#include "flux/sampling/angle_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/error.h"

namespace scarp {
namespace {

constexpr double degree = std::numbers::pi / 180;

double at_angle(const AngleTable& table, double theta) {
  return table.at(AngleTable::half_sine(std::cos(theta)));
}

TEST(AngleTable, FollowsASmoothFunction) {
  const auto sputter = [](double theta) {
    return std::cos(theta) * (1 + 9.3 * std::pow(std::sin(theta), 2));
  };
  const AngleTable table(sputter);
  // The second derivative is below 20, a step below 0.004 rad: 20 / 8 * 0.004^2.
  for (double theta = 0; theta <= 90; theta += 0.37)
    EXPECT_NEAR(at_angle(table, theta * degree), sputter(theta * degree), 4e-5) << theta;
  EXPECT_NEAR(table.largest(), 4.172, 5e-4);  // at 52.58 degrees
}

TEST(AngleTable, TellsSmallAnglesApart) {
  const AngleTable table([](double theta) { return theta; });
  for (double theta = 0; theta <= 90; theta += 0.05)
    EXPECT_NEAR(at_angle(table, theta * degree), theta * degree, 1e-6) << theta;
}

TEST(AngleTable, KeepsWithinItsEnds) {
  const AngleTable table([](double theta) { return 1 + theta; });
  EXPECT_EQ(table.at(0), 1);
  EXPECT_EQ(at_angle(table, 0), 1);
  EXPECT_NEAR(at_angle(table, std::numbers::pi / 2), 1 + std::numbers::pi / 2, 1e-6);
  EXPECT_EQ(table.at(1), table.at(std::sqrt(0.5)));  // against the normal
  EXPECT_EQ(AngleTable(0.25).at(0.3), 0.25);
}

TEST(AngleTable, IsLinearBetweenTheRowsOfATable) {
  constexpr std::array theta{0.0, 30 * degree, 90 * degree};
  constexpr std::array values{1.0, 4.0, 0.0};
  const AngleTable table = AngleTable::tabulated(theta, values);
  EXPECT_EQ(at_angle(table, 0), 1);
  EXPECT_NEAR(at_angle(table, 10 * degree), 2, 1e-4);
  EXPECT_NEAR(at_angle(table, 60 * degree), 2, 1e-4);
  EXPECT_NEAR(at_angle(table, 90 * degree), 0, 1e-6);
  // The bend lies within a step.
  EXPECT_NEAR(table.largest(), 4, 3 * 0.2 / 30);

  const AngleTable twice[]{table, AngleTable(1)};
  EXPECT_NEAR(at_angle(AngleTable::sum(twice, std::array{2.0, 3.0}), 10 * degree), 7, 2e-4);
}

TEST(AngleTable, RefusesRowsThatMakeNoSense) {
  using testing::HasSubstr;
  using testing::ThrowsMessage;
  const auto make = [](const std::vector<double>& degrees, const std::vector<double>& values) {
    return [=] {
      std::vector<double> theta = degrees;
      for (double& angle : theta) angle *= degree;
      AngleTable::tabulated(theta, values);
    };
  };
  EXPECT_NO_THROW(make({0, 90}, {1, 1})());
  EXPECT_THAT(make({0}, {1}), ThrowsMessage<InputError>(HasSubstr("from 0 to 90 deg")));
  EXPECT_THAT(make({1, 90}, {1, 1}), ThrowsMessage<InputError>(HasSubstr("from 0 to 90 deg")));
  EXPECT_THAT(make({0, 89}, {1, 1}), ThrowsMessage<InputError>(HasSubstr("from 0 to 90 deg")));
  EXPECT_THAT(make({0, 90}, {1}), ThrowsMessage<InputError>(HasSubstr("from 0 to 90 deg")));
  EXPECT_THAT(make({0, 9, 9, 90}, {1, 1, 1, 1}), ThrowsMessage<InputError>(HasSubstr("ascend")));
  EXPECT_THAT(make({0, 90}, {1, std::nan("")}), ThrowsMessage<InputError>(HasSubstr("not finite")));
}

}  // namespace
}  // namespace scarp
