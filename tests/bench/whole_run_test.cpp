#include "tests/bench/whole_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "levelset/surface/extract_surface.h"
#include "tests/apps/final_state.h"
#include "tests/apps/recipe_text.h"

namespace scarp::bench {
namespace {

Recipe liner(const std::string& symmetry) {
  return read_text(R"([simplify]
enabled = false
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "hole"
radius = "40 nm"
depth = "60 nm"
[[step]]
model = "single_particle"
duration = "10 s"
material = "SiO2"
growth_rate = "1 nm/s"
sticking = 0.5
[domain]
spacing = "10 nm"
extent = ["160 nm", "160 nm"]
symmetry = ")" + symmetry +
                   "\"\n");
}

TEST(RunToEnd, LeavesTheSurfaceOfTheFinalState) {
  const Recipe recipe = liner("none");

  const WholeRun run = run_to_end(recipe);

  const State state = final_state(recipe);
  EXPECT_EQ(run.surface.vertices, extract_surface(state.layers).vertices);
  EXPECT_EQ(run.time_steps, state.time_step);
}

TEST(RunToEnd, StagesTakeAllOfTheTime) {
  const WholeRun run = run_to_end(liner("none"));

  double sum = 0;
  for (const auto& [stage, seconds] : run.stages.stages()) sum += seconds;
  EXPECT_NEAR(sum, run.cpu_seconds, 1e-9);
  EXPECT_GT(run.stages.seconds("flux"), 0);
}

TEST(RunToEnd, AnEighthLeavesTheWholeWafer) {
  const WholeRun whole = run_to_end(liner("none"));
  const WholeRun part = run_to_end(liner("auto"));

  EXPECT_LT(part.facets, 0.2 * whole.facets);
  EXPECT_LT(distance_between(part.surface, whole.surface, 10), 0.05);
}

}  // namespace
}  // namespace scarp::bench
