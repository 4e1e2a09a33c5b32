#include "flux/source_lobe.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/flux/ion_traces.h"

namespace scarp {
namespace {

TEST(SourceLobe, TellsThePartThatComesAlongTheWafer) {
  // Of power n about the vertical it is slope^(n + 1).
  for (const double power : {0.0, 1.0, 3.0})
    for (const double slope : {0.03, 0.5})
      EXPECT_NEAR(part_below({.cosine_power = power}, slope), std::pow(slope, power + 1), 1e-3);
  const auto tilted = [](double degrees) {
    const double tilt = degrees * exact::degree;
    return SourceLobe{.cosine_power = 100, .direction = {std::sin(tilt), 0, -std::cos(tilt)}};
  };
  EXPECT_EQ(part_below(tilted(45), 0.03), 0);
  EXPECT_GT(part_below(tilted(80), 0.03), 0.02);
  SourceLobe turning = tilted(80);
  turning.rotating = true;
  EXPECT_NEAR(part_below(turning, 0.03), part_below(tilted(80), 0.03), 2e-3);
}

}  // namespace
}  // namespace scarp
