#include "flux/angle_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

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

}  // namespace
}  // namespace scarp
