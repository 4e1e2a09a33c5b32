#include "apps/simulator/state.h"

#include <algorithm>
#include <cmath>

namespace scarp {

const ProcessStep& current_step(const State& state, std::span<const ProcessStep> steps) {
  return steps[std::min(state.step, steps.size() - 1)];
}

bool finished(const State& state, std::span<const ProcessStep> steps) {
  return state.step >= steps.size();
}

double next_output(const State& state, double every) {
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

double next_moment(const State& state, const ProcessStep& step, double time_limit) {
  const double end = end_of_step(state, step);
  return time_limit < end - 1e-9 * step.duration ? time_limit : end;
}

double cut_to(double left, double dt) {
  if (dt >= left) return left;
  return dt > 0.5 * left ? 0.5 * left : dt;
}

}  // namespace scarp
