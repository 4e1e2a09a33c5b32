#include "apps/simulator/simulator.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/simulator/region_text.h"
#include "apps/simulator/symmetry.h"
#include "core/error.h"
#include "levelset/grid/symmetry.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/motion/advect.h"
#include "levelset/motion/extend.h"
#include "levelset/operations/coat_on.h"
#include "levelset/operations/fill.h"
#include "levelset/operations/layer_sets.h"
#include "levelset/operations/layer_steps.h"
#include "levelset/operations/placed_shapes.h"
#include "levelset/operations/strip.h"
#include "levelset/start/shapes.h"

namespace scarp {

namespace {

// What nothing held any more is gone.
void count_islands(State& state, std::span<const Region> islands) {
  state.islands.count += count_of(islands);
  state.islands.volume += volume_of(islands);
}

// Where the plane of a planarising step lies. Units: nm.
double plane_height(const Planarise& plane, const Layers& layers, const Materials& materials) {
  // As the surface of a fresh wafer, which lies a little above 0.
  if (plane.height) return *plane.height + dilation * layers.frame.spacing;
  if (plane.removal) return highest_point(layers) - *plane.removal;
  const double stop = highest_point(layers, *plane.stop_material);
  if (std::isfinite(stop)) return stop;
  throw NumericalError(
      fmt::format("no {} is left to stop on", materials[*plane.stop_material].name));
}

// A condition that is met to within this counts as met: no time step has to be that short.
constexpr double end_tolerance = 1e-4;  // spacings

// What a step took away but for residues is gone, in all that is reported of the wafer from then
// on.
void clear_residues(State& state, const std::vector<bool>& is_etched) {
  state.residue_volume += state.layers.frame.images() * remove_residues(state.layers, is_etched);
  remove_empty_layers(state.layers);
}

// The layers of which something was taken away by the speeds of a survey.
std::vector<bool> etched_layers(const Survey& survey) {
  std::vector<bool> etched;
  for (const LayerSpeeds& layer : survey.speeds_of_layers) {
    etched.push_back(std::ranges::any_of(layer.speed, [](const std::array<float, 3>& corners) {
      return *std::ranges::min_element(corners) < 0;
    }));
  }
  return etched;
}

// Whether slopes between a floor and a wall go at speeds of their own, so that the foot is a fan of
// them, and something is etched. By the cosine there is no fan, and crystals have planes.
bool rounds_feet(const Survey& survey) {
  const auto opens_fans = [](const AngularFactor& factor) {
    return !factor.is_cosine() && factor.crystal() == nullptr;
  };
  return std::ranges::any_of(survey.factors, opens_fans) &&
         std::ranges::any_of(survey.growth.etched, [](double volume) { return volume > 0; });
}

void end_step(State& state, const ProcessStep& step) {
  state.ends.push_back({.time = state.time,
                        .reached = state.progress.reached,
                        .out_of_time = step.until && state.time < end_of_over_etch(state, step)});
  state.progress = {};
  state.earlier = {};
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

// What operations do to the layers.
class Operator {
 public:
  Operator(Layers& layers, const Materials& materials, bool keep_free, Move& move)
      : layers_(layers), materials_(materials), keep_free_(keep_free), move_(move) {}

  void operator()(const Planarise& plane) const {
    planarise(layers_, plane_height(plane, layers_, materials_));
  }
  void operator()(const ConformalFilm& film) const {
    if (film.on.empty()) {
      move_.necks_left_out = coat(layers_, film.thickness);
    } else {
      coat_on(layers_, film.thickness, film.on);
    }
  }
  void operator()(const Fill& filled) const {
    const double height = filled.above ? highest_point(layers_) + *filled.above
                                       : *filled.height + dilation * layers_.frame.spacing;
    fill(layers_, height, {.narrower_than = filled.narrower_than, .on = filled.on});
  }
  void operator()(const MaskFilm& mask) const {
    if (mask.planar) {
      const std::array<Shape, 1> shapes{mask.shape};
      return place_shapes(layers_, shapes);
    }
    const LevelSet earlier = layers_.top().copy();
    move_.necks_left_out = coat(layers_, mask.shape.thickness);
    keep_within(layers_, earlier,
                outline_columns(layers_, mask.shape.outline, mask.shape.outlines));
  }
  void operator()(const Strip& stripped) const {
    Layers whole = layers_.copy();
    const std::map<MaterialId, double> before = volumes(whole);
    const bool has_gaps = strip(layers_, stripped.material, stripped.buried, keep_free_);
    // What falls off is no film that is lost.
    if (has_gaps && !keep_free_) strip(whole, stripped.material, stripped.buried, true);
    const std::map<MaterialId, double> after = volumes(has_gaps && !keep_free_ ? whole : layers_);
    for (const auto& [material, volume] : before) {
      const auto left = after.find(material);
      const double lost = volume - (left == after.end() ? 0 : left->second);
      if (material != stripped.material && lost > little_lost * std::abs(volume))
        move_.lost_films[material] = lost;
    }
  }

 private:
  // Edges that a strip leaves are known to a part of a spacing.
  static constexpr double little_lost = 0.02;

  static std::map<MaterialId, double> volumes(const Layers& layers) {
    const std::vector<double> of_layers = material_volumes(layers);
    std::map<MaterialId, double> volumes;
    // The wafer is whole.
    for (std::size_t n = 1; n < of_layers.size(); ++n)
      volumes[layers.stack[n].material] += of_layers[n];
    return volumes;
  }

  Layers& layers_;
  const Materials& materials_;
  bool keep_free_;
  Move& move_;
};

// A step that needs no time of its own: where it has a duration, nothing else happens in it.
Move act_at_once(State& state, const ProcessStep& step, const Materials& materials) {
  Move move;
  move.dt = step.duration;
  {
    const auto measurement = move.timer.measure("advect");
    const LevelSet before = state.layers.top().copy();
    std::visit(Operator(state.layers, materials, step.keep_free, move), *step.operation);
    move.is_in_vain = is_same_surface(before, state.layers.top());
    if (!step.keep_free) move.islands = remove_islands(state.layers);
  }
  const bool takes_away = std::holds_alternative<Planarise>(*step.operation) ||
                          std::holds_alternative<Strip>(*step.operation);
  clear_residues(state, std::vector<bool>(state.layers.stack.size(), takes_away));
  count_islands(state, move.islands);
  state.mesh = {};
  state.coverages = {};
  state.earlier = {};
  state.time = state.step_start + step.duration;
  ++state.time_step;
  end_step(state, step);
  return move;
}

// The layers after a part of a time step, what went on the way that was not etched, and what is
// left then to the end condition.
struct Trial {
  double dt = 0;
  Layers layers;
  std::vector<Region> islands{};
  double residue_volume = 0;
  double left = 0;
  bool exposes_other = false;  ///< other materials than the facets have, before it begins

  bool is_end(double spacing) const { return left <= end_tolerance * spacing; }
};

// Carries the layers of a state through a time step, in as many moves as the scheme needs.
class Mover {
 public:
  Mover(State& state, const ProcessStep& step, const Survey& survey, const Advection& advection,
        Move& result)
      : state_(state),
        step_(step),
        advection_(advection),
        survey_(survey),
        result_(result),
        facets_(survey.facets, survey.tree),
        gas_(survey.gas) {}

  // Ends before dt where the flux would not be that of the facets any more: where a void closes, or
  // another material becomes exposed.
  void move(double dt) {
    do {
      const double part = next_part(dt);
      const SpeedField band = extended_speeds(part);
      if (becomes_exposed(band)) return;
      advance_layers(state_.layers, band, part, result_.islands, result_.residue_volume);
      note(part, dt);
    } while (goes_on(dt));
  }

  // The same; ends, too, at the moment at which the end condition holds. Whether it does.
  bool move_to_end(double dt) {
    do {
      Trial trial = try_move(next_part(dt));
      const bool is_end = trial.is_end(spacing());
      if (!is_end && trial.exposes_other) return false;
      if (is_end) trial = cut_to_end(std::move(trial));
      state_.layers = std::move(trial.layers);
      result_.islands.insert(result_.islands.end(), trial.islands.begin(), trial.islands.end());
      result_.residue_volume += trial.residue_volume;
      note(trial.dt, dt);
      if (is_end) return true;
    } while (goes_on(dt));
    return false;
  }

  double left_to_end(const Layers& layers) const {
    const auto measurement = result_.timer.measure("advect");
    return distance_left(*step_.until, state_.progress.start_height, layers);
  }

 private:
  double spacing() const { return state_.layers.frame.spacing; }

  // The time that the next move takes, where the whole takes dt.
  double next_part(double dt) {
    const double left = dt - result_.dt;
    const double stable =
        stable_time_step(state_.layers, speeds(left), survey_.factors, advection_.cfl);
    constexpr double rounding = 1 - 1e-9;
    return left / std::max(1.0, std::ceil(rounding * left / stable));
  }

  // The means over the next dt.
  std::span<const LayerSpeeds> speeds(double dt) {
    if (!survey_.change) return survey_.speeds_of_layers;
    changed_ = changed_speeds(survey_.speeds_of_layers, *survey_.change, result_.dt + 0.5 * dt);
    return changed_;
  }

  // How far the facets of the survey may be from a surface that has moved since.
  double distance() const {
    return std::max(close_facets * spacing(), survey_.facet_distance) +
           static_cast<double>(moves_) * advection_.cfl * spacing();
  }

  SpeedField extended_speeds(double dt) {
    const auto measurement = result_.timer.measure("map");
    facets_.room = &state_.layers.top().band().scratch(0);
    return extend_speeds(state_.layers, gas_, facets_, speeds(dt), survey_.factors, dt, distance());
  }

  void advance_layers(Layers& layers, const SpeedField& band, double dt,
                      std::vector<Region>& islands, double& residue_volume) const {
    const auto measurement = result_.timer.measure("advect");
    residue_volume += advect(layers, band, dt, advection_.scheme);
    if (step_.keep_free) return;
    const std::vector<Region> removed = remove_islands(layers);
    islands.insert(islands.end(), removed.begin(), removed.end());
  }

  // Since the first move, in which facets and surface differ at borders of materials alone.
  bool becomes_exposed(const SpeedField& band) {
    constexpr double little = 0.005;  // of the surface
    if (moves_ == 0) seen_at_first_ = band.newly_seen;
    return band.newly_seen > seen_at_first_ + little;
  }

  // After a move.
  void note(double part, double dt) {
    result_.dt = part >= dt - result_.dt ? dt : result_.dt + part;
    ++moves_;
  }

  bool goes_on(double dt) {
    if (result_.dt >= dt) return false;
    const auto measurement = result_.timer.measure("surface");
    gas_ = open_gas(state_.layers, survey_.gas.voids);
    return std::ranges::all_of(gas_.voids, [&](const Region& region) {
      return std::ranges::any_of(survey_.gas.voids, [&](const Region& known) {
        return known.first_node == region.first_node;
      });
    });
  }

  Trial try_move(double dt) {
    Trial trial{.dt = dt, .layers = state_.layers.copy()};
    const SpeedField band = extended_speeds(dt);
    trial.exposes_other = becomes_exposed(band);
    advance_layers(trial.layers, band, dt, trial.islands, trial.residue_volume);
    trial.left = left_to_end(trial.layers);
    return trial;
  }

  // By regula falsi (Illinois) where distances are known, by halves elsewhere.
  Trial cut_to_end(Trial beyond) {
    constexpr double resolution = 1e-3;  // of the move
    const double narrow = resolution * beyond.dt;
    const bool is_measured = is_length(*step_.until);
    double before = 0;
    double left_before = is_measured ? left_to_end(state_.layers) : 0;
    double left_beyond = beyond.left;
    std::optional<bool> last_was_end;
    while (beyond.dt - before > (is_measured ? 1e-3 * narrow : narrow)) {
      if (is_measured && std::abs(beyond.left) <= end_tolerance * spacing()) break;
      const bool has_slope = is_measured && std::isfinite(left_before) && left_before > left_beyond;
      const double part = has_slope ? left_before / (left_before - left_beyond) : 0.5;
      Trial trial = try_move(before + part * (beyond.dt - before));
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

  State& state_;
  const ProcessStep& step_;
  const Advection& advection_;
  const Survey& survey_;
  Move& result_;
  FacetTree facets_;
  OpenGas gas_;  // of the layers as they are
  std::vector<LayerSpeeds> changed_;
  std::size_t moves_ = 0;
  double seen_at_first_ = 0;
};

// A step whose condition holds already: nothing happens in it.
Move end_before_it_begins(State& state, const ProcessStep& step) {
  state.progress.reached = state.time;
  ++state.time_step;
  end_step(state, step);
  return {};
}

}  // namespace

State start_state(const Frame& frame, const StartGeometry& start) {
  if (frame.images() > 1)
    return part_of(start_state(whole_of(frame), start), {frame.half, frame.diagonal});
  if (start.state) {
    const State& left = *start.state->state;
    if (!start.shapes.empty()) {
      // What was kept of the surface is not that of the new one.
      State state{.layers = left.layers.copy(),
                  .origin = {left.time, left.time_step},
                  .time = left.time,
                  .step_start = left.time,
                  .time_step = left.time_step,
                  .feet_are_rounded = left.feet_are_rounded};
      place_shapes(state.layers, start.shapes);
      count_islands(state, remove_islands(state.layers));
      remove_empty_layers(state.layers);
      return state;
    }
    return {.layers = left.layers.copy(),
            .origin = {left.time, left.time_step},
            .time = left.time,
            .step_start = left.time,
            .time_step = left.time_step,
            .voids = left.voids,
            .feet_are_rounded = left.feet_are_rounded,
            .mesh = left.mesh,
            .coverages = left.coverages};
  }
  State state{.layers = build_layers(frame, start.shapes)};
  count_islands(state, remove_islands(state.layers));
  return state;
}

State prepared_state(const Frame& frame, const StartGeometry& start,
                     std::span<const ProcessStep> steps, const Materials& materials) {
  State state = start_state(frame, start);
  while (!finished(state, steps) && current_step(state, steps).operation) {
    begin_step(state, steps);
    act_at_once(state, current_step(state, steps), materials);
  }
  return state;
}

void begin_step(State& state, std::span<const ProcessStep> steps) {
  const ProcessStep& step = current_step(state, steps);
  if (step.deposits) {
    // In cycles films that were stripped would pile up.
    if (state.layers.stack.back().material != *step.deposits) remove_empty_layers(state.layers);
    add_layer(state.layers, *step.deposits);
  }
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
  const ProcessStep& step = current_step(state, recipe.steps);
  if (step.operation) return act_at_once(state, step, recipe.materials);
  Move move;
  Mover mover(state, step, survey, recipe.advection, move);
  const bool waits = step.until && !state.progress.reached;
  if (waits && state.time == state.step_start &&
      mover.left_to_end(state.layers) <= end_tolerance * state.layers.frame.spacing) {
    return end_before_it_begins(state, step);
  }
  const double target = next_moment(state, step, time_limit);
  const double left = target - state.time;
  const double dt = cut_to(left, survey.longest_dt);
  bool reached = false;
  if (waits) {
    reached = mover.move_to_end(dt);
  } else {
    mover.move(dt);
  }
  move.residue_volume *= state.layers.frame.images();
  count_islands(state, move.islands);
  state.residue_volume += move.residue_volume;
  state.feet_are_rounded = state.feet_are_rounded || rounds_feet(survey);

  state.coverages = coverages_of(survey, *step.model);
  state.mesh = mesh_of(survey, recipe.flux);
  state.earlier = earlier_flux(survey, recipe.flux, move.dt);
  state.time = move.dt == left ? target : state.time + move.dt;
  ++state.time_step;
  if (reached) state.progress.reached = state.time;
  if (state.time < end_of_step(state, step)) {
    // What may grow again keeps its layer.
    if (!step.deposits) remove_empty_layers(state.layers);
    return move;
  }
  clear_residues(state, etched_layers(survey));
  end_step(state, step);
  return move;
}

}  // namespace scarp
