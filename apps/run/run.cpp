#include "apps/run/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "apps/estimate/estimate.h"
#include "apps/estimate/memory_estimate.h"
#include "apps/run/observer.h"
#include "apps/run/results.h"
#include "apps/run/watchdog.h"
#include "apps/simulator/flux_target.h"
#include "apps/simulator/region_text.h"
#include "apps/simulator/simulation.h"
#include "apps/simulator/symmetry.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/quantity.h"
#include "core/system/peak_memory.h"

namespace scarp {

namespace {

// A state that cannot go on is still good: it is brought to the disk before the run ends.
void survey_or_save(Simulation& simulation, ResultFolder& folder, Watchdog& watchdog) {
  const State& state = simulation.state();
  try {
    watchdog.look_at(state, simulation.survey());
  } catch (const NumericalError& error) {
    folder.write_checkpoint(state);
    throw NumericalError(
        fmt::format("{}; last good state: {}", error.what(), shown(folder.last_checkpoint())));
  } catch (const InputError& error) {
    // What the recipe asks for was possible before, on a smaller surface.
    folder.write_checkpoint(state);
    const std::filesystem::path& file = folder.last_checkpoint();
    throw NumericalError(fmt::format(
        "time step {} of step \"{}\", t = {:g} s: {}; last good state: {}, for a recipe with "
        "start = \"{}\"",
        state.time_step, simulation.step_name(), state.time, error.what(), shown(file),
        shown(std::filesystem::absolute(file).lexically_normal())));
  }
}

void require_held_memory(double limit) {
  const double held = peak_memory_mb();
  if (held <= limit) return;
  throw InputError(fmt::format("the run holds {:.3g} MB of memory, {}; {}", held,
                               memory_limit_text(limit), memory_remedy));
}

// A trial goes ahead on a coarser grid: what it meets there is no reason to end the run.
std::optional<CostEstimate> estimate_if_possible(const Simulation& begun) {
  try {
    return estimate_cost(begun.recipe());
  } catch (const NumericalError&) {
    return std::nullopt;
  }
}

// Before the surface is made. How the surface grows and how many rays a target takes is asked where
// what is known before comes near the limit: that takes seconds, and as much memory.
void require_memory(const Simulation& begun, double limit) {
  constexpr double near = 0.25;
  const Layers& layers = begun.state().layers;
  const std::vector<ProcessStep>& steps = begun.recipe().steps;
  const RunSize size =
      size_from_grid(layers, steps, begun.recipe().simplification, begun.recipe().flux.options);
  const MemoryEstimate at_least = expected_memory(layers, steps, size);
  require_memory(at_least, limit);
  if (at_least.total() <= near * limit) return;
  if (const auto cost = estimate_if_possible(begun)) require_memory(cost->memory, limit);
}

// In place of the end that the kernel makes.
void require_memory_or_save(const Simulation& simulation, double limit, ResultFolder& folder) {
  const double held = peak_memory_mb();
  if (held <= limit || simulation.is_finished()) return;
  folder.write_checkpoint(simulation.state());
  throw NumericalError(
      fmt::format("time step {} of step \"{}\", t = {:g} s: the run holds {:.0f} MB of memory, {}; "
                  "raise it and continue with --resume; last good state: {}",
                  simulation.time_step(), simulation.step_name(), simulation.time(), held,
                  memory_limit_text(limit), shown(folder.last_checkpoint())));
}

// Advection may stop half-way; the state before it is then the last checkpoint.
Move advance_or_tell(Simulation& simulation, double time_limit, const ResultFolder& folder) {
  const std::string where =
      fmt::format("time step {} of step \"{}\", t = {:g} s", simulation.time_step(),
                  simulation.step_name(), simulation.time());
  try {
    return simulation.advance(time_limit);
  } catch (const NumericalError& error) {
    throw NumericalError(fmt::format("{}: {}; last good state: {}", where, error.what(),
                                     shown(folder.last_checkpoint())));
  }
}

// The estimate takes seconds: it is made where the pace of the first time step makes a hundredth of
// what it is to warn of.
void warn_of_expensive_flux(const Simulation& begun, const Log& log) {
  const Recipe& recipe = begun.recipe();
  constexpr double doubtful = 0.01;
  double pace = 0;
  for (const char* const stage : {"surface", "simplify", "flux", "map"})
    pace += begun.last_survey().timer.seconds(stage);
  double count = 0;
  for (const ProcessStep& step : recipe.steps)
    count += time_steps(step, step.duration, recipe.longest_move(), recipe.materials.size());
  if (pace * count < doubtful * recipe.flux.warn_above) return;
  const auto cost = estimate_if_possible(begun);
  const auto warning = cost ? expensive_flux_warning(*cost, recipe.flux) : std::nullopt;
  if (warning) log.warn(*warning);
}

// What the results are worth is said last.
void tell_flux_error(const FluxTarget& flux, const Log& log) {
  const WantedError& wanted = flux.wanted;
  const char* const of = wanted.in_position ? "position" : "flux";
  if (flux.missed > 0) {
    log.warn(fmt::format("{}, {}, was missed in {} of {}: the error of the {} is {} at worst",
                         wanted.key(), wanted.text(wanted.value), flux.missed,
                         counted(flux.time_steps, "time step"), of, wanted.text(flux.largest)));
  } else if (flux.largest > 0) {
    log.info(fmt::format(
        "the error of the {} is at most {}{}", of, wanted.text(flux.largest),
        wanted.value > 0 ? fmt::format(" ({} {})", wanted.key(), wanted.text(wanted.value)) : ""));
  }
}

void tell_left_out(const LeftOutCount& count, const Log& log) {
  if (count.sum() == 0) return;
  log.info(fmt::format("simplification was skipped in {} of {}", count.sum(),
                       counted(count.time_steps, "time step")));
}

// When checkpoints between outputs are due.
class CheckpointClock {
 public:
  explicit CheckpointClock(const Outputs& outputs) : outputs_(outputs) {}

  bool is_due(const State& state) const {
    const std::chrono::duration<double> since = Clock::now() - last_;
    return since.count() >= outputs_.checkpoint_wall_time || intervals(state) > intervals_;
  }

  void note_checkpoint(const State& state) {
    last_ = Clock::now();
    intervals_ = intervals(state);
  }

 private:
  using Clock = std::chrono::steady_clock;

  // Of process time, so far.
  double intervals(const State& state) const {
    if (outputs_.checkpoint_every <= 0) return 0;
    return std::floor(state.time / outputs_.checkpoint_every * (1 + 1e-12));
  }

  const Outputs& outputs_;
  Clock::time_point last_ = Clock::now();
  double intervals_ = 0;
};

/// What a run that is complete reports at its end.
void tell_end(const RunTotals& totals, std::span<const std::string> losses, const Log& log) {
  for (const std::string& loss : losses) log.warn(loss);
  tell_left_out(totals.left_out, log);
  tell_flux_error(totals.flux, log);
}

}  // namespace

RunEnd run(Recipe given, const std::filesystem::path& path, const RunOptions& options) {
  const Log& log = options.log;
  if (const auto losses = options.resume ? losses_of_complete_run(path, given) : std::nullopt) {
    for (const std::string& loss : *losses) log.warn(loss);
    return RunEnd::was_complete;
  }
  require_memory(least_memory(given), options.memory_limit_mb, "at least");
  const FoundPlanes found = given.domain.uses_symmetry ? mirror_planes(given) : FoundPlanes{};
  const Recipe recipe = on_part(std::move(given), found);
  ResultFolder folder(path, recipe);
  for (const std::string& warning : recipe.warnings) log.warn(warning);
  const auto start = std::chrono::steady_clock::now();

  std::optional<State> resumed;
  if (options.resume) resumed = folder.resume(log);
  const bool begins = !resumed;
  Simulation simulation(recipe, std::move(resumed));
  const State& state = simulation.state();
  const Survey& now = simulation.last_survey();
  StageTimer total;
  Observer observer(recipe, log);
  Watchdog watchdog(recipe.steps, recipe.materials, recipe.domain.frame.spacing, log);
  CheckpointClock checkpoints(recipe.outputs);

  if (begins) {
    require_memory(simulation, options.memory_limit_mb);
    watchdog.look_at(state, simulation.survey());
  } else {
    survey_or_save(simulation, folder, watchdog);
  }
  require_held_memory(options.memory_limit_mb);
  // On large surfaces this takes a while.
  if (begins) warn_of_expensive_flux(simulation, log);
  if (options.begin) options.begin();
  // An earlier run is not given up before this one is known to work.
  if (begins) {
    folder.start(log);
    observer.tell_loose_shapes(state);
    if (recipe.domain.uses_symmetry) log.info("this recipe " + symmetry_text(recipe.domain, found));
  }
  total.add(now.timer);
  observer.look_at(state, now, simulation.void_changes());
  if (begins) folder.write_output(state, now);
  checkpoints.note_checkpoint(state);

  const auto is_asked_to_stop = [&] { return options.stop != nullptr && *options.stop; };
  bool stop = is_asked_to_stop();
  while (!simulation.is_finished() && !stop) {
    const std::size_t step = state.step;
    const double output_time = next_output(state, recipe.outputs.every);
    const Move move = advance_or_tell(simulation, output_time, folder);
    observer.look_at(state, move, step);
    watchdog.note(now, move, step);
    folder.append_metrics(state, step, now, move);
    total.add(move.timer);
    if (options.progress) options.progress(state, now);

    const bool is_output = state.time >= output_time || state.step != step;
    // The next survey may take long; an output cannot do without.
    if (is_asked_to_stop() && !is_output) {
      folder.write_checkpoint(state);
      break;
    }
    survey_or_save(simulation, folder, watchdog);
    total.add(now.timer);
    observer.look_at(state, now, simulation.void_changes());
    require_memory_or_save(simulation, options.memory_limit_mb, folder);
    stop = is_asked_to_stop();
    const bool asked = options.checkpoint != nullptr && options.checkpoint->exchange(false);
    if (is_output || stop || asked || checkpoints.is_due(state)) {
      is_output ? folder.write_output(state, now) : folder.write_checkpoint(state);
      checkpoints.note_checkpoint(state);
    }
  }
  watchdog.sum_up();
  if (!simulation.is_finished()) return RunEnd::interrupted;
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  const RunTotals totals = folder.write_summary(state, now, total, wall.count());
  const auto losses = losses_of_complete_run(path, recipe);
  tell_end(totals, losses ? *losses : std::vector<std::string>(), log);
  return RunEnd::complete;
}

}  // namespace scarp
