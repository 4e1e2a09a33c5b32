#include "apps/run.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "apps/results.h"
#include "core/error.h"

namespace scarp {

namespace {

// The next moment at which results are wanted: a multiple of the interval, after the given time.
double next_output(double time, double every) {
  if (every <= 0) return 1e300;
  const double passed = std::floor(time / every * (1 + 1e-12));
  return (passed + 1) * every;
}

struct Moment {
  double time;
  std::size_t step;
};

}  // namespace

RunEnd run(const Recipe& recipe, const std::filesystem::path& path, const RunOptions& options) {
  ResultFolder folder(path);
  if (options.resume && folder.complete(recipe)) return RunEnd::was_complete;
  const auto start = std::chrono::steady_clock::now();

  std::optional<State> resumed;
  if (options.resume) resumed = folder.resume(recipe);
  if (!resumed) folder.start(recipe);
  State state = resumed ? std::move(*resumed) : start_state(recipe);
  StageTimer total;

  begin_step(state, recipe);
  Survey now = survey(state, recipe);
  total.add(now.timer);
  if (!resumed) folder.write_output(state, now, recipe);

  while (!finished(state, recipe)) {
    const Moment before{state.time, state.step};
    const double output_time = next_output(state.time, recipe.output_every);
    const Move move = advance(state, recipe, now, output_time);
    folder.append_metrics(state, before.step, now, move, recipe);
    total.add(move.timer);
    if (options.progress) options.progress(state, now);

    if (!finished(state, recipe)) begin_step(state, recipe);
    now = survey(state, recipe);
    total.add(now.timer);
    if (state.time >= output_time || state.step != before.step) {
      folder.write_output(state, now, recipe);
    } else if (options.stop != nullptr && *options.stop) {
      folder.write_checkpoint(state, recipe);
      return RunEnd::interrupted;
    }
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  folder.write_summary(state, now, recipe, total, wall.count());
  return RunEnd::complete;
}

}  // namespace scarp
