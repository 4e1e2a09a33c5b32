#include "tests/bench/time_step.h"

#include <algorithm>
#include <limits>

#include "apps/simulator/simulator.h"
#include "tests/bench/cpu_time.h"

namespace scarp::bench {

namespace {

Recipe trench(const std::vector<std::string>& overrides) {
  return read_recipe(recipe_in(SCARP_SOURCE_DIR "/configs/trench_deposition.toml", overrides));
}

void go_on(State& state, const Recipe& recipe, StageTimer& stages) {
  begin_step(state, recipe.steps);
  const Survey seen = survey(state, recipe);
  const Move move = advance(state, recipe, seen, std::numeric_limits<double>::infinity());
  stages.add(seen.timer);
  stages.add(move.timer);
}

}  // namespace

double first_time_step(const std::vector<std::string>& overrides, int repeats) {
  const Recipe recipe = trench(overrides);
  double least = std::numeric_limits<double>::infinity();
  for (int repeat = 0; repeat < repeats; ++repeat) {
    State state = start_state(recipe.domain.frame, recipe.start);
    StageTimer stages;
    least = std::min(least, cpu_seconds_of([&] { go_on(state, recipe, stages); }));
  }
  return least;
}

double flux_share_of_run() {
  const Recipe recipe = trench({});
  State state = start_state(recipe.domain.frame, recipe.start);
  StageTimer stages;
  while (!finished(state, recipe.steps)) go_on(state, recipe, stages);
  double all = 0;
  for (const auto& [stage, seconds] : stages.stages()) all += seconds;
  return stages.seconds("flux") / all;
}

}  // namespace scarp::bench
