// Selective epitaxy in an opening of a mask.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "apps/simulator.h"
#include "core/error.h"
#include "levelset/cross_section.h"
#include "tests/apps/final_state.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

// The opening is filled from wall to wall: its width times what the plane of the wafer grows by.
TEST(Epitaxy, FillsAnOpeningFromWallToWall) {
  for (const double width : {80.0, 80.6, 81.3, 83.0}) {
    const Recipe recipe = read_text(R"(
[domain]
mode = "2d"
spacing = "2 nm"
extent = ["160 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "SiO2"
thickness = "40 nm"
opening = { shape = "trench", width = ")" +
                                    std::to_string(width) + R"( nm" }
[[step]]
model = "epitaxy"
duration = "30 s"
material = "SiGe"
growth_rate = "1 nm/s"
)");
    const State state = final_state(recipe);
    // In a slice one spacing wide; half a cell at each wall.
    const double area = material_volumes(state.layers).back() / 2;
    EXPECT_NEAR(area, width * 30, 2 * 0.5 * 4) << width;
    for (double x = 0; x < 0.5 * width - 2; x += 1)
      EXPECT_NEAR(state.layers.top().distance({x, 0, 30}), 0, 0.5) << width << ' ' << x;
  }
}

// Above the mask {111} planes become facets, at 54.74 degrees.
TEST(Epitaxy, SpreadsOverTheMaskWithFacets) {
  const Recipe recipe = read_text(R"(
[domain]
mode = "2d"
spacing = "1 nm"
extent = ["160 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "SiO2"
thickness = "10 nm"
opening = { shape = "trench", width = "80 nm" }
[[step]]
model = "epitaxy"
duration = "50 s"
material = "SiGe"
growth_rate = "1 nm/s"
ratio_111 = 0.2
ratio_110 = 0.5
ratio_311 = 0.7
)");
  const State state = final_state(recipe);
  const std::vector<Polyline> film = cross_section(state.layers, 1, 0.0).back();
  double upper = 0;
  double lower = 0;
  for (const Polyline& line : film) {
    for (std::size_t n = 0; n + 1 < line.points.size(); ++n) {
      const auto& a = line.points[n];
      const auto& b = line.points[n + 1];
      if (a[0] < 0) continue;
      const auto at = [&](double level) {
        return (a[1] - level) * (b[1] - level) <= 0 && a[1] != b[1]
                   ? a[0] + (b[0] - a[0]) * (level - a[1]) / (b[1] - a[1])
                   : 0.0;
      };
      upper = std::max(upper, at(40));
      lower = std::max(lower, at(20));
    }
  }
  EXPECT_NEAR(20 / (lower - upper), std::sqrt(2.0), 0.1);
}

// A cross-section has no sides along y that could mirror the crystal: it is the slice of a periodic
// structure.
TEST(Epitaxy, ACrystalThatIsNotSymmetricAlongTheTrenchGrowsInACrossSection) {
  const auto grown = [](const std::string& domain) {
    const Recipe recipe = read_text("[domain]\nspacing = \"4 nm\"\n" + domain + R"(
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "SiO2"
thickness = "20 nm"
opening = { shape = "trench", width = "80 nm" }
[[step]]
model = "epitaxy"
duration = "60 s"
material = "SiGe"
growth_rate = "1 nm/s"
wafer = "111"
)");
    return material_volumes(final_state(recipe).layers).back();
  };
  const double slice = grown("mode = \"2d\"\nextent = [\"160 nm\"]\n") / 4;
  const double whole =
      grown("extent = [\"160 nm\", \"16 nm\"]\nboundary = [\"reflective\", \"periodic\"]\n") / 16;
  EXPECT_GT(slice, 80 * 25);
  EXPECT_NEAR(slice, whole, 0.02 * whole);
  EXPECT_THROW(grown("extent = [\"160 nm\", \"16 nm\"]\n"), InputError);
}

}  // namespace
}  // namespace scarp
