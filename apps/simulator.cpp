#include "apps/simulator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/region_text.h"
#include "apps/symmetry.h"
#include "core/error.h"
#include "levelset/advect.h"
#include "levelset/extend.h"
#include "levelset/layer_steps.h"
#include "levelset/shapes.h"
#include "levelset/symmetry.h"

namespace scarp {

namespace {

// What nothing held any more is gone.
void count_islands(State& state, std::span<const Region> islands) {
  state.islands.count += count_of(islands);
  state.islands.volume += volume_of(islands);
}

// Where the plane of a planarising step lies. Units: nm.
double plane_height(const Planarise& plane, const State& state, const Recipe& recipe) {
  // As the surface of a fresh wafer, which lies a little above 0.
  if (plane.height) return *plane.height + dilation * recipe.frame.spacing;
  if (plane.removal) return highest_point(state.layers) - *plane.removal;
  const double stop = highest_point(state.layers, *plane.stop_material);
  if (std::isfinite(stop)) return stop;
  throw NumericalError(
      fmt::format("no {} is left to stop on", recipe.materials[*plane.stop_material].name));
}

// A condition that is met to within this counts as met: no time step has to be that short.
constexpr double end_tolerance = 1e-4;  // spacings

void end_step(State& state, const ProcessStep& step) {
  state.ends.push_back({.time = state.time,
                        .reached = state.progress.reached,
                        .out_of_time = step.until && state.time < end_of_over_etch(state, step)});
  state.progress = {};
  state.step_start = state.time;
  ++state.step;
  if (!step.round_end) return;
  state.ends.back().ends_repeat =
      distance_left(step.round_end->until, state.repeat_start, state.layers) <=
      end_tolerance * state.layers.frame.spacing;
  if (!state.ends.back().ends_repeat) return;
  state.ends.insert(state.ends.end(), step.round_end->steps_left,
                    {.time = state.time, .skipped = true});
  state.step += step.round_end->steps_left;
}

// A step that needs no time of its own: where it has a duration, nothing else happens in it.
Move act_at_once(State& state, const Recipe& recipe, const ProcessStep& step) {
  Move move;
  move.dt = step.duration;
  {
    const auto measurement = move.timer.measure("advect");
    if (const auto* film = std::get_if<ConformalFilm>(&*step.operation)) {
      coat(state.layers, film->thickness);
    } else {
      const auto& plane = std::get<Planarise>(*step.operation);
      planarise(state.layers, plane_height(plane, state, recipe));
    }
    move.islands = remove_islands(state.layers);
  }
  count_islands(state, move.islands);
  state.mesh = {};
  state.coverages = {};
  state.time = state.step_start + step.duration;
  ++state.time_step;
  end_step(state, step);
  return move;
}

// What went in a time step that was not etched.
struct Removed {
  std::vector<Region> islands;
  double residue_volume = 0;
};

// The layers after a time step, and what is left then to the end condition.
struct Trial {
  double dt = 0;
  Layers layers;
  Removed removed{};
  double left = 0;

  bool is_end(double spacing) const { return left <= end_tolerance * spacing; }
};

// Moves layers of a state through a time step; tells what was removed.
class Mover {
 public:
  Mover(const State& state, const Recipe& recipe, const Survey& survey, StageTimer& timer)
      : state_(state), recipe_(recipe), survey_(survey), timer_(timer) {}

  Removed move(Layers& layers, double dt) const {
    const SpeedField band = [&] {
      const auto measurement = timer_.measure("map");
      return extend_speeds(layers, survey_.gas, survey_.facets, survey_.speeds_of_layers,
                           survey_.factors, dt);
    }();
    const auto measurement = timer_.measure("advect");
    const double residues = advect(layers, band, dt, recipe_.scheme);
    return {remove_islands(layers), residues};
  }

  // A time step that is cut to the moment at which the end condition holds, if it does on the way.
  Trial move_to_end(double dt) const {
    Trial whole = try_step(dt);
    return whole.is_end(spacing()) ? cut_to_end(std::move(whole)) : std::move(whole);
  }

  double left_to_end(const Layers& layers) const {
    const auto measurement = timer_.measure("advect");
    return distance_left(*current_step(state_, recipe_).until, state_.progress.start_height,
                         layers);
  }

 private:
  double spacing() const { return recipe_.frame.spacing; }

  Trial try_step(double dt) const {
    Trial trial{.dt = dt, .layers = state_.layers.copy()};
    trial.removed = move(trial.layers, dt);
    trial.left = left_to_end(trial.layers);
    return trial;
  }

  // By regula falsi (Illinois) where distances are known, by halves elsewhere.
  Trial cut_to_end(Trial beyond) const {
    constexpr double resolution = 1e-3;  // of the time step
    const double narrow = resolution * beyond.dt;
    const bool is_measured = is_length(*current_step(state_, recipe_).until);
    double before = 0;
    double left_before = is_measured ? left_to_end(state_.layers) : 0;
    double left_beyond = beyond.left;
    std::optional<bool> last_was_end;
    while (beyond.dt - before > (is_measured ? 1e-3 * narrow : narrow)) {
      if (is_measured && std::abs(beyond.left) <= end_tolerance * spacing()) break;
      const bool has_slope = is_measured && std::isfinite(left_before) && left_before > left_beyond;
      const double part = has_slope ? left_before / (left_before - left_beyond) : 0.5;
      Trial trial = try_step(before + part * (beyond.dt - before));
      const bool is_end = trial.is_end(spacing());
      // The end that stays twice counts half, or it would stay for ever.
      if (last_was_end == is_end) (is_end ? left_before : left_beyond) *= 0.5;
      last_was_end = is_end;
      if (is_end) {
        left_beyond = trial.left;
        beyond = std::move(trial);
      } else {
        left_before = trial.left;
        before = trial.dt;
      }
    }
    return beyond;
  }

  const State& state_;
  const Recipe& recipe_;
  const Survey& survey_;
  StageTimer& timer_;
};

// A step whose condition holds already: nothing happens in it.
Move end_before_it_begins(State& state, const ProcessStep& step) {
  state.progress.reached = state.time;
  ++state.time_step;
  end_step(state, step);
  return {};
}

}  // namespace

State start_state(const Recipe& recipe) {
  if (recipe.frame.images() > 1) {
    Recipe whole = recipe;
    whole.frame = whole_of(recipe.frame);
    return half_of(start_state(whole), recipe.frame.half);
  }
  if (recipe.start) {
    const State& start = *recipe.start->state;
    return {.layers = start.layers.copy(),
            .origin = {start.time, start.time_step},
            .time = start.time,
            .step_start = start.time,
            .time_step = start.time_step,
            .voids = start.voids,
            .mesh = start.mesh,
            .coverages = start.coverages};
  }
  State state{.layers = build_layers(recipe.frame, recipe.geometry)};
  count_islands(state, remove_islands(state.layers));
  return state;
}

State prepared_state(const Recipe& recipe) {
  State state = start_state(recipe);
  while (!finished(state, recipe) && current_step(state, recipe).operation) {
    begin_step(state, recipe);
    act_at_once(state, recipe, current_step(state, recipe));
  }
  return state;
}

void begin_step(State& state, const Recipe& recipe) {
  const ProcessStep& step = current_step(state, recipe);
  if (step.deposits) add_layer(state.layers, *step.deposits);
  if (step.begins_repeat && state.time == state.step_start)
    state.repeat_start = start_height(*step.begins_repeat, state.layers);
  if (step.until && state.time == state.step_start)
    state.progress.start_height = start_height(*step.until, state.layers);
}

VoidChanges note_voids(State& state, const OpenGas& gas) {
  VoidChanges changes;
  std::vector<VoidClosure> voids;
  for (std::size_t n = 0; n < gas.voids.size(); ++n) {
    const Region& region = gas.voids[n];
    const auto known = std::find_if(
        state.voids.begin(), state.voids.end(),
        [&](const VoidClosure& v) { return v.region.first_node == region.first_node; });
    if (known == state.voids.end()) changes.closed.push_back(n);
    voids.push_back({region, known == state.voids.end() ? state.time : known->time});
  }
  const auto count = [](std::span<const VoidClosure> some) {
    std::size_t sum = 0;
    for (const VoidClosure& each : some) sum += static_cast<std::size_t>(each.region.images);
    return sum;
  };
  std::vector<Region> closed;
  for (const std::size_t n : changes.closed) closed.push_back(gas.voids[n]);
  changes.opened = count(state.voids) + count_of(closed) - count(voids);
  state.voids = std::move(voids);
  return changes;
}

Move advance(State& state, const Recipe& recipe, const Survey& survey, double time_limit) {
  const ProcessStep& step = current_step(state, recipe);
  if (step.operation) return act_at_once(state, recipe, step);
  Move move;
  const Mover mover(state, recipe, survey, move.timer);
  const bool waits = step.until && !state.progress.reached;
  if (waits && state.time == state.step_start &&
      mover.left_to_end(state.layers) <= end_tolerance * recipe.frame.spacing) {
    return end_before_it_begins(state, step);
  }
  const double target = next_moment(state, recipe, time_limit);
  const double left = target - state.time;
  const double stable =
      stable_time_step(state.layers, survey.speeds_of_layers, survey.factors, recipe.cfl);
  move.dt = cut_to(left, std::min(stable, survey.longest_dt));
  bool reached = false;
  Removed removed;
  if (waits) {
    Trial trial = mover.move_to_end(move.dt);
    reached = trial.is_end(recipe.frame.spacing);
    move.dt = trial.dt;
    removed = std::move(trial.removed);
    state.layers = std::move(trial.layers);
  } else {
    removed = mover.move(state.layers, move.dt);
  }
  move.islands = std::move(removed.islands);
  move.residue_volume = state.layers.frame.images() * removed.residue_volume;
  count_islands(state, move.islands);
  state.residue_volume += move.residue_volume;

  state.coverages = coverages_of(survey, *step.model);
  state.mesh = mesh_of(survey, recipe);
  state.time = move.dt == left ? target : state.time + move.dt;
  ++state.time_step;
  if (reached) state.progress.reached = state.time;
  if (state.time >= end_of_step(state, step)) end_step(state, step);
  return move;
}

}  // namespace scarp
