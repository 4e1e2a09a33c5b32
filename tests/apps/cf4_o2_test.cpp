// Silicon and silicon-germanium in CF4/O2 on whole surfaces.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "apps/simulator.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

Recipe wafer_of(const std::string& material, const std::string& keys) {
  return read_text(R"(
[domain]
mode = "2d"
spacing = "2 nm"
extent = ["40 nm"]
[[geometry]]
shape = "wafer"
material = ")" + material +
                   R"("
[[step]]
model = "cf4_o2"
duration = "1 s"
)" + keys);
}

double blanket_rate(const Recipe& recipe) {
  const State state = start_state(recipe);
  const Survey now = survey(state, recipe);
  const std::vector<float> speeds = facet_speeds(state, now);
  for (const float speed : speeds) EXPECT_NEAR(speed, speeds.front(), 0.01 * std::abs(speed));
  return -speeds.front();
}

// By the balance written out, J_F 500, J_O 50, J_C 5.
TEST(Cf4O2Run, OpenWafersHaveTheBlanketRates) {
  EXPECT_NEAR(blanket_rate(wafer_of("SiGe", "")), 5.474, 0.01 * 5.474);
  const double silicon = 300 * (1000 / 751660.0) / 4 / 5.02;
  EXPECT_NEAR(blanket_rate(wafer_of("Si", "")), silicon, 0.01 * silicon);
  EXPECT_EQ(blanket_rate(wafer_of("SiO2", "")), 0);
}

// In a slot of silicon-germanium, where stickings follow coverages: the balance holds everywhere.
TEST(Cf4O2Run, CoveragesFitTheFluxOnEveryFacet) {
  std::string keys =
      "sticking_in_balance = true\n[flux]\nrays = 20000\n[[geometry]]\n"
      "shape = \"trench\"\nwidth = \"10 nm\"\ndepth = \"30 nm\"\n";
  const Recipe recipe = wafer_of("SiGe", keys);
  const State state = start_state(recipe);
  const Survey now = survey(state, recipe);
  EXPECT_TRUE(now.coverage_fit.reached);
  double least = 1;
  for (std::size_t f = 0; f < now.facets.triangles.size(); ++f) {
    const auto flux = [&](std::size_t gas) { return now.flux[gas].arrivals().mean[f]; };
    const auto theta = [&](std::size_t gas) { return static_cast<double>(now.coverages[gas][f]); };
    const double bare = 1 - theta(0) - theta(1) - theta(2);
    const double tolerance = 3 * recipe.coverages.tolerance;
    const double k = 300 * std::exp(0.4675 * 0.3);
    EXPECT_NEAR(0.7 * 500 * flux(0) * bare, k * theta(0), tolerance * (350 * flux(0) + k));
    EXPECT_NEAR(50 * flux(1) * bare, (0.04 + 500 * flux(0)) * theta(1),
                tolerance * (50 * flux(1) + 500 * flux(0)));
    EXPECT_NEAR(5 * flux(2) * bare, 50 * flux(1) * theta(2), tolerance * 55);
    least = std::min(least, static_cast<double>(flux(1)));
  }
  EXPECT_LT(least, 0.5);
}

}  // namespace
}  // namespace scarp
