#include "apps/simulator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "tests/temporary_folder.h"

namespace scarp {
namespace {

/// The layers at the end of a recipe.
Layers final_layers(const std::string& text) {
  const TemporaryFolder folder;
  std::ofstream(folder / "r.toml") << text;
  const Recipe recipe = read_recipe(folder / "r.toml", {});
  State state = start_state(recipe);
  begin_step(state, recipe);
  while (!finished(state, recipe)) {
    advance(state, recipe, survey(state, recipe), std::numeric_limits<double>::infinity());
  }
  return std::move(state.layers);
}

/// Height of the highest surface below z = 0, at a place. Units: nm.
double height(const LevelSet& phi, double x) {
  double upper = 0;
  while (phi.distance({x, 0, upper - 0.25}) > 0) upper -= 0.25;
  double lower = upper - 0.25;
  for (int n = 0; n < 30; ++n) {
    const double middle = 0.5 * (lower + upper);
    (phi.distance({x, 0, middle}) > 0 ? upper : lower) = middle;
  }
  return lower;
}

constexpr const char* tapered_trench = R"(
[domain]
spacing = "1 nm"
extent = ["60 nm"]
mode = "2d"

[[geometry]]
shape = "wafer"
material = "Si"

[[geometry]]
shape = "trench"
width = "24.6 nm"
depth = "10.3 nm"
taper = "20 deg"

[[step]]
model = "directional"
duration = "8 s"
directional_etch_rate = "1 nm/s"
)";

TEST(Directional, EtchKeepsSlopesAndSinksEverythingAlike) {
  const double mouth = 0.5 * 24.6;
  const double taper = std::tan(20 * std::numbers::pi / 180);
  const double foot = mouth - 10.3 * taper;
  for (const std::string visibility : {"true", "false"}) {
    const Layers layers = final_layers(tapered_trench + ("visibility = " + visibility));
    for (double x = -28.7; x < 29; x += 0.4) {
      const double r = std::abs(x);
      const double before = r > mouth ? 0 : r > foot ? (r - mouth) / taper : -10.3;
      const bool at_edge = std::abs(r - mouth) < 1.2 || std::abs(r - foot) < 1.2;
      EXPECT_NEAR(height(layers.top(), x), before - 8, at_edge ? 0.8 : 0.15)
          << x << " " << visibility;
    }
  }
}

constexpr const char* tilted_beam = R"(
[domain]
spacing = "1 nm"
extent = ["80 nm"]
boundary = ["periodic"]
mode = "2d"

[[geometry]]
shape = "wafer"
material = "Si"

[[geometry]]
shape = "mask"
material = "resist"
thickness = "5 nm"
opening = { shape = "trench", width = "30 nm" }

[[step]]
model = "directional"
duration = "20 s"
directional_etch_rate = { Si = "1 nm/s", resist = "0 nm/s" }
[[step.beam]]
tilt = "30 deg"
)";

TEST(Directional, TiltedBeamCutsAlongItself) {
  const LevelSet phi = final_layers(tilted_beam).top().copy();
  const double slope = std::tan(std::numbers::pi / 6);
  // A beam at 30 degrees sinks a flat bottom by its cosine.
  for (double x = 4; x < 13; x += 0.7) {
    EXPECT_NEAR(height(phi, x), -20 * std::cos(std::numbers::pi / 6), 0.05) << x;
  }
  // The shadow of the mask's upper edge at (-15, 5) on the left.
  for (double x = -10.5; x < -4; x += 0.3) {
    EXPECT_NEAR(height(phi, x), 5 - (x + 15) / slope, 0.2) << x;
  }
  // On the right the beam reaches below the mask, past its lower edge at (15, 0).
  for (double z = -14; z < -2; z += 0.4) {
    const double wall = 15 - z * slope;
    EXPECT_GT(phi.distance({wall - 0.4, 0, z}), 0) << z;
    EXPECT_LT(phi.distance({wall + 0.4, 0, z}), 0) << z;
  }
}

}  // namespace
}  // namespace scarp
