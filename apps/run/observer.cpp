#include "apps/run/observer.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "apps/simulator/flux_target.h"
#include "apps/simulator/region_text.h"
#include "apps/simulator/surface_speeds.h"
#include "core/plain_number.h"
#include "core/printable.h"
#include "core/recipe/quantity.h"

namespace scarp {

namespace {

std::string necks_left_out_text(const ProcessStep& step, const NecksLeftOut& left_out) {
  return fmt::format(
      "step \"{}\": {:.2g} nodes lie below overhangs, from z = {:.4g} to {:.4g} nm, too many to "
      "find necks among them: behind a neck narrower than twice the thickness the film keeps "
      "growing after the neck has closed; choose a larger domain.spacing or a smaller domain",
      step.name, static_cast<double>(left_out.node_count), left_out.lowest, left_out.highest);
}

std::string lost_text(const ProcessStep& step, double volume, const std::string& material) {
  return fmt::format(
      "step \"{}\": {:.4g} nm^3 of {} are lost: the grid cuts off edges and the sides of thin gaps "
      "that the strip opens, and films thinner than two spacings that are left without support; "
      "use a smaller domain.spacing",
      step.name, volume, material);
}

}  // namespace

void Observer::look_at(const State& state, const Survey& now, const VoidChanges& changes) {
  tell_left_out(state, now);
  tell_missed_targets(state, now);
  tell_unfit_coverages(state, now);
  tell_voids(state, now, changes);
  note_movement(state, now);
}

void Observer::look_at(const State& state, const Move& move, std::size_t step) {
  if (move.necks_left_out.node_count > 0)
    log_.warn(necks_left_out_text(recipe_.steps[step], move.necks_left_out));
  for (const auto& [material, volume] : move.lost_films)
    log_.warn(lost_text(recipe_.steps[step], volume, recipe_.materials[material].name));
  tell_used_masks(state, step);
  if (state.step != step) {
    tell_end(recipe_.steps[step], state, step);
    tell_standstill(recipe_.steps[step]);
    if (move.is_in_vain && still_paths_.insert(recipe_.steps[step].path).second)
      log_.warn(standstill_text(recipe_.steps[step], state.layers, recipe_.materials));
    tell_rounds(recipe_.steps[step], state, step);
  }
  if (move.islands.empty()) return;
  log_.info(fmt::format("t = {} s: {} of solid cut off from the wafer, removed",
                        plain_number(state.time, 4), counted(count_of(move.islands), "piece")));
  tell(move.islands);
}

// Masks that an etch leaves nothing of.
void Observer::tell_used_masks(const State& state, std::size_t step) {
  for (const MaterialId mask : recipe_.metrology.masks) {
    const bool is_there = has_material(state.layers, mask);
    const bool was_there = is_there ? !masks_.insert(mask).second : masks_.erase(mask) > 0;
    if (is_there || !was_there || !recipe_.steps[step].model) continue;
    log_.warn(fmt::format(
        "t = {:.6g} s: step \"{}\" has used up the mask: no {} is left; use a thicker mask or a "
        "shorter step",
        state.time, recipe_.steps[step].name, recipe_.materials[mask].name));
  }
}

void Observer::tell_end(const ProcessStep& step, const State& state, std::size_t number) {
  if (!step.until) return;
  const StepEnd& end = state.ends[number];
  const double start = number > 0 ? state.ends[number - 1].time : state.origin.time;
  const std::string wanted = text_of(*step.until, recipe_.materials, recipe_.domain.frame);
  if (end.out_of_time) {
    log_.warn(fmt::format(
        "step \"{}\" ended at t = {:.6g} s by its duration of {}, before {}{}; raise its "
        "duration",
        step.name, end.time, format_quantity(step.duration, Dimension::time), wanted,
        end.reached ? fmt::format(" (at {:.6g} s){}", *end.reached, over_etch_text(*step.until))
                    : ""));
  } else if (end.time == start) {
    log_.warn(fmt::format("step \"{}\" took no time: {} when it began, at t = {:.6g} s", step.name,
                          wanted, end.time));
  } else {
    const std::string rest = over_etch_text(*step.until);
    log_.info(fmt::format("step \"{}\" ended at t = {:.6g} s: {}{}", step.name, end.time, wanted,
                          rest.empty() ? "" : fmt::format(" at {:.6g} s{}", *end.reached, rest)));
  }
}

void Observer::tell_rounds(const ProcessStep& step, const State& state, std::size_t number) {
  if (!step.round_end) return;
  const RoundEnd& end = *step.round_end;
  const std::string wanted = text_of(end.until, recipe_.materials, recipe_.domain.frame);
  if (state.ends[number].ends_repeat) {
    log_.info(fmt::format("\"{}\" ended after {} at t = {:.6g} s: {}", end.name,
                          counted(static_cast<std::size_t>(end.round), "round"), state.time,
                          wanted));
  } else if (end.steps_left == 0) {
    log_.warn(fmt::format("\"{}\" made {} before {}; raise its repeat", end.name,
                          counted(static_cast<std::size_t>(end.round), "round"), wanted));
  }
}

void Observer::note_movement(const State& state, const Survey& now) {
  if (movement_.step != step_number(state)) movement_ = {.step = step_number(state)};
  if (movement_.any) return;
  const std::vector<float> speeds = facet_speeds(state, now);
  movement_.any = std::ranges::any_of(speeds, [](float speed) { return speed != 0; });
  if (!movement_.any)
    movement_.seen.insert(now.facets.materials.begin(), now.facets.materials.end());
}

// A step that was written in vain; of one that repeats, once.
void Observer::tell_standstill(const ProcessStep& step) {
  if (!step.model || movement_.any || movement_.seen.empty()) return;
  if (!still_models_.insert(step.model.get()).second) return;
  log_.warn(standstill_text(step, movement_.seen, recipe_.materials));
}

// Of a step that repeats, once.
void Observer::tell_left_out(const State& state, const Survey& now) {
  if (now.simplify_choice == SimplifyChoice::simplify) return;
  const ProcessStep& step = current_step(state, recipe_.steps);
  if (!left_out_.emplace(step.model.get(), now.simplify_choice).second) return;
  log_.info(fmt::format("step \"{}\", t = {} s: the mesh is not simplified: {}", step.name,
                        plain_number(state.time, 4), reason_of(now.simplify_choice)));
}

void Observer::tell_missed_targets(const State& state, const Survey& now) {
  if (warned_ == step_number(state)) return;
  for (const FluxField& flux : now.flux) {
    if (flux.target_reached()) continue;
    warned_ = step_number(state);
    const WantedError wanted = wanted_error(recipe_.flux);
    const double error =
        wanted.in_position ? position_error(now, now.longest_dt).value_or(0) : flux.error;
    const std::string what = fmt::format("the error of the {} is {}, the target {}",
                                         wanted.in_position ? "position" : "flux",
                                         wanted.text(error), wanted.text(wanted.value));
    const TargetKeys keys{.target = wanted.key()};
    log_.warn(fmt::format("step \"{}\", t = {} s: {}: {}", current_step(state, recipe_.steps).name,
                          plain_number(state.time, 4), what,
                          missed_target_text(flux, recipe_.flux.options, keys)));
  }
}

void Observer::tell_unfit_coverages(const State& state, const Survey& now) {
  const CoverageFit& fit = now.coverage_fit;
  if (fit.reached || warned_of_coverages_ == step_number(state)) return;
  warned_of_coverages_ = step_number(state);
  const ProcessStep& step = current_step(state, recipe_.steps);
  const Triangle& corners = now.facets.triangles[fit.facet];
  const Vec3f r = (now.facets.vertices[corners[0]] + now.facets.vertices[corners[1]] +
                   now.facets.vertices[corners[2]]) /
                  3.0F;
  log_.warn(fmt::format(
      "step \"{}\", t = {} s: the coverages of model {} are uncertain by {:.2g} after {} "
      "iterations, most at ({:.4g}, {:.4g}, {:.4g}) nm, material {}; more than the tolerance of "
      "{:g}: raise flux.coverage_iterations or flux.coverage_tolerance",
      step.name, plain_number(state.time, 4), step.model_name, fit.change,
      recipe_.flux.coverages.most_iterations, r.x, r.y, r.z,
      recipe_.materials[now.facets.materials[fit.facet]].name, recipe_.flux.coverages.tolerance));
}

void Observer::tell_voids(const State& state, const Survey& now, const VoidChanges& changes) {
  if (changes.opened > 0) {
    log_.info(fmt::format("t = {} s: {} opened again, {} closed", plain_number(state.time, 4),
                          counted(changes.opened, "void"), count_of(now.gas.voids)));
  }
  if (changes.closed.empty()) return;
  std::vector<Region> closed;
  for (const std::size_t n : changes.closed) closed.push_back(now.gas.voids[n]);
  log_.info(fmt::format("t = {} s: {} closed, {} in all", plain_number(state.time, 4),
                        counted(count_of(closed), "void"), count_of(now.gas.voids)));
  tell(closed);
}

void Observer::tell(std::span<const Region> regions) {
  for (const std::string& line : region_lines(recipe_.domain.frame, regions)) log_.info(line);
}

// The surface at the end of a recipe is that of its last step. From 1.
std::size_t Observer::step_number(const State& state) const {
  return std::min(state.step + 1, recipe_.steps.size());
}

void Observer::tell_loose_shapes(const State& start) const {
  const std::string text = loose_solid_text(start.layers.frame, start.islands);
  if (!text.empty()) log_.warn(text);
}

}  // namespace scarp
