// A crystal in a bath, through a mask.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "apps/simulator.h"
#include "levelset/cross_section.h"
#include "tests/apps/final_state.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

// A slot along <110> becomes a V-groove that ends itself: walls at 54.74 degrees, 0.707 times as
// deep as it is wide.
TEST(KohEtch, ASlotBecomesAVGroove) {
  const Recipe recipe = read_text(R"(
[domain]
mode = "2d"
spacing = "0.1 um"
extent = ["4 um"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "SiO2"
thickness = "0.5 um"
opening = { shape = "trench", width = "2.4 um" }
[[step]]
model = "koh_etch"
duration = "2.3 min"
etch_rate_111 = "0 um/min"
)");
  const State state = final_state(recipe);
  const std::vector<Polyline> silicon = cross_section(state.layers, 1, 0.0).front();
  double lowest = 0;
  for (const Polyline& line : silicon) {
    for (const auto& [x, z] : line.points) {
      lowest = std::min(lowest, z);
      // The walls stay under the edges of the opening; the tip is rounded by a spacing.
      if (z < -1500 || z > -100) continue;
      EXPECT_NEAR(std::abs(x), 1200 + z / std::sqrt(2.0), 60) << z;
    }
  }
  EXPECT_NEAR(lowest, -2400 * std::sqrt(0.5), 150);
}

}  // namespace
}  // namespace scarp
