// Silicon-germanium in CF4/O2 on whole surfaces.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "apps/simulator/simulator.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

// In a slot of silicon-germanium, where stickings follow coverages: the balance holds everywhere.
TEST(Cf4O2Run, CoveragesFitTheFluxOnEveryFacet) {
  const Recipe recipe = read_text(R"(
[domain]
mode = "2d"
spacing = "2 nm"
extent = ["40 nm"]
[[geometry]]
shape = "wafer"
material = "SiGe"
[[geometry]]
shape = "trench"
width = "10 nm"
depth = "30 nm"
[flux]
rays = 20000
[[step]]
model = "cf4_o2"
duration = "1 s"
sticking_in_balance = true
)");
  const State state = start_state(recipe.domain.frame, recipe.start);
  const Survey now = survey(state, recipe);
  EXPECT_TRUE(now.coverage_fit.reached);
  double least = 1;
  for (std::size_t f = 0; f < now.facets.triangles.size(); ++f) {
    const auto flux = [&](std::size_t gas) { return now.flux[gas].arrivals().mean[f]; };
    const auto theta = [&](std::size_t gas) { return static_cast<double>(now.coverages[gas][f]); };
    const double bare = 1 - theta(0) - theta(1) - theta(2);
    const double tolerance = 3 * recipe.flux.coverages.tolerance;
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
