#include "tests/bench/time_step.h"

#include <algorithm>
#include <limits>

#include "apps/simulator.h"
#include "tests/bench/cpu_time.h"

namespace scarp::bench {

TimeStep first_time_step(const std::vector<std::string>& overrides, int repeats) {
  const Recipe recipe = read_recipe(SCARP_SOURCE_DIR "/configs/trench_deposition.toml", overrides);
  TimeStep least;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    State state = start_state(recipe);
    begin_step(state, recipe);
    StageTimer stages;
    const double cpu = cpu_seconds_of([&] {
      const Survey seen = survey(state, recipe);
      const Move move = advance(state, recipe, seen, std::numeric_limits<double>::infinity());
      stages.add(seen.timer);
      stages.add(move.timer);
    });
    double all = 0;
    for (const auto& [stage, seconds] : stages.stages()) all += seconds;
    least.cpu = std::min(least.cpu, cpu);
    least.flux_share = std::min(least.flux_share, stages.seconds("flux") / all);
  }
  return least;
}

}  // namespace scarp::bench
