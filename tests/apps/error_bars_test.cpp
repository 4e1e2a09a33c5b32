// Stated errors of fluxes as a run has them: on the hole of a recipe, of neutrals whose sticking
// follows from what arrives.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/simulator/simulator.h"
#include "flux/rays/patches.h"
#include "flux/rays/ray_scene.h"
#include "tests/flux/calibration.h"

namespace scarp {
namespace {

using exact::Stated;

Recipe hole_with_seed(std::uint64_t seed) {
  return read_recipe(recipe_in(std::filesystem::path(SCARP_SOURCE_DIR) / "configs/sf6_o2_hole.toml",
                               {"flux.seed=" + std::to_string(seed)}));
}

// Of patches that do not face up to the source alone.
enum Place : std::size_t { top, middle, bottom, place_count };

std::array<std::vector<std::size_t>, place_count> places_of(const Survey& now,
                                                            const Recipe& recipe) {
  const RayScene scene(now.facets, recipe.domain.frame.sides(), recipe.domain.frame.spacing);
  const Patches patches(now.facets, scene);
  std::array<std::vector<std::size_t>, place_count> places;
  for (std::size_t p = 0; p < patches.list().size(); ++p) {
    double height = 0;
    double up = 0;
    for (const std::uint32_t f : patches.list()[p].facets) {
      const auto& [a, b, c] = scene.corners(f);
      height += scene.area(f) / patches.list()[p].area * (Vec3d(a).z + Vec3d(b).z + Vec3d(c).z) / 3;
      up += scene.area(f) / patches.list()[p].area * scene.normal(f).z;
    }
    const double at = (height - scene.lowest()) / (scene.source_height() - scene.lowest());
    if (up > 0.7 && at > 0.5) continue;
    places[at > 2.0 / 3 ? top : at > 1.0 / 3 ? middle : bottom].push_back(p);
  }
  return places;
}

void expect_near_one(const exact::Calibration& c, const std::string& what) {
  EXPECT_LT(c.deviation_error, 0.06) << what;
  EXPECT_GT(c.deviation + 2 * c.deviation_error, 0.9) << what;
  EXPECT_LT(c.deviation - 2 * c.deviation_error, 1.1) << what;
}

TEST(SlowErrorBarsOfRuns, AreTrueInAHoleWhoseWallsAreCovered) {
  Recipe recipe = hole_with_seed(1);
  State state = start_state(recipe.domain.frame, recipe.start);
  begin_step(state, recipe.steps);
  std::array<std::vector<Stated>, 2> on_patches;  // of fluorine and oxygen
  std::array<std::vector<Stated>, 2> of_balance;
  std::array<std::vector<std::size_t>, place_count> places;
  for (std::uint64_t seed = 1; seed <= 250; ++seed) {
    recipe = hole_with_seed(seed);
    const Survey now = survey(state, recipe);
    if (seed == 1) places = places_of(now, recipe);
    for (std::size_t k = 0; k < on_patches.size(); ++k) {
      ASSERT_EQ(now.flux[k].engine, FluxEngine::gather);
      on_patches[k].push_back(exact::on_patches(now.flux[k].arrivals()));
      const FluxAudit& audit = now.flux[k].audit;
      of_balance[k].push_back({{audit.balance_error()}, {audit.balance_std_error}});
    }
  }
  for (std::size_t k = 0; k < on_patches.size(); ++k) {
    for (std::size_t place = 0; place < place_count; ++place) {
      ASSERT_GT(places[place].size(), 20U);
      std::vector<Stated> runs;
      for (const Stated& run : on_patches[k]) runs.push_back(at_places(run, places[place]));
      expect_near_one(exact::calibration_of(runs),
                      "species " + std::to_string(k) + ", place " + std::to_string(place));
    }
    expect_near_one(exact::calibration_of(of_balance[k], {0}), "balance " + std::to_string(k));
  }
}

}  // namespace
}  // namespace scarp
