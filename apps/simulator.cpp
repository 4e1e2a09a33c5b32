#include "apps/simulator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/coverage_cycle.h"
#include "core/error.h"
#include "flux/reconstruct.h"
#include "flux/solve.h"
#include "levelset/advect.h"
#include "levelset/diffusion.h"
#include "levelset/exposure.h"
#include "levelset/extend.h"
#include "levelset/extract_surface.h"
#include "levelset/layer_steps.h"
#include "levelset/shapes.h"
#include "mesh/simplify.h"

namespace scarp {

namespace {

// Gas that no path joins to the source sees no particle and does not move: its surface is left out.
TriMesh exposed_surface(const State& state, const Recipe& recipe, Survey& result) {
  const auto measurement = result.timer.measure("surface");
  std::vector<Region> known;
  for (const VoidClosure& each : state.voids) known.push_back(each.region);
  result.gas = open_gas(state.layers, known);
  TriMesh surface = extract_surface(state.layers, result.gas);
  if (surface.triangles.empty()) {
    throw NumericalError(
        fmt::format("time step {} of step \"{}\", t = {:g} s: no surface is left that the source "
                    "can see",
                    state.time_step, current_step(state, recipe).name, state.time));
  }
  result.vertices_full = surface.vertices.size();
  result.facets_full = surface.triangles.size();
  result.extent = bounding_box(surface);
  return surface;
}

// A film loses none of its thickness by the facets that it is seen on.
TriMesh simplified(TriMesh surface, const State& state, const Recipe& recipe, Survey& result) {
  constexpr double part_of_film = 0.05;
  constexpr float least_film = 0.5F;  // spacings
  const auto measurement = result.timer.measure("simplify");
  if (!recipe.simplify) return surface;
  SimplifyOptions options = *recipe.simplify;
  const double of_film = part_of_film * thinnest_film(state.layers, least_film);
  if (options.max_error) options.max_error = std::min(*options.max_error, of_film);
  SimplifyResult coarse = simplify(surface, options);
  result.simplify_max_distance = coarse.max_distance;
  return std::move(coarse.mesh);
}

SurfaceCoverages coverages_of(const Survey& survey, const SurfaceModel& model) {
  if (survey.coverages.empty()) return {};
  return {.facets = survey.facets, .names = model.coverages(), .values = survey.coverages};
}

std::vector<Species> species_of(const ProcessStep& step) {
  return step.model ? step.model->species() : std::vector<Species>{};
}

// What the model lets the facets send out; refers to all of them.
SurfaceEmission emission_from(const TriMesh& facets, const SurfaceModel& model,
                              std::span<const Species> species,
                              const std::vector<std::vector<float>>& coverages) {
  SurfaceEmission emission;
  for (const Species& each : species)
    emission.species.push_back(each.source.kind == SourceLobe::Kind::none);
  if (std::ranges::find(emission.species, true) == emission.species.end()) return {};
  emission.of = [&](std::span<const std::span<const float>> flux) {
    const std::vector<Vec3f> normals = facet_normals(facets);
    return model.emission({.material = facets.materials, .normal = normals, .coverages = coverages},
                          flux);
  };
  return emission;
}

// Sticking and emission follow the coverages, of a balance or of a cycle.
template <class Coverages>
std::vector<FluxField> solve_with(Coverages& coverages, std::span<const Species> species,
                                  const FluxOptions& options, const SurfaceModel& model,
                                  Survey& result) {
  std::vector<FluxField> flux =
      solve_flux(result.facets, species, options, coverages.feedback(),
                 emission_from(result.facets, model, species, coverages.coverages()));
  const int before = result.coverage_fit.iterations;
  result.coverages = coverages.coverages();
  result.coverage_fit = coverages.fit();
  result.coverage_fit.iterations += before;
  return flux;
}

// The flux on a surface that it covers; where it was solved before, on from the coverages then.
std::vector<FluxField> solve_covered(std::span<const Species> species, const FluxOptions& options,
                                     const State& state, const Recipe& recipe, Survey& result) {
  const SurfaceModel& model = *current_step(state, recipe).model;
  if (model.coverages().empty())
    return solve_flux(result.facets, species, options, {},
                      emission_from(result.facets, model, species, result.coverages));
  if (!model.phases().empty()) {
    CoverageCycle cycle(model, result.facets, recipe.coverages);
    return solve_with(cycle, species, options, model, result);
  }
  const bool again = !result.coverages.empty();
  CoverageIteration iteration(model, result.facets,
                              again ? coverages_of(result, model) : state.coverages,
                              recipe.coverages);
  return solve_with(iteration, species, options, model, result);
}

// Particles that slip through the surface make every number wrong without showing it.
void require_nothing_lost(std::span<const FluxField> flux, const State& state,
                          const Recipe& recipe) {
  constexpr double most_lost = 1e-4;
  for (const FluxField& field : flux) {
    const double lost = field.audit.emitted > 0 ? field.audit.lost() / field.audit.emitted : 0;
    if (lost <= most_lost) continue;
    throw NumericalError(fmt::format(
        "time step {} of step \"{}\", t = {:g} s: {:.2g} of the particles were lost at the "
        "surface, "
        "more than {:g} is not trusted; please report it with the recipe",
        state.time_step, current_step(state, recipe).name, state.time, lost, most_lost));
  }
}

// The concentration in a bath as the flux that it is in place of: without rays and errors.
FluxField dissolved(const State& state, const SurfaceModel& model, const Solute& solute,
                    const TriMesh& facets) {
  const std::vector<Vec3f> normals = facet_normals(facets);
  const std::vector<Exchange> exchange =
      model.exchange({.material = facets.materials, .normal = normals});
  Concentration concentration = diffuse(state.layers, facets, exchange, solute);
  FluxField field;
  field.tallies.push_back({.mean = std::move(concentration.at_facets),
                           .std_error = std::vector<float>(facets.triangles.size())});
  field.audit = {.emitted = concentration.released,
                 .absorbed = concentration.settled,
                 .escaped = concentration.escaped};
  return field;
}

void trace(const State& state, const Recipe& recipe, FluxOptions options, Survey& result) {
  const auto measurement = result.timer.measure("flux");
  const auto& model = current_step(state, recipe).model;
  if (const auto solute = model ? model->solute() : std::nullopt) {
    result.flux = {dissolved(state, *model, *solute, result.facets)};
    return;
  }
  const std::vector<Species> species = species_of(current_step(state, recipe));
  if (species.empty()) return;
  options.time_step = state.time_step;
  std::vector<FluxField> flux = solve_covered(species, options, state, recipe, result);
  for (std::size_t i = 0; i < result.flux.size(); ++i) {
    flux[i].rays += result.flux[i].rays;
    flux[i].segments += result.flux[i].segments;
  }
  result.flux = std::move(flux);
  require_nothing_lost(result.flux, state, recipe);
}

// Values at the three corners of every facet, in one row.
std::vector<float> at_corners(const TriMesh& facets, std::span<const float> on_facets) {
  std::vector<float> values;
  for (const auto& corners : corner_values(facets, on_facets))
    values.insert(values.end(), corners.begin(), corners.end());
  return values;
}

// The flux at the corners, one array per tally of each species.
std::vector<std::vector<float>> flux_at_corners(const TriMesh& facets,
                                                std::span<const FluxField> flux) {
  std::vector<std::vector<float>> tallies;
  for (const FluxField& field : flux)
    for (const Tally& tally : field.tallies) tallies.push_back(at_corners(facets, tally.mean));
  return tallies;
}

CornerSpeeds by_facet(const std::vector<float>& row) {
  CornerSpeeds speeds(row.size() / 3);
  for (std::size_t p = 0; p < row.size(); ++p) speeds[p / 3][p % 3] = row[p];
  return speeds;
}

std::vector<std::span<const float>> tallies_on_facets(std::span<const FluxField> flux) {
  std::vector<std::span<const float>> tallies;
  for (const FluxField& field : flux)
    for (const Tally& tally : field.tallies) tallies.emplace_back(tally.mean);
  return tallies;
}

// A model speaks of points: here the three corners of every facet, with the facet's own normal, so
// that speeds break where the surface does.
LayerSpeeds speeds_of_material(const std::vector<Vec3f>& corner_normals,
                               std::span<const std::vector<float>> corner_flux,
                               std::span<const std::vector<float>> corner_coverages,
                               const SurfaceModel& model, MaterialId material) {
  const std::vector<MaterialId> everywhere(corner_normals.size(), material);
  const SurfacePoints points{
      .material = everywhere, .normal = corner_normals, .coverages = corner_coverages};
  const std::vector<std::span<const float>> views(corner_flux.begin(), corner_flux.end());
  return {.speed = by_facet(model.speeds(points, views))};
}

// With factors of the normal it speaks of facets, where flux and normal belong together: a mean of
// the flux over facets that turn is that of none of their normals. Amplitudes do not turn.
LayerSpeeds parts_of_material(const TriMesh& facets, const std::vector<Vec3f>& normals,
                              std::span<const FluxField> flux, const SurfaceModel& model,
                              std::span<const AngularFactor> factors, MaterialId material) {
  const std::vector<MaterialId> everywhere(normals.size(), material);
  const SurfacePoints points{.material = everywhere, .normal = normals};
  LayerSpeeds speeds;
  for (const std::vector<float>& part : model.amplitudes(points, tallies_on_facets(flux)))
    speeds.parts.push_back(corner_values(facets, part));
  speeds.speed = speeds.parts.front();
  for (std::size_t k = 0; k < factors.size(); ++k) {
    for (std::size_t f = 0; f < normals.size(); ++f) {
      const float factor = factors[k].value(normals[f]);
      for (std::size_t corner = 0; corner < 3; ++corner)
        speeds.speed[f][corner] += factor * speeds.parts[1 + k][f][corner];
    }
  }
  return speeds;
}

std::vector<LayerSpeeds> speeds_at_corners(const State& state, const Survey& survey,
                                           const SurfaceModel& model) {
  const TriMesh& facets = survey.facets;
  const std::vector<Vec3f> normals = facet_normals(facets);
  std::vector<Vec3f> corner_normals;
  std::vector<std::vector<float>> corner_flux;
  std::vector<std::vector<float>> corner_coverages;
  if (survey.factors.empty()) {
    for (const Vec3f& n : normals) corner_normals.insert(corner_normals.end(), 3, n);
    corner_flux = flux_at_corners(facets, survey.flux);
    for (const std::vector<float>& coverage : survey.coverages)
      corner_coverages.push_back(at_corners(facets, coverage));
  }
  std::vector<LayerSpeeds> speeds;
  for (std::size_t k = 0; k < state.layers.stack.size(); ++k) {
    const MaterialId material = state.layers.stack[k].material;
    std::size_t same = 0;
    while (state.layers.stack[same].material != material) ++same;
    if (same < k) {
      speeds.push_back(speeds[same]);
    } else if (survey.factors.empty()) {
      speeds.push_back(
          speeds_of_material(corner_normals, corner_flux, corner_coverages, model, material));
    } else {
      speeds.push_back(
          parts_of_material(facets, normals, survey.flux, model, survey.factors, material));
    }
  }
  return speeds;
}

std::size_t layer_of(const State& state, MaterialId material) {
  std::size_t k = state.layers.stack.size() - 1;
  while (k > 0 && state.layers.stack[k].material != material) --k;
  return k;
}

[[noreturn]] void refuse_speed(const std::string& what, std::size_t facet, MaterialId material,
                               const Survey& survey, const State& state, const Recipe& recipe) {
  const ProcessStep& step = current_step(state, recipe);
  const Vec3f r = survey.facets.vertices[survey.facets.triangles[facet][0]];
  const std::string formula = step.model->formula(material);
  throw NumericalError(
      fmt::format("time step {} of step \"{}\", t = {:g} s: {} on facet {} at ({:g}, {:g}, {:g}) "
                  "nm, material {}{}",
                  state.time_step, step.name, state.time, what, facet, r.x, r.y, r.z,
                  recipe.materials[material].name,
                  formula.empty() ? "" : fmt::format(", rate \"{}\"", formula)));
}

// Of all layers: one that is not seen may come to light within the time step. And a step that
// deposits nothing must not let anything grow: what grew would be of which material?
void require_sound_speeds(const Survey& survey, const State& state, const Recipe& recipe) {
  const ProcessStep& step = current_step(state, recipe);
  for (std::size_t f = 0; f < survey.facets.triangles.size(); ++f) {
    const std::size_t seen = layer_of(state, survey.facets.materials[f]);
    for (std::size_t k = 0; k < survey.speeds_of_layers.size(); ++k) {
      const MaterialId material = state.layers.stack[k].material;
      for (const float speed : survey.speeds_of_layers[k].speed[f]) {
        if (!std::isfinite(speed))
          refuse_speed("speed is not finite", f, material, survey, state, recipe);
        if (k != seen || speed <= 0 || step.deposits) continue;
        refuse_speed(fmt::format("the surface grows, by {:g} nm/s, and the step names no material "
                                 "that is deposited,",
                                 speed),
                     f, material, survey, state, recipe);
      }
    }
  }
}

// What nothing held any more is gone.
void count_islands(State& state, std::span<const Region> islands) {
  state.islands.count += islands.size();
  for (const Region& island : islands) state.islands.volume += island.volume;
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

// When over-etch is over; infinity before the end condition holds.
double end_of_over_etch(const State& state, const ProcessStep& step) {
  if (!state.progress.reached) return std::numeric_limits<double>::infinity();
  const double reached = *state.progress.reached;
  return reached + step.until->over_etch * (reached - state.step_start);
}

// As far as it is known.
double end_of_step(const State& state, const ProcessStep& step) {
  return std::min(state.step_start + step.duration, end_of_over_etch(state, step));
}

// What is left to the end of the step or to the next output. Moments are set, not summed, where one
// is hit: no rounding error can leave a remainder. An output wanted within rounding of the end of a
// step is the end of the step.
double next_moment(const State& state, const Recipe& recipe, double time_limit) {
  const ProcessStep& step = current_step(state, recipe);
  const double end = end_of_step(state, step);
  return time_limit < end - 1e-9 * step.duration ? time_limit : end;
}

void end_step(State& state, const ProcessStep& step) {
  state.ends.push_back({.time = state.time,
                        .reached = state.progress.reached,
                        .out_of_time = step.until && state.time < end_of_over_etch(state, step)});
  state.progress = {};
  state.step_start = state.time;
  ++state.step;
  if (!step.round_end || step.round_end->steps_left == 0) return;
  if (!ends_repeat(state, *step.round_end)) return;
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

// The last two time steps before a limit share what is left, so that none is a tiny remainder.
double cut_to(double limit, double dt) {
  if (dt >= limit) return limit;
  return dt > 0.5 * limit ? 0.5 * limit : dt;
}

void find_speeds(const State& state, const Recipe& recipe, Survey& result) {
  const ProcessStep& step = current_step(state, recipe);
  if (!step.model) return;
  result.factors = step.model->angular_factors();
  result.speeds_of_layers = speeds_at_corners(state, result, *step.model);
  require_sound_speeds(result, state, recipe);
}

// Of the flux that tells what the wanted error of the position asks for.
constexpr double first_flux_error = 0.1;

double planned_time_step(const State& state, const Recipe& recipe, const Survey& now) {
  const double left = next_moment(state, recipe, next_output(state, recipe)) - state.time;
  return cut_to(left,
                stable_time_step(state.layers, now.speeds_of_layers, now.factors, recipe.cfl));
}

// How far a unit of a tally moves each facet in a time step, by differences about the flux that is
// known, as wide as its error. Units: nm.
std::vector<float> response(const SurfaceModel& model, const SurfacePoints& points,
                            std::vector<std::span<const float>> flux, std::size_t tally,
                            std::span<const float> std_error, double dt) {
  constexpr float least_width = 1e-3F;
  std::vector<float> low(flux[tally].begin(), flux[tally].end());
  std::vector<float> high = low;
  for (std::size_t f = 0; f < low.size(); ++f) {
    const float width = std::max(std_error[f], least_width);
    low[f] = std::max(0.0F, low[f] - width);
    high[f] += width;
  }
  flux[tally] = low;
  const std::vector<float> slower = model.speeds(points, flux);
  flux[tally] = high;
  std::vector<float> result = model.speeds(points, flux);
  for (std::size_t f = 0; f < result.size(); ++f) {
    const double slope = (result[f] - slower[f]) / (high[f] - low[f]);
    // Beside the flux that is known a formula may have a pole: no number of rays helps there.
    result[f] = static_cast<float>(std::isfinite(slope) ? dt * slope : 0);
  }
  return result;
}

// Of all tallies, by species.
std::vector<std::vector<std::vector<float>>> responses(const SurfaceModel& model,
                                                       const Survey& now) {
  const std::vector<Vec3f> normals = facet_normals(now.facets);
  const SurfacePoints points{.material = now.facets.materials, .normal = normals};
  const std::vector<std::span<const float>> flux = tallies_on_facets(now.flux);
  std::vector<std::vector<std::vector<float>>> result;
  std::size_t t = 0;
  for (const FluxField& field : now.flux) {
    result.emplace_back();
    for (const Tally& tally : field.tallies)
      result.back().push_back(response(model, points, flux, t++, tally.std_error, now.longest_dt));
  }
  return result;
}

// Beams are found without rays that could be fewer or more.
bool aims_at_position(const State& state, const Recipe& recipe) {
  const std::vector<Species> species = species_of(current_step(state, recipe));
  return recipe.position_error > 0 && std::ranges::any_of(species, [](const Species& each) {
           return each.source.kind != SourceLobe::Kind::beam;
         });
}

// The flux of a survey again, to the error that a rough one shows to be needed.
void refine_to_position(const State& state, const Recipe& recipe, Survey& result) {
  result.longest_dt = std::min(result.longest_dt, planned_time_step(state, recipe, result));
  FluxOptions options = recipe.flux;
  options.responses = responses(*current_step(state, recipe).model, result);
  options.target_error = recipe.position_error / std::sqrt(static_cast<double>(result.flux.size()));
  trace(state, recipe, options, result);
  find_speeds(state, recipe, result);
}

}  // namespace

const ProcessStep& current_step(const State& state, const Recipe& recipe) {
  return recipe.steps[std::min(state.step, recipe.steps.size() - 1)];
}

State start_state(const Recipe& recipe) {
  if (recipe.start) {
    const State& start = *recipe.start->state;
    return {.layers = start.layers.copy(),
            .origin = {start.time, start.time_step},
            .time = start.time,
            .step_start = start.time,
            .time_step = start.time_step,
            .voids = start.voids,
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

Survey survey(const State& state, const Recipe& recipe) {
  Survey result;
  if (const auto& model = current_step(state, recipe).model)
    result.longest_dt = model->longest_time_step();
  TriMesh surface = exposed_surface(state, recipe, result);
  result.facets = simplified(std::move(surface), state, recipe, result);
  FluxOptions options = recipe.flux;
  const bool refines = aims_at_position(state, recipe);
  if (refines) options.target_error = first_flux_error;
  trace(state, recipe, options, result);
  find_speeds(state, recipe, result);
  if (refines) refine_to_position(state, recipe, result);
  return result;
}

std::optional<double> position_error(const Survey& survey, double dt) {
  double squares = 0;
  bool was_target = false;
  for (const FluxField& field : survey.flux) {
    was_target = was_target || field.response_error;
    squares += std::pow(field.response_error.value_or(0), 2);
  }
  if (!was_target) return std::nullopt;
  return std::sqrt(squares) * dt / survey.longest_dt;
}

double next_output(const State& state, const Recipe& recipe) {
  const double every = recipe.output_every;
  if (every <= 0) return std::numeric_limits<double>::infinity();
  const double passed = std::floor(state.time / every * (1 + 1e-12));
  return (passed + 1) * every;
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
  changes.opened = state.voids.size() + changes.closed.size() - voids.size();
  state.voids = std::move(voids);
  return changes;
}

std::vector<float> facet_speeds(const State& state, const Survey& survey) {
  std::vector<float> speeds(survey.facets.triangles.size());
  if (survey.speeds_of_layers.empty()) return speeds;
  for (std::size_t f = 0; f < speeds.size(); ++f) {
    const std::size_t layer = layer_of(state, survey.facets.materials[f]);
    const auto& [a, b, c] = survey.speeds_of_layers[layer].speed[f];
    speeds[f] = (a + b + c) / 3;
  }
  return speeds;
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
  move.residue_volume = removed.residue_volume;
  count_islands(state, move.islands);
  state.residue_volume += move.residue_volume;

  state.coverages = coverages_of(survey, *step.model);
  state.time = move.dt == left ? target : state.time + move.dt;
  ++state.time_step;
  if (reached) state.progress.reached = state.time;
  if (state.time >= end_of_step(state, step)) end_step(state, step);
  return move;
}

bool ends_repeat(const State& state, const RoundEnd& round_end) {
  return distance_left(round_end.until, state.repeat_start, state.layers) <=
         end_tolerance * state.layers.frame.spacing;
}

bool finished(const State& state, const Recipe& recipe) {
  return state.step >= recipe.steps.size();
}

}  // namespace scarp
