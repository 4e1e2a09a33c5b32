#include "flux/sampling/linear_density.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "core/error.h"

namespace scarp {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// A rising, a level and a falling piece, nothing, and a level one.
const LinearDensity pieces(std::array{1.0, 2.0, 4.0, 5.0, 6.0, 6.5, 7.0},
                           std::array{0.0, 2.0, 2.0, 0.0, 0.0, 1.0, 1.0});

TEST(LinearDensity, HasTheIntegralOne) {
  constexpr double whole = 1 + 4 + 1 + 0.25 + 0.5;
  EXPECT_DOUBLE_EQ(pieces.at(1.5), 1 / whole);
  EXPECT_DOUBLE_EQ(pieces.at(3), 2 / whole);
  EXPECT_DOUBLE_EQ(pieces.at(4.75), 0.5 / whole);
  EXPECT_DOUBLE_EQ(pieces.at(7), 1 / whole);
  EXPECT_EQ(pieces.at(5.5), 0);
  EXPECT_EQ(pieces.at(0.999), 0);
  EXPECT_EQ(pieces.at(7.001), 0);
}

// The derivative of a quantile is one over the density there.
TEST(LinearDensity, GivesTheQuantilesOfItsDensity) {
  constexpr double step = 1e-6;
  for (double u = 0.01; u < 0.995; u += 0.0123) {
    const double slope = (pieces.quantile(u + step) - pieces.quantile(u - step)) / (2 * step);
    EXPECT_NEAR(slope * pieces.at(pieces.quantile(u)), 1, 1e-4) << u;
  }
  EXPECT_EQ(pieces.quantile(0), 1);
  EXPECT_DOUBLE_EQ(pieces.quantile(1), 7);
  EXPECT_DOUBLE_EQ(pieces.quantile(1 / 6.75), 2);
}

TEST(LinearDensity, EndsWhereItIsZeroFromThereOn) {
  const LinearDensity peak(std::array{0., 1., 4., 5., 6., 8., 9.},
                           std::array{0., 0., 0., 1., 0., 0., 0.});
  EXPECT_EQ(peak.lowest(), 4);
  EXPECT_EQ(peak.highest(), 6);
  EXPECT_EQ(peak.quantile(0), 4);
  EXPECT_EQ(peak.quantile(1), 6);
}

TEST(LinearDensity, RefusesTablesThatMakeNoSense) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  const auto make = [](const std::vector<double>& x, const std::vector<double>& density) {
    return [=] { LinearDensity(x, density); };
  };
  EXPECT_THAT(make({1}, {1}), ThrowsMessage<InputError>(HasSubstr("at least two")));
  EXPECT_THAT(make({1, 2}, {1}), ThrowsMessage<InputError>(HasSubstr("at least two")));
  EXPECT_THAT(make({1, 1}, {1, 1}), ThrowsMessage<InputError>(HasSubstr("ascend")));
  EXPECT_THAT(make({1, infinite}, {1, 1}), ThrowsMessage<InputError>(HasSubstr("ascend")));
  EXPECT_THAT(make({1, 2}, {1, -1}), ThrowsMessage<InputError>(HasSubstr("negative")));
  EXPECT_THAT(make({1, 2}, {1, infinite}), ThrowsMessage<InputError>(HasSubstr("not finite")));
  EXPECT_THAT(make({1, 2}, {std::nan(""), 1}), ThrowsMessage<InputError>(HasSubstr("not finite")));
  EXPECT_THAT(make({1, 2}, {0, 0}), ThrowsMessage<InputError>(HasSubstr("zero everywhere")));
  EXPECT_THAT(make({0, 1e300}, {1e300, 1e300}), ThrowsMessage<InputError>(HasSubstr("integral")));
}

}  // namespace
}  // namespace scarp
