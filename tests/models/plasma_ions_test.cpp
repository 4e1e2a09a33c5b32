#include "models/plasma_ions.h"

#include <gtest/gtest.h>

#include <array>
#include <span>
#include <string>
#include <vector>

#include "core/material.h"
#include "core/recipe/recipe_table.h"

namespace scarp {
namespace {

const Parameter flux_row{.name = "ion.flux",
                         .dimension = Dimension::flux,
                         .limits = {.fallback = "1e16 /cm2/s", .minimum = 0, .maximum = 1e10},
                         .meaning = "flux of an open flat wafer",
                         .source = "probe"};

/// The ions of a step, after a neutral species and with two yields.
struct IonsOfStep {
  std::vector<Species> species{{.name = "gas", .sticking = {1}}};
  PlasmaIons ions;

  explicit IonsOfStep(const std::string& keys) {
    const RecipeFile file({"[[step]]\n" + keys, "r.toml"});
    const Materials materials;
    const std::vector<YieldLaw> yields{{.name = "etched"}, {.name = "sputtered"}};
    const RecipeTable step = file.root().tables("step")[0];
    ions = PlasmaIons(step, {materials, {materials.id("Si")}}, flux_row, yields, species);
    file.finish();
  }
};

TEST(PlasmaIons, OneIsASpeciesWithoutANumber) {
  const IonsOfStep step("[[step.ion]]\nflux = \"3e15 /cm2/s\"\n");
  ASSERT_EQ(step.species.size(), 2U);
  EXPECT_EQ(step.species[1].name, "ion");
  ASSERT_EQ(step.species[1].yields.size(), 2U);
  EXPECT_EQ(step.species[1].yields[1].name, "sputtered");
}

TEST(PlasmaIons, SeveralAreCountedTogetherByTheirFluxes) {
  const IonsOfStep step(
      "[[step.ion]]\nflux = \"3e15 /cm2/s\"\n[[step.ion]]\nflux = \"5e15 /cm2/s\"\n");
  ASSERT_EQ(step.species.size(), 3U);
  EXPECT_EQ(step.species[2].name, "ion_2");
  EXPECT_EQ(step.species[2].yields[0].name, "etched_2");
  // At two points: the gas, then arrivals and two yields of each ion. Noise below 0 counts as 0.
  const std::array<std::array<float, 2>, 7> tallies{
      {{9, 9}, {1, 0.5F}, {0, 2}, {0, 10}, {2, 1}, {0, -1}, {0, 100}}};
  const std::vector<std::span<const float>> flux(tallies.begin(), tallies.end());
  EXPECT_DOUBLE_EQ(step.ions.rate(flux, 0, 0), 3 * 1 + 5 * 2);
  EXPECT_DOUBLE_EQ(step.ions.rate(flux, 0, 1), 3 * 0.5 + 5 * 1);
  EXPECT_DOUBLE_EQ(step.ions.rate(flux, 1, 1), 3 * 2);
  EXPECT_DOUBLE_EQ(step.ions.rate(flux, 2, 1), 3 * 10 + 5 * 100);
}

}  // namespace
}  // namespace scarp
