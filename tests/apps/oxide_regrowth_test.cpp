// Nitride that a bath takes out from between oxide, and the silica that settles again.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "apps/run/results.h"
#include "apps/simulator/surface_speeds.h"
#include "core/parallel.h"
#include "levelset/operations/layer_steps.h"
#include "tests/apps/final_state.h"
#include "tests/apps/recipe_text.h"
#include "tests/levelset/cross_sections.h"

namespace scarp {
namespace {

/// Four films of nitride beside half a slit. Saturation is 4e-4 of 1e22 /cm3.
std::string stack(const std::string& domain, const std::string& keys) {
  return "[domain]\nspacing = \"3 nm\"\n" + domain + R"(
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "stack"
materials = ["SiO2", "Si3N4"]
thicknesses = ["30 nm", "30 nm"]
count = 4
[[geometry]]
shape = "layer"
material = "SiO2"
thickness = "30 nm"
[[geometry]]
shape = "trench"
width = "90 nm"
depth = "270 nm"
center = "-60 nm"
[[step]]
model = "oxide_regrowth"
duration = "3 min"
material = "SiO2"
saturation = "4e18 /cm3"
settling_rate = "2 um/s"
)" + keys;
}

const std::string plane = "mode = \"2d\"\nextent = [\"120 nm\"]\nboundary = [\"reflective\"]\n";
const std::string strip =
    "extent = [\"120 nm\", \"24 nm\"]\nboundary = [\"reflective\", \"reflective\"]\n";
const std::string rich =
    "bath_concentration = \"4.4e18 /cm3\"\ndiffusivity = \"1e-7 cm2/s\"\n"
    "boundary_layer = \"1 um\"\n";

Survey first_survey(const Recipe& recipe, State& state) {
  state = start_state(recipe.domain.frame, recipe.start);
  begin_step(state, recipe.steps);
  return survey(state, recipe);
}

// Nothing but what goes to the bath leaves: what the speeds take off the solid, in molecules.
TEST(OxideRegrowthRun, SilicaIsConserved) {
  for (const std::string& domain : {plane, strip}) {
    const Recipe recipe = read_text(stack(domain, rich));
    State state = start_state(recipe.domain.frame, recipe.start);
    const Survey now = first_survey(recipe, state);
    const std::vector<float> speeds = facet_speeds(state, now);
    const std::vector<double> areas = facet_areas(now.facets);
    const MaterialId nitride = recipe.materials.id("Si3N4");
    double dissolved = 0;
    double settled = 0;
    for (std::size_t f = 0; f < areas.size(); ++f) {
      const MaterialId m = now.facets.materials[f];
      const double volume = areas[f] * speeds[f] * recipe.materials[m].density;
      if (m == nitride) dissolved -= 3 * volume;
      if (speeds[f] > 0) settled += volume;
    }
    const FluxAudit& audit = now.flux.front().audit;
    EXPECT_GT(settled, 0.05 * dissolved);
    EXPECT_NEAR(4e-4 * audit.emitted, dissolved, 1e-5 * dissolved);
    EXPECT_NEAR(4e-4 * audit.absorbed, settled, 0.02 * settled);
    EXPECT_NEAR(audit.balance_error(), 0, 1e-7);
  }
}

TEST(OxideRegrowthRun, AStripIsItsCrossSection) {
  const auto mean_speed = [](const std::string& domain, const char* material) {
    const Recipe recipe = read_text(stack(domain, rich));
    State state = start_state(recipe.domain.frame, recipe.start);
    const Survey now = first_survey(recipe, state);
    const std::vector<float> speeds = facet_speeds(state, now);
    const std::vector<double> areas = facet_areas(now.facets);
    double sum = 0;
    double area = 0;
    for (std::size_t f = 0; f < areas.size(); ++f) {
      if (now.facets.materials[f] != recipe.materials.id(material)) continue;
      sum += areas[f] * speeds[f];
      area += areas[f];
    }
    return sum / area;
  };
  EXPECT_NEAR(mean_speed(plane, "Si3N4"), -6.5 / 60, 1e-6);
  EXPECT_NEAR(mean_speed(strip, "Si3N4"), -6.5 / 60, 1e-6);
  const double grows = mean_speed(plane, "SiO2");
  EXPECT_GT(grows, 0.001);
  EXPECT_NEAR(mean_speed(strip, "SiO2"), grows, 0.02 * grows);
}

/// The outline of the solid, from the slit on: the leftmost point at a height.
double wall_at(const State& state, double z) {
  double left = 1e9;
  const std::vector<Polyline> outline = cross_section(state.layers, 1, 0.0).back();
  for (const Polyline& line : outline) {
    for (std::size_t p = 0; p + 1 < line.points.size(); ++p) {
      const auto& [xa, za] = line.points[p];
      const auto& [xb, zb] = line.points[p + 1];
      if ((za < z) != (zb < z)) left = std::min(left, xa + (z - za) / (zb - za) * (xb - xa));
    }
  }
  return left;
}

// The ends of the oxide, whose wall was at -15 nm, grow into the slit, the lowest most; in a bath
// that takes up all they stay.
TEST(OxideRegrowthRun, OxideGrowsMostAtTheBottomOfTheSlit) {
  const State grown = final_state(read_text(stack(plane, rich)));
  const State clean = final_state(read_text(stack(plane, "bath_concentration = \"0 /cm3\"\n")));
  double last = 100;
  for (const double z : {15.0, 75.0, 135.0, 195.0}) {
    const double thickness = -15 - wall_at(grown, z);
    EXPECT_GT(thickness, 1) << z;
    EXPECT_LT(thickness, last) << z;
    last = thickness;
    EXPECT_NEAR(wall_at(clean, z), -15, 0.02) << z;
  }
  for (const double z : {45.0, 105.0, 165.0, 225.0})
    for (const State* const state : {&grown, &clean})
      EXPECT_NEAR(wall_at(*state, z), -15 + 180 * 6.5 / 60, 0.3) << z;
}

TEST(OxideRegrowthRun, BitsDoNotDependOnThreads) {
  const Recipe recipe = read_text(stack(strip, rich));
  const auto hash_after = [&](int threads) {
    const ThreadLimit limit(threads);
    State state = start_state(recipe.domain.frame, recipe.start);
    for (int n = 0; n < 2; ++n) {
      begin_step(state, recipe.steps);
      const Survey now = survey(state, recipe);
      advance(state, recipe, now, next_output(state, recipe.outputs.every));
    }
    return hash(state.layers);
  };
  EXPECT_EQ(hash_after(1), hash_after(4));
}

}  // namespace
}  // namespace scarp
