#include "apps/estimate/estimate.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <initializer_list>

#include "core/system/temporary_folder.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;

CostEstimate estimate(std::initializer_list<const char*> steps) {
  const TemporaryFolder folder;
  const fs::path file = folder / "recipe.toml";
  {
    std::ofstream out(file);
    out << "[domain]\nspacing = \"10 nm\"\nextent = [\"100 nm\", \"100 nm\"]\n"
           "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n";
    for (const char* step : steps) out << step;
  }
  return estimate_cost(read_recipe(recipe_in(file)));
}

CostEstimate estimate_of_width(int spacings) {
  return estimate_cost(read_text(fmt::format(
      "[domain]\nspacing = \"10 nm\"\nextent = [\"{0} nm\", \"{0} nm\"]\n"
      "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n[simplify]\nenabled = false\n"
      "[[step]]\nmodel = \"isotropic\"\nduration = \"400 s\"\netch_rate = \"1 nm/s\"\n",
      10 * spacings)));
}

// 640 x 640 columns are more than can be tried in seconds: half as many each way are.
TEST(Estimate, OfALargeGridIsThatOfACoarserOne) {
  const CostEstimate small = estimate_of_width(64);
  const CostEstimate large = estimate_of_width(640);
  const double area = 100;
  EXPECT_EQ(small.facets_full, 2U * 64 * 64);
  EXPECT_EQ(large.facets_full, 2U * 640 * 640);
  const auto nodes = [](const CostEstimate& cost) {
    return static_cast<double>(cost.active_nodes);
  };
  EXPECT_NEAR(nodes(large), area * nodes(small), 0.05 * nodes(large));
  EXPECT_NEAR(large.time_steps, small.time_steps, 0.05 * small.time_steps);
  EXPECT_NEAR(large.memory.mesh, area * small.memory.mesh, 0.05 * large.memory.mesh);
}

// 40 nm at 0.4 spacings of 10 nm.
constexpr const char* wet =
    "[[step]]\nmodel = \"isotropic\"\nduration = \"40 s\"\netch_rate = \"1 nm/s\"\n";
constexpr const char* gas =
    "[[step]]\nmodel = \"single_particle\"\nduration = \"40 s\"\netch_rate = \"1 nm/s\"\n";

TEST(Estimate, CountsTheTimeStepsOfAllSteps) {
  EXPECT_EQ(estimate({wet}).time_steps, 10);
  // Of ten moves 1, 2, 4 and 3 in a time step.
  EXPECT_EQ(estimate({wet, gas}).time_steps, 10 + 4);
}

// One of 4 s may be taken at a time, and an output every 3 s cuts each.
TEST(Estimate, CountsTimeStepsThatOutputsCutShort) {
  EXPECT_EQ(estimate({wet, "[output]\nevery = \"3 s\"\n"}).time_steps, 14);
}

// Under a beam the walls of a trench, of 60 nm with the resist, grow by 200 nm each: the surface
// from 220 nm to 620 nm. A growth that is off by a factor of two is as good as it gets.
TEST(Estimate, CountsTheRaysOfASurfaceThatGrows) {
  const std::string trench =
      "[[geometry]]\nshape = \"trench\"\nwidth = \"50 nm\"\ndepth = \"40 nm\"\n"
      "[[geometry]]\nshape = \"mask\"\nmaterial = \"resist\"\nthickness = \"20 nm\"\n"
      "opening = { shape = \"trench\", width = \"50 nm\" }\n"
      "[simplify]\nenabled = false\n[flux]\nrays = 100000\n[[step]]\n"
      "model = \"directional\"\ndirectional_etch_rate = { Si = \"1 nm/s\", resist = \"0 nm/s\" }\n";
  const auto rays = [&](const char* duration) {
    return estimate({(trench + "duration = \"" + duration + "\"\n").c_str()}).rays_per_time_step;
  };
  const double growth = rays("200 s") / rays("1 s") - 1;
  const double expected = 0.5 * (620.0 / 220 - 1);
  EXPECT_GT(growth, 0.5 * expected);
  EXPECT_LT(growth, 2 * expected);
}

// Planes that are all alike move as wet; kinks between others run faster than the surface.
TEST(Estimate, CountsTimeStepsByTheKinksOfRatesOfPlanes) {
  const std::string koh = "[[step]]\nmodel = \"koh_etch\"\nduration = \"40 s\"\n";
  const auto rates = [](const char* others) {
    std::string keys = "etch_rate_100 = \"1 nm/s\"\n";
    for (const std::string plane : {"110", "111", "311"})
      keys += "etch_rate_" + plane + " = \"" + others + "\"\n";
    return keys;
  };
  EXPECT_EQ(estimate({(koh + rates("1 nm/s")).c_str()}).time_steps, 10);
  // Between {100} at 1 nm/s and {311} at 0.1 nm/s the rate falls within 25 degrees.
  EXPECT_GT(estimate({(koh + rates("0.1 nm/s")).c_str()}).time_steps, 15);
}

TEST(Estimate, RaysAreTheMeanOverStepsOfAnyModel) {
  const double rays = estimate({gas}).rays_per_time_step;
  EXPECT_GT(rays, 0);
  EXPECT_EQ(estimate({wet}).rays_per_time_step, 0);
  EXPECT_DOUBLE_EQ(estimate({wet, gas}).rays_per_time_step, 4.0 / 14 * rays);
  EXPECT_DOUBLE_EQ(estimate({gas, wet}).rays_per_time_step, 4.0 / 14 * rays);
}

TEST(Estimate, RepeatedStepsCountEveryTime) {
  constexpr const char* inner =
      "[[step]]\nrepeat = 3\n[[step.step]]\nmodel = \"isotropic\"\nduration = \"40 s\"\n"
      "etch_rate = \"1 nm/s\"\n";
  EXPECT_EQ(estimate({inner}).time_steps, 30);
  EXPECT_FALSE(estimate({inner}).at_most);
}

// When the surface gets there nothing tells before the run.
TEST(Estimate, RoundsUntilAConditionHoldsAreCountedAtMost) {
  constexpr const char* inner =
      "[[step]]\nrepeat = 3\nuntil = { depth = \"50 nm\" }\n[[step.step]]\nmodel = "
      "\"isotropic\"\nduration = \"40 s\"\netch_rate = \"1 nm/s\"\n";
  const CostEstimate cost = estimate({inner});
  EXPECT_EQ(cost.time_steps, 30);
  EXPECT_TRUE(cost.at_most);
}

// A slot of 40 x 400 nm between walls of resist, as it is given and as a first step etches it.
constexpr const char* slot =
    "[[geometry]]\nshape = \"trench\"\nwidth = \"40 nm\"\ndepth = \"400 nm\"\n";
constexpr const char* slotted_resist =
    "[[geometry]]\nshape = \"mask\"\nmaterial = \"resist\"\nthickness = \"20 nm\"\n"
    "opening = { shape = \"trench\", width = \"40 nm\" }\n";
constexpr const char* etch_slot =
    "[[step]]\nmodel = \"isotropic\"\nduration = \"1 s\"\netch_rate = \"0 nm/s\"\n"
    "[[step]]\nmodel = \"directional\"\nduration = \"400 s\"\n"
    "directional_etch_rate = { Si = \"1 nm/s\", resist = \"0 nm/s\" }\n";
constexpr const char* coat =
    "[[step]]\nmodel = \"single_particle\"\nduration = \"10 s\"\nmaterial = \"SiO2\"\n"
    "growth_rate = \"1 nm/s\"\nsticking = 0.1\n[flux]\ntarget_error = 0.05\ncarry_within = 0.02\n";

double all_rays(const CostEstimate& cost) { return cost.rays_per_time_step * cost.time_steps; }

// Beams take rays as well, but not to an error. Means of four seeds: a trial has few rays.
TEST(Estimate, TriesAStepOnWhatEarlierOnesOpen) {
  double flat = 0;
  double given = 0;
  double etched = 0;
  for (const char* seed : {"seed = 1\n", "seed = 2\n", "seed = 3\n", "seed = 4\n"}) {
    flat += all_rays(estimate({slotted_resist, coat, seed}));
    given += all_rays(estimate({slotted_resist, slot, coat, seed}));
    etched += all_rays(estimate({slotted_resist, etch_slot, coat, seed})) -
              all_rays(estimate({slotted_resist, etch_slot}));
  }
  ASSERT_GT(given, 2.5 * flat);
  EXPECT_NEAR(etched, given, 0.5 * given);
}

// A law of 10 upright at the mean energy, whose kinks run 5.7 times as fast when it is largest at a
// slant, twice as fast as its fastest slope moves.
TEST(Estimate, TakesIonsAtTheirMeanEnergyAndKinksAtTheirSpeed) {
  const std::string ions =
      "[flux]\ncarry_within = 0\n[[step]]\nmodel = \"multi_particle\"\nduration = \"4 s\"\nrate = "
      "\"-1 nm/s * etch\"\n"
      "[[step.ion]]\nname = \"ion\"\nenergy = \"100 eV\"\nenergy_deviation = \"5 eV\"\n"
      "[[step.ion.yield]]\nname = \"etch\"\namplitude = 1\nangular = ";
  EXPECT_EQ(estimate({(ions + "\"cosine\"\n").c_str()}).time_steps, 10);
  EXPECT_EQ(estimate({(ions + "\"sputter\"\n").c_str()}).time_steps, 57);
}

// The trench is deeper by each cycle, and so is the surface on which the run goes ahead to the last
// one. Fluxes take 135 000 rays on average, by those of the first cycle it would be 17 000.
TEST(SlowEstimate, GoesAheadToTheLastCycleOfADeepTrench) {
  const CostEstimate cost = estimate_cost(
      read_recipe(recipe_in(fs::path(SCARP_SOURCE_DIR) / "configs/bosch_trench.toml")));
  EXPECT_GT(cost.rays_per_time_step, 135e3 / 2);
  EXPECT_LT(cost.rays_per_time_step, 135e3 * 2);
}

}  // namespace
}  // namespace scarp
