#include "apps/simulator/simulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <map>
#include <numeric>
#include <thread>

#include "apps/run/run.h"
#include "apps/simulator/state_file.h"
#include "core/system/temporary_folder.h"

namespace scarp {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

namespace fs = std::filesystem;

const std::string narrow_trench = R"(
[domain]
spacing = "20 nm"
extent = ["600 nm"]
mode = "2d"
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "trench"
width = "240 nm"
depth = "300 nm"
)";

const std::string coating = narrow_trench + R"(
[output]
every = "20 s"
[[step]]
model = "single_particle"
material = "SiO2"
growth_rate = "1 nm/s"
sticking = 0.2
duration = "50 s"
)";

const std::string etching = narrow_trench + R"([[step]]
model = "isotropic"
etch_rate = "1 nm/s"
duration = "60 s"
)";

std::string hash_of_run(const std::string& recipe) {
  Simulation simulation({.text = recipe});
  simulation.run_to_end();
  return simulation.state_hash();
}

TEST(Simulation, IsTheRunOfTheSameRecipe) {
  const TemporaryFolder folder;
  const Recipe recipe = read_recipe({.text = coating});
  ASSERT_EQ(run(recipe, folder / "r", {}), RunEnd::complete);
  const State end = read_start_state(folder / "r" / "state_0003.vdb", recipe.materials);
  EXPECT_EQ(hash_of_run(coating), state_hash(end, recipe.materials));
}

// `./dev tsan` runs this one.
TEST(Simulation, AnyNumberRunAtOnceOnTheirOwnThreads) {
  const TemporaryFolder folder;
  const std::array alone{hash_of_run(coating), hash_of_run(etching)};
  const SimulationOptions own_thread{.threads = 1};
  std::array<std::string, 2> hashes;
  std::vector<Problem> problems;
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  {
    const std::jthread stops_and_goes_on([&] {
      Simulation stopped({.text = coating}, own_thread);
      stopped.run_to_end([](const Simulation& now) { return now.time_step() < 2; });
      stopped.save(folder / "state.vdb");
      Simulation resumed({.text = coating}, {.threads = 1, .resume_from = folder / "state.vdb"});
      resumed.run_to_end();
      hashes[0] = resumed.state_hash();
    });
    const std::jthread runs([&] {
      Simulation simulation({.text = etching}, own_thread);
      simulation.run_to_end();
      simulation.metrology();
      hashes[1] = simulation.state_hash();
    });
    const std::jthread is_wrong([&] {
      try {
        Simulation({.text = etching, .overrides = {"step[0].duration=\"1 nm\""}}, own_thread);
      } catch (const InputError& error) {
        problems = error.problems();
      }
    });
  }
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(hashes, alone);
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_EQ(problems[0].place, "--set step[0].duration=\"1 nm\": step[0].duration");
  EXPECT_NE(problems[0].what, "");
  EXPECT_NE(problems[0].remedy, "");
}

TEST(Simulation, DoesNotDependOnItsThreads) {
  testing::internal::CaptureStderr();
  for (const int threads : {1, 2, 1000}) {
    Simulation simulation({.text = coating}, {.threads = threads});
    simulation.run_to_end();
    EXPECT_EQ(simulation.state_hash(), hash_of_run(coating)) << threads;
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Simulation, GoesOnFromWhereItWasStopped) {
  const TemporaryFolder folder;
  const fs::path state = folder / "state.vdb";
  Simulation stopped({.text = coating});
  EXPECT_FALSE(stopped.run_to_end([](const Simulation& now) { return now.time_step() < 2; }));
  EXPECT_FALSE(stopped.is_finished());
  stopped.save(state);
  Simulation resumed({.text = coating}, {.resume_from = state});
  EXPECT_EQ(resumed.time(), stopped.time());
  EXPECT_TRUE(resumed.run_to_end());
  EXPECT_EQ(resumed.state_hash(), hash_of_run(coating));
  EXPECT_THROW(Simulation({.text = etching}, {.resume_from = state}), InputError);
}

TEST(Simulation, StopsAtTimesAndOutputs) {
  Simulation simulation({.text = coating});
  EXPECT_TRUE(simulation.run_to_next_output());
  EXPECT_EQ(simulation.time(), 20);
  EXPECT_TRUE(simulation.run_to(33));
  EXPECT_EQ(simulation.time(), 33);
  EXPECT_TRUE(simulation.run_to_next_output());
  EXPECT_EQ(simulation.time(), 40);
  EXPECT_TRUE(simulation.run_to_next_output());
  EXPECT_EQ(simulation.time(), 50);
  EXPECT_TRUE(simulation.is_finished());
  EXPECT_TRUE(simulation.run_to_end());
  EXPECT_THROW(simulation.run_to(std::numeric_limits<double>::quiet_NaN()), InputError);
}

TEST(Simulation, TheEndOfAStepIsAnOutput) {
  Simulation simulation({.text = etching +
                                 "[[step]]\nmodel = \"isotropic\"\netch_rate = \"1 nm/s\"\n"
                                 "duration = \"10 s\"\n"});
  EXPECT_TRUE(simulation.run_to_next_output());
  EXPECT_EQ(simulation.time(), 60);
  EXPECT_EQ(simulation.step(), 1U);
  EXPECT_TRUE(simulation.run_to_next_output());
  EXPECT_EQ(simulation.time(), 70);
}

TEST(Simulation, SaysWhatIsWrongAsData) {
  const std::string wrong = coating + "temprature = \"300 K\"\n";
  try {
    const Simulation simulation({.text = wrong, .overrides = {"domain.spacing=\"-1 nm\""}});
    FAIL();
  } catch (const InputError& error) {
    ASSERT_EQ(error.problems().size(), 2U);
    const Problem& key = error.problems()[0];
    EXPECT_EQ(key.place, "recipe.toml:22:1: step[0].temprature");
    EXPECT_EQ(key.what, "unknown key");
    EXPECT_THAT(key.remedy, HasSubstr("known here: "));
    EXPECT_EQ(error.problems()[1].place, "--set domain.spacing=\"-1 nm\": domain.spacing");
    EXPECT_EQ(error.what(), key.text() + '\n' + error.problems()[1].text());
  }
}

TEST(Simulation, FilesOfARecipeMayBeInMemory) {
  const std::string lobe = coating + "source_table = \"lobe.csv\"\n";
  std::vector<std::string> asked;
  const RecipeSource source{.text = lobe, .load_file = [&](const std::string& name) {
                              asked.push_back(name);
                              return "angle [deg],density\n0,1\n60,1\n90,0\n";
                            }};
  Simulation simulation(source);
  EXPECT_THAT(asked, ElementsAre("lobe.csv"));
  // With the table in it the resolved recipe needs no file.
  EXPECT_EQ(Simulation({.text = simulation.resolved()}).resolved(), simulation.resolved());
}

TEST(Simulation, StartsFromAnotherOneAsFromItsFile) {
  const TemporaryFolder folder;
  Simulation first({.text = coating});
  first.run_to_end();
  first.save(folder / "first.vdb");
  const std::string next = R"(start = "first.vdb"
[domain]
spacing = "20 nm"
extent = ["600 nm"]
mode = "2d"
[[step]]
model = "isotropic"
etch_rate = "1 nm/s"
duration = "10 s"
)";
  Simulation in_memory({.text = next}, {.start = &first});
  Simulation from_file({.text = next, .folder = folder});
  EXPECT_EQ(in_memory.time(), 50);
  in_memory.run_to_end();
  from_file.run_to_end();
  EXPECT_EQ(in_memory.state_hash(), from_file.state_hash());
  EXPECT_THROW(Simulation({.text = next}), InputError);
}

TEST(Simulation, ShowsTheWholeWafer) {
  const std::string part = R"(
[domain]
spacing = "20 nm"
extent = ["400 nm", "400 nm"]
symmetry = "auto"
[[geometry]]
shape = "wafer"
material = "Si"
[[step]]
model = "single_particle"
material = "SiO2"
growth_rate = "2 nm/s"
sticking = 1
duration = "10 s"
)";
  Simulation simulation({.text = part});
  ASSERT_GT(simulation.state().layers.frame.images(), 1);
  simulation.run_to_end();
  const Surface& surface = simulation.surface();
  ASSERT_EQ(surface.fluxes.size(), 1U);
  ASSERT_EQ(surface.speeds.size(), surface.mesh.triangles.size());
  const std::vector<double> areas = facet_areas(surface.mesh);
  EXPECT_NEAR(std::accumulate(areas.begin(), areas.end(), 0.0), 400 * 400, 160);
  EXPECT_THAT(surface.speeds, testing::Each(testing::FloatNear(2, 0.05F)));
  const std::vector<std::string> materials = simulation.materials();
  for (const MaterialId each : surface.mesh.materials) EXPECT_EQ(materials[each], "SiO2");

  const std::vector<LevelSetValues> levels = simulation.level_sets();
  ASSERT_EQ(levels.size(), 2U);
  EXPECT_EQ(levels[1].material, "SiO2");
  const auto& [nx, ny, nz] = levels[1].counts;
  EXPECT_EQ(nx, 21);
  ASSERT_EQ(levels[1].phi.size(), static_cast<std::size_t>(nx) * ny * nz);
  EXPECT_NEAR(levels[1].origin.x, -200, 1e-9);
  for (int k = 0; k < nz; ++k) {
    const double z = levels[1].origin.z + k * levels[1].spacing;
    EXPECT_NEAR(levels[1].phi[static_cast<std::size_t>(k) * nx * ny],
                std::clamp(z - 20, -80.0, 80.0), 0.5)
        << z;
  }
  const std::vector<SectionOutline> section = simulation.section("x = 0 nm");
  ASSERT_EQ(section.size(), 2U);
  EXPECT_NEAR(section[1].lines.at(0).points.front()[1], 20, 0.5);
  EXPECT_NEAR(simulation.metrology().highest, 20, 0.5);
  EXPECT_THROW(simulation.section("z = 0 nm"), InputError);
}

// The two trenches on the right merge first. Numbered anew, by place, the left one would come
// first.
TEST(Simulation, OpeningsKeepTheirNumbersInASavedState) {
  std::string four_trenches = R"(
[domain]
spacing = "20 nm"
extent = ["1.6 um"]
mode = "2d"
[[geometry]]
shape = "wafer"
material = "Si"
[[step]]
model = "isotropic"
duration = "45 s"
etch_rate = "2 nm/s"
[output]
every = "5 s"
)";
  for (const char* center : {"-500", "-220", "220", "440"})
    four_trenches += std::string("[[geometry]]\nshape = \"trench\"\nwidth = \"160 nm\"\n") +
                     "depth = \"300 nm\"\ncenter = \"" + center + " nm\"\n";
  const auto places_at = [](Simulation& simulation, double until) {
    std::map<int, double> places;
    while (simulation.time() < until) {
      simulation.run_to_next_output();
      places.clear();
      for (const OpeningMetrology& each : simulation.metrology().openings)
        places[each.opening] = each.centre[0];
    }
    return places;
  };
  Simulation whole({.text = four_trenches});
  const std::map<int, double> at_end = places_at(whole, 45);
  EXPECT_THAT(at_end, ElementsAre(Pair(4, DoubleNear(330, 20)), Pair(5, DoubleNear(-360, 20))));

  const TemporaryFolder folder;
  Simulation first({.text = four_trenches});
  EXPECT_EQ(places_at(first, 40).size(), 2U);
  first.save(folder / "state.vdb");
  Simulation second({.text = four_trenches}, {.resume_from = folder / "state.vdb"});
  EXPECT_EQ(places_at(second, 45), at_end);
}

}  // namespace
}  // namespace scarp
