#include "apps/simulator/state.h"

#include <algorithm>
#include <cmath>

namespace scarp {

State copy_of(const State& state) {
  return {.layers = state.layers.copy(),
          .origin = state.origin,
          .time = state.time,
          .step = state.step,
          .step_start = state.step_start,
          .progress = state.progress,
          .repeat_start = state.repeat_start,
          .ends = state.ends,
          .time_step = state.time_step,
          .voids = state.voids,
          .islands = state.islands,
          .residue_volume = state.residue_volume,
          .feet_are_rounded = state.feet_are_rounded,
          .mesh = state.mesh,
          .coverages = state.coverages,
          .earlier = state.earlier};
}

const ProcessStep& current_step(const State& state, const Recipe& recipe) {
  return recipe.steps[std::min(state.step, recipe.steps.size() - 1)];
}

bool finished(const State& state, const Recipe& recipe) {
  return state.step >= recipe.steps.size();
}

double next_output(const State& state, const Recipe& recipe) {
  const double every = recipe.output_every;
  if (every <= 0) return std::numeric_limits<double>::infinity();
  const double passed = std::floor(state.time / every * (1 + 1e-12));
  return (passed + 1) * every;
}

double end_of_over_etch(const State& state, const ProcessStep& step) {
  if (!state.progress.reached) return std::numeric_limits<double>::infinity();
  const double reached = *state.progress.reached;
  return reached + step.until->over_etch * (reached - state.step_start);
}

double end_of_step(const State& state, const ProcessStep& step) {
  return std::min(state.step_start + step.duration, end_of_over_etch(state, step));
}

double next_moment(const State& state, const Recipe& recipe, double time_limit) {
  const ProcessStep& step = current_step(state, recipe);
  const double end = end_of_step(state, step);
  return time_limit < end - 1e-9 * step.duration ? time_limit : end;
}

double cut_to(double left, double dt) {
  if (dt >= left) return left;
  return dt > 0.5 * left ? 0.5 * left : dt;
}

}  // namespace scarp
