#include "flux/sampling/quantiles.h"

#include <gtest/gtest.h>

#include <cmath>

namespace scarp {
namespace {

TEST(Quantiles, AreLinearBetweenTheirEntries) {
  const Quantiles squares(4, [](double u) { return 16 * u * u; });  // 0, 1, 4, 9, 16
  EXPECT_EQ(squares.at(0), 0);
  EXPECT_EQ(squares.at(0.25), 1);
  EXPECT_EQ(squares.at(0.375), 2.5);
  EXPECT_EQ(squares.at(0.9375), 14.25);
  EXPECT_EQ(squares.at(1), 16);
  EXPECT_EQ(squares.largest(), 16);
  EXPECT_EQ(squares.mean(), (0.5 + 2.5 + 6.5 + 12.5) / 4);
  EXPECT_EQ(squares.mean([](double x) { return 3 * x; }), 3 * squares.mean());
}

TEST(Quantiles, EndWhereTheirTableEnds) {
  const Quantiles table(2, [](double u) { return 1 + u; });
  EXPECT_EQ(table.at(-0.1), 1);
  EXPECT_EQ(table.at(1.1), 2);
}

TEST(Quantiles, AreTheInverseOfThePartBelow) {
  const auto part_below = [](double x) { return std::pow((x - 1) / 2, 3); };
  for (const double u : {0.0, 0.001, 0.3, 0.999, 1.0})
    EXPECT_NEAR(inverse(part_below, u, 1, 3), 1 + 2 * std::cbrt(u), 1e-12) << u;
}

}  // namespace
}  // namespace scarp
