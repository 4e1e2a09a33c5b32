#include "apps/run/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>
#include <span>
#include <string>
#include <utility>

#include "apps/estimate/estimate.h"
#include "apps/estimate/memory_estimate.h"
#include "apps/run/results.h"
#include "apps/run/watchdog.h"
#include "apps/simulator/flux_target.h"
#include "apps/simulator/region_text.h"
#include "apps/simulator/surface_speeds.h"
#include "apps/simulator/symmetry.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/quantity.h"
#include "core/system/peak_memory.h"

namespace scarp {

namespace {

Survey watched_survey(const State& state, const Recipe& recipe, Watchdog& watchdog) {
  Survey now = survey(state, recipe);
  watchdog.look_at(state, now);
  return now;
}

// A state that cannot go on is still good: it is brought to the disk before the run ends.
Survey survey_or_save(const State& state, const Recipe& recipe, ResultFolder& folder,
                      Watchdog& watchdog) {
  try {
    return watched_survey(state, recipe, watchdog);
  } catch (const NumericalError& error) {
    folder.write_checkpoint(state, recipe);
    throw NumericalError(
        fmt::format("{}; last good state: {}", error.what(), shown(folder.last_checkpoint())));
  } catch (const InputError& error) {
    // What the recipe asks for was possible before, on a smaller surface.
    folder.write_checkpoint(state, recipe);
    const std::filesystem::path& file = folder.last_checkpoint();
    throw NumericalError(fmt::format(
        "time step {} of step \"{}\", t = {:g} s: {}; last good state: {}, for a recipe with "
        "start = \"{}\"",
        state.time_step, current_step(state, recipe).name, state.time, error.what(), shown(file),
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
std::optional<CostEstimate> estimate_if_possible(const Recipe& recipe) {
  try {
    return estimate_cost(recipe);
  } catch (const NumericalError&) {
    return std::nullopt;
  }
}

// Before the surface is made. How the surface grows and how many rays a target takes is asked where
// what is known before comes near the limit: that takes seconds, and as much memory.
void require_memory(const State& start, const Recipe& recipe, double limit) {
  constexpr double near = 0.25;
  const MemoryEstimate at_least =
      expected_memory(start.layers, recipe, size_from_grid(start.layers, recipe));
  require_memory(at_least, limit);
  if (at_least.total() <= near * limit) return;
  if (const auto cost = estimate_if_possible(recipe)) require_memory(cost->memory, limit);
}

// In place of the end that the kernel makes.
void require_memory_or_save(const State& state, const Recipe& recipe, double limit,
                            ResultFolder& folder) {
  const double held = peak_memory_mb();
  if (held <= limit || finished(state, recipe)) return;
  folder.write_checkpoint(state, recipe);
  throw NumericalError(
      fmt::format("time step {} of step \"{}\", t = {:g} s: the run holds {:.0f} MB of memory, {}; "
                  "raise it and go on with --resume; last good state: {}",
                  state.time_step, current_step(state, recipe).name, state.time, held,
                  memory_limit_text(limit), shown(folder.last_checkpoint())));
}

// Advection may stop half-way; the state before it is then the last checkpoint.
Move advance_or_tell(State& state, const Recipe& recipe, const Survey& now, double time_limit,
                     const ResultFolder& folder) {
  try {
    return advance(state, recipe, now, time_limit);
  } catch (const NumericalError& error) {
    throw NumericalError(
        fmt::format("time step {} of step \"{}\", t = {:g} s: {}; last good state: {}",
                    state.time_step, current_step(state, recipe).name, state.time, error.what(),
                    shown(folder.last_checkpoint())));
  }
}

// The estimate takes seconds: it is made where the pace of the first time step makes a hundredth of
// what it is to warn of.
void warn_of_dear_flux(const Recipe& recipe, const Survey& first, const Log& log) {
  constexpr double doubtful = 0.01;
  double pace = 0;
  for (const char* const stage : {"surface", "simplify", "flux", "map"})
    pace += first.timer.seconds(stage);
  double count = 0;
  for (const ProcessStep& step : recipe.steps) count += time_steps(step, step.duration, recipe);
  if (pace * count < doubtful * recipe.dear_flux) return;
  const auto cost = estimate_if_possible(recipe);
  const auto warning = cost ? dear_flux_warning(*cost, recipe) : std::nullopt;
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
  log.info(fmt::format("simplification was left out of {} of {}", count.sum(),
                       counted(count.time_steps, "time step")));
}

// When checkpoints between outputs are due.
class CheckpointClock {
 public:
  explicit CheckpointClock(const Recipe& recipe) : recipe_(recipe) {}

  bool is_due(const State& state) const {
    const std::chrono::duration<double> since = Clock::now() - last_;
    return since.count() >= recipe_.checkpoint_wall_time || intervals(state) > intervals_;
  }

  void note_checkpoint(const State& state) {
    last_ = Clock::now();
    intervals_ = intervals(state);
  }

 private:
  using Clock = std::chrono::steady_clock;

  // Of process time, so far.
  double intervals(const State& state) const {
    if (recipe_.checkpoint_every <= 0) return 0;
    return std::floor(state.time / recipe_.checkpoint_every * (1 + 1e-12));
  }

  const Recipe& recipe_;
  Clock::time_point last_ = Clock::now();
  double intervals_ = 0;
};

void warn_of_loose_shapes(const State& start, const Recipe& recipe, const Log& log) {
  const std::string text = loose_solid_text(recipe.frame, start.islands);
  if (!text.empty()) log.warn(text);
}

std::string necks_left_out_text(const ProcessStep& step, const NecksLeftOut& left_out) {
  return fmt::format(
      "step \"{}\": necks are not looked for among {:.2g} nodes below overhangs, from z = {:.4g} "
      "to "
      "{:.4g} nm: behind a neck narrower than twice the thickness the film goes on after it is "
      "shut; choose a larger domain.spacing or a smaller domain",
      step.name, static_cast<double>(left_out.node_count), left_out.lowest, left_out.highest);
}

// Tells what a user would want to know at once, and each of it once per step of the recipe.
class Observer {
 public:
  Observer(const Recipe& recipe, Log log) : recipe_(recipe), log_(std::move(log)) {}

  void look_at(const State& state, const Survey& now, const VoidChanges& changes) {
    tell_left_out(state, now);
    tell_missed_targets(state, now);
    tell_unfit_coverages(state, now);
    tell_voids(state, now, changes);
    note_movement(state, now);
  }

  void look_at(const State& state, const Move& move, std::size_t step) {
    if (move.necks_left_out.node_count > 0)
      log_.warn(necks_left_out_text(recipe_.steps[step], move.necks_left_out));
    if (state.step != step) {
      tell_end(recipe_.steps[step], state, step);
      tell_standstill(recipe_.steps[step]);
      tell_rounds(recipe_.steps[step], state, step);
    }
    if (move.islands.empty()) return;
    log_.info(fmt::format("t = {:.4g} s: {} of solid cut off from the wafer, removed", state.time,
                          counted(count_of(move.islands), "piece")));
    tell(move.islands);
  }

 private:
  void tell_end(const ProcessStep& step, const State& state, std::size_t number) {
    if (!step.until) return;
    const StepEnd& end = state.ends[number];
    const double start = number > 0 ? state.ends[number - 1].time : state.origin.time;
    const std::string wanted = text_of(*step.until, recipe_.materials, recipe_.frame);
    if (end.out_of_time) {
      log_.warn(fmt::format(
          "step \"{}\" ended at t = {:.6g} s by its duration of {}, before {}{}; raise its "
          "duration",
          step.name, end.time, format_quantity(step.duration, Dimension::time), wanted,
          end.reached ? fmt::format(" (at {:.6g} s){}", *end.reached, over_etch_text(*step.until))
                      : ""));
    } else if (end.time == start) {
      log_.warn(fmt::format("step \"{}\" took no time: {} when it began, at t = {:.6g} s",
                            step.name, wanted, end.time));
    } else {
      const std::string rest = over_etch_text(*step.until);
      log_.info(fmt::format("step \"{}\" ended at t = {:.6g} s: {}{}", step.name, end.time, wanted,
                            rest.empty() ? "" : fmt::format(" at {:.6g} s{}", *end.reached, rest)));
    }
  }

  void tell_rounds(const ProcessStep& step, const State& state, std::size_t number) {
    if (!step.round_end) return;
    const RoundEnd& end = *step.round_end;
    const std::string wanted = text_of(end.until, recipe_.materials, recipe_.frame);
    if (state.ends[number].ends_repeat) {
      log_.info(fmt::format("\"{}\" ended after {} at t = {:.6g} s: {}", end.name,
                            counted(static_cast<std::size_t>(end.round), "round"), state.time,
                            wanted));
    } else if (end.steps_left == 0) {
      log_.warn(fmt::format("\"{}\" made {} before {}; raise its repeat", end.name,
                            counted(static_cast<std::size_t>(end.round), "round"), wanted));
    }
  }

  void note_movement(const State& state, const Survey& now) {
    if (movement_.step != step_number(state)) movement_ = {.step = step_number(state)};
    if (movement_.any) return;
    const std::vector<float> speeds = facet_speeds(state, now);
    movement_.any = std::ranges::any_of(speeds, [](float speed) { return speed != 0; });
    if (!movement_.any)
      movement_.seen.insert(now.facets.materials.begin(), now.facets.materials.end());
  }

  // A step that was written in vain; of one that repeats, once.
  void tell_standstill(const ProcessStep& step) {
    if (!step.model || movement_.any || movement_.seen.empty()) return;
    if (!still_models_.insert(step.model.get()).second) return;
    log_.warn(standstill_text(step, movement_.seen, recipe_.materials));
  }

  // Of a step that repeats, once.
  void tell_left_out(const State& state, const Survey& now) {
    if (now.simplify_choice == SimplifyChoice::simplify) return;
    const ProcessStep& step = current_step(state, recipe_);
    if (!left_out_.emplace(step.model.get(), now.simplify_choice).second) return;
    log_.info(fmt::format("step \"{}\", t = {:.4g} s: the mesh is not simplified: {}", step.name,
                          state.time, reason_of(now.simplify_choice)));
  }

  void tell_missed_targets(const State& state, const Survey& now) {
    if (warned_ == step_number(state)) return;
    for (const FluxField& flux : now.flux) {
      if (flux.target_reached()) continue;
      warned_ = step_number(state);
      const WantedError wanted = wanted_error(recipe_);
      const double error =
          wanted.in_position ? position_error(now, now.longest_dt).value_or(0) : flux.error;
      const std::string what = fmt::format("the error of the {} is {}, the target {}",
                                           wanted.in_position ? "position" : "flux",
                                           wanted.text(error), wanted.text(wanted.value));
      const TargetKeys keys{.target = wanted.key()};
      log_.warn(fmt::format("step \"{}\", t = {:.4g} s: {}: {}", current_step(state, recipe_).name,
                            state.time, what, missed_target_text(flux, recipe_.flux, keys)));
    }
  }

  void tell_unfit_coverages(const State& state, const Survey& now) {
    const CoverageFit& fit = now.coverage_fit;
    if (fit.reached || warned_of_coverages_ == step_number(state)) return;
    warned_of_coverages_ = step_number(state);
    const ProcessStep& step = current_step(state, recipe_);
    const Triangle& corners = now.facets.triangles[fit.facet];
    const Vec3f r = (now.facets.vertices[corners[0]] + now.facets.vertices[corners[1]] +
                     now.facets.vertices[corners[2]]) /
                    3.0F;
    log_.warn(fmt::format(
        "step \"{}\", t = {:.4g} s: the coverages of model {} are uncertain by {:.2g} after {} "
        "iterations, most at ({:.4g}, {:.4g}, {:.4g}) nm, material {}; more than the tolerance of "
        "{:g}: raise flux.coverage_iterations or flux.coverage_tolerance",
        step.name, state.time, step.model_name, fit.change, recipe_.coverages.most_iterations, r.x,
        r.y, r.z, recipe_.materials[now.facets.materials[fit.facet]].name,
        recipe_.coverages.tolerance));
  }

  void tell_voids(const State& state, const Survey& now, const VoidChanges& changes) {
    if (changes.opened > 0) {
      log_.info(fmt::format("t = {:.4g} s: {} opened again, {} closed", state.time,
                            counted(changes.opened, "void"), count_of(now.gas.voids)));
    }
    if (changes.closed.empty()) return;
    std::vector<Region> closed;
    for (const std::size_t n : changes.closed) closed.push_back(now.gas.voids[n]);
    log_.info(fmt::format("t = {:.4g} s: {} closed, {} in all", state.time,
                          counted(count_of(closed), "void"), count_of(now.gas.voids)));
    tell(closed);
  }

  void tell(std::span<const Region> regions) {
    for (const std::string& line : region_lines(recipe_.frame, regions)) log_.info(line);
  }

  const Recipe& recipe_;
  Log log_;
  // The surface at the end of a recipe is that of its last step. From 1.
  std::size_t step_number(const State& state) const {
    return std::min(state.step + 1, recipe_.steps.size());
  }

  /// Whether a step moves anything; as long as it does not, what was seen in it.
  struct Movement {
    std::size_t step = 0;
    bool any = false;
    std::set<MaterialId> seen{};
  };
  Movement movement_;
  std::set<const SurfaceModel*> still_models_;
  std::set<std::pair<const SurfaceModel*, SimplifyChoice>> left_out_;

  std::size_t warned_ = 0;  // in which step
  std::size_t warned_of_coverages_ = 0;
};

}  // namespace

RunEnd run(const Recipe& given, const std::filesystem::path& path, const RunOptions& options) {
  if (options.resume && holds_complete_run(path, given)) {
    for (const std::string& loss : losses_of_complete_run(path, given)) options.log.warn(loss);
    return RunEnd::was_complete;
  }
  require_least_memory(given, options.memory_limit_mb);
  const FoundPlanes found = given.uses_symmetry ? mirror_planes(given) : FoundPlanes{};
  const Recipe recipe = on_part(given, found);
  ResultFolder folder(path);
  for (const std::string& warning : recipe.warnings) options.log.warn(warning);
  const auto start = std::chrono::steady_clock::now();

  std::optional<State> resumed;
  if (options.resume) resumed = folder.resume(recipe, options.log);
  State state = resumed ? std::move(*resumed) : start_state(recipe);
  StageTimer total;
  Observer observer(recipe, options.log);
  Watchdog watchdog(recipe, options.log);
  CheckpointClock checkpoints(recipe);

  begin_step(state, recipe);
  if (!resumed) require_memory(state, recipe, options.memory_limit_mb);
  Survey now = resumed ? survey_or_save(state, recipe, folder, watchdog)
                       : watched_survey(state, recipe, watchdog);
  require_held_memory(options.memory_limit_mb);
  if (options.begin) options.begin();
  // An earlier run is not given up before this one is known to work.
  if (!resumed) {
    folder.start(recipe, options.log);
    warn_of_loose_shapes(state, recipe, options.log);
    warn_of_dear_flux(recipe, now, options.log);
    if (given.uses_symmetry) options.log.info("this recipe " + symmetry_text(given, found));
  }
  total.add(now.timer);
  observer.look_at(state, now, note_voids(state, now.gas));
  if (!resumed) folder.write_output(state, now, recipe);
  checkpoints.note_checkpoint(state);

  const auto is_asked_to_stop = [&] { return options.stop != nullptr && *options.stop; };
  bool stop = is_asked_to_stop();
  while (!finished(state, recipe) && !stop) {
    const std::size_t step = state.step;
    const double output_time = next_output(state, recipe);
    const Move move = advance_or_tell(state, recipe, now, output_time, folder);
    observer.look_at(state, move, step);
    watchdog.note(now, move, step);
    folder.append_metrics(state, step, now, move, recipe);
    total.add(move.timer);
    if (options.progress) options.progress(state, now);

    const bool is_output = state.time >= output_time || state.step != step;
    if (!finished(state, recipe)) begin_step(state, recipe);
    // The next survey may take long; an output cannot do without.
    if (is_asked_to_stop() && !is_output) {
      folder.write_checkpoint(state, recipe);
      break;
    }
    now = survey_or_save(state, recipe, folder, watchdog);
    total.add(now.timer);
    observer.look_at(state, now, note_voids(state, now.gas));
    require_memory_or_save(state, recipe, options.memory_limit_mb, folder);
    stop = is_asked_to_stop();
    const bool asked = options.checkpoint != nullptr && options.checkpoint->exchange(false);
    if (is_output || stop || asked || checkpoints.is_due(state)) {
      is_output ? folder.write_output(state, now, recipe) : folder.write_checkpoint(state, recipe);
      checkpoints.note_checkpoint(state);
    }
  }
  watchdog.sum_up();
  if (!finished(state, recipe)) return RunEnd::interrupted;
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  const RunTotals totals = folder.write_summary(state, now, recipe, total, wall.count());
  for (const std::string& loss : losses_of_complete_run(path, given)) options.log.warn(loss);
  tell_left_out(totals.left_out, options.log);
  tell_flux_error(totals.flux, options.log);
  return RunEnd::complete;
}

}  // namespace scarp
