#include "apps/simulator/survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/simulator/coverage_cycle.h"
#include "apps/simulator/region_text.h"
#include "apps/simulator/surface_speeds.h"
#include "core/error.h"
#include "flux/engines/kept_hits.h"
#include "flux/solve.h"
#include "levelset/bath/diffusion.h"
#include "levelset/grid/exposure.h"
#include "levelset/surface/extract_surface.h"
#include "mesh/diagonal_cut.h"
#include "mesh/simplify/simplify.h"

namespace scarp {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// For which a flux is carried on the surface: closest places on facets further away tell less,
// least where speeds depend on the normal: a floor that sinks by more than a spacing leaves walls
// behind that know only of its edge. After four moves at a time holes of SF6/O2, six spacings wide,
// were most of a spacing deeper and a quarter of one narrower at their end than after one; after
// two as deep, and up to a sixth narrower.
constexpr double most_moves = 4;
constexpr double most_moves_with_factors = 2;

// Voids are below the surface, too, but no solid.
double solid_volume(const TriMesh& surface, const OpenGas& gas, const Frame& frame) {
  double volume = 0;
  for (std::size_t f = 0; f < surface.triangles.size(); ++f) {
    const auto [a, b, c] = corners(surface, f);
    const double around = frame.around((a.x + b.x + c.x) / 3);
    volume += around * (a.z + b.z + c.z) / 3 * area_vector(surface, f).z;
  }
  return frame.facet_images() * volume - volume_of(gas.voids);
}

// Gas that no path joins to the source sees no particle and does not move: its surface is left out.
TriMesh exposed_surface(const State& state, Survey& result) {
  const auto measurement = result.timer.measure("surface");
  std::vector<Region> known;
  for (const VoidClosure& each : state.voids) known.push_back(each.region);
  result.gas = open_gas(state.layers, known);
  TriMesh surface = extract_surface(state.layers, result.gas);
  const Frame& frame = state.layers.frame;
  const Sides sides = frame.sides();
  if (sides.diagonal) surface = below_diagonal(surface, sides, frame.spacing);
  if (surface.triangles.empty()) {
    throw NumericalError("no surface is left that the source can see");
  }
  result.vertices_full = surface.vertices.size();
  result.facets_full = surface.triangles.size();
  result.extent = bounding_box(surface);
  result.volume = solid_volume(surface, result.gas, frame);
  return surface;
}

// How far the facets may lie from the surface; a film loses none of its thickness by those that it
// is seen on. Units: nm.
double simplify_bound(const Layers& layers, const Simplification& simplification,
                      SimplifyChoice choice) {
  constexpr double part_of_film = 0.05;
  constexpr float least_film = 0.5F;  // spacings
  if (!simplification.options || choice != SimplifyChoice::simplify) return 0;
  const double of_film = part_of_film * thinnest_film(layers, least_film);
  return std::min(simplification.options->max_error.value_or(infinity), of_film);
}

std::vector<Species> species_of(const ProcessStep& step) {
  return step.model ? step.model->species() : std::vector<Species>{};
}

// Where all rays that were sent can serve again. Elsewhere there is little to win, and fluxes of a
// surface that was a tenth of a spacing further out etch a Bosch trench less below its mask, by
// 0.08 spacings a cycle.
bool keeps_hits(const ProcessStep& step, FluxOptions::Engine engine) {
  const std::vector<Species> species = species_of(step);
  return !species.empty() && engine != FluxOptions::Engine::forward &&
         std::ranges::all_of(species, can_keep_hits);
}

// The mesh of the time step before, with the materials that are seen now, if it is as good as one
// that is made now.
bool keep_mesh(const TriMesh& surface, const KeptMesh& kept, double within, Survey& result) {
  if (kept.facets.triangles.empty() || kept.bound > result.simplify_bound) return false;
  auto materials = materials_if_close(kept.facets, surface, kept.bound + within);
  if (!materials) return false;
  result.facets = kept.facets;
  result.facets.materials = std::move(*materials);
  result.made_at = kept.made_at;
  result.simplify_bound = kept.bound;
  result.simplify_max_distance = kept.max_distance;
  // Most meshes serve once: theirs are not worth the memory. Those of the state stay as they are.
  result.hits = kept.hits ? std::make_shared<KeptHits>(*kept.hits) : std::make_shared<KeptHits>();
  result.tree = kept.tree;
  return true;
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
    return model.emitter()->emission(
        {.material = facets.materials, .normal = normals, .coverages = coverages}, flux);
  };
  return emission;
}

// Sticking and emission follow the coverages, of a balance or of a cycle.
template <class Coverages>
std::vector<FluxField> solve_with(Coverages& coverages, std::span<const Species> species,
                                  const FluxOptions& options, const SurfaceModel& model,
                                  Survey& result) {
  std::vector<FluxField> flux = solve_flux(
      result.facets, species, options, coverages.feedback(),
      emission_from(result.facets, model, species, coverages.coverages()), result.hits.get());
  const int before = result.coverage_fit.iterations;
  result.coverages = coverages.coverages();
  result.coverage_fit = coverages.fit();
  result.coverage_fit.iterations += before;
  return flux;
}

// Particles that slip through the surface make every number wrong without showing it.
void require_nothing_lost(std::span<const FluxField> flux) {
  constexpr double most_lost = 1e-4;
  for (const FluxField& field : flux) {
    const double lost = field.audit.emitted > 0 ? field.audit.lost() / field.audit.emitted : 0;
    if (lost <= most_lost) continue;
    throw NumericalError(fmt::format(
        "{:.2g} of the particles were lost at the surface, more than {:g} is not trusted; please "
        "report it with the recipe",
        lost, most_lost));
  }
}

// The concentration in a bath as the flux that it is in place of: without rays and errors.
FluxField dissolved(const State& state, const Bath& bath, const TriMesh& facets) {
  const std::vector<Vec3f> normals = facet_normals(facets);
  const std::vector<Exchange> exchange =
      bath.exchange({.material = facets.materials, .normal = normals});
  Concentration concentration = diffuse(state.layers, facets, exchange, bath.solute());
  FluxField field;
  field.tallies.push_back({.mean = std::move(concentration.at_facets),
                           .std_error = std::vector<float>(facets.triangles.size())});
  field.audit = {.emitted = concentration.released,
                 .absorbed = concentration.settled,
                 .escaped = concentration.escaped};
  return field;
}

// Of the flux that tells what the wanted error of the position asks for.
constexpr double first_flux_error = 0.1;

// As far as the flux is carried on the surface as it moves: at least through one move, and so far
// that what it will have changed by then, as far as that is known, moves it by no more than was
// asked for.
double longest_time_step(const State& state, double cfl, double carry_within, const Survey& now) {
  const double stable = stable_time_step(state.layers, now.speeds_of_layers, now.factors, cfl);
  if (!now.change) return stable;
  const double within = std::sqrt(2 * carry_within / now.change->typical);
  const double moves = now.factors.empty() ? most_moves : most_moves_with_factors;
  return std::clamp(std::min(within, 2 * state.earlier.dt), stable, moves * stable);
}

// How far a unit of a tally moves each facet in a time step, by differences about the flux that is
// known, as wide as its error. Not finite where a formula has a pole there. Units: nm.
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
    result[f] = static_cast<float>(dt * slope);
  }
  return result;
}

// Leaves out what no number of rays helps.
void leave_out_poles(std::vector<float>& response, std::vector<bool>& has_pole) {
  for (std::size_t f = 0; f < response.size(); ++f) {
    if (std::isfinite(response[f])) continue;
    response[f] = 0;
    has_pole[f] = true;
  }
}

// Of all tallies, by species.
std::vector<std::vector<std::vector<float>>> responses(const SurfaceModel& model, Survey& now) {
  const std::vector<Vec3f> normals = facet_normals(now.facets);
  const SurfacePoints points{.material = now.facets.materials, .normal = normals};
  const std::vector<std::span<const float>> flux = tallies_on_facets(now.flux);
  std::vector<std::vector<std::vector<float>>> result;
  std::vector<bool> has_pole(now.facets.triangles.size());
  std::size_t t = 0;
  for (const FluxField& field : now.flux) {
    result.emplace_back();
    for (const Tally& tally : field.tallies) {
      result.back().push_back(response(model, points, flux, t++, tally.std_error, now.planned_dt));
      leave_out_poles(result.back().back(), has_pole);
    }
  }
  now.facets_with_pole = static_cast<std::size_t>(std::ranges::count(has_pole, true));
  return result;
}

// Beams are found without rays that could be fewer or more.
bool aims_at_position(const ProcessStep& step, const FluxPlan& plan) {
  const std::vector<Species> species = species_of(step);
  return plan.position_error > 0 && std::ranges::any_of(species, [](const Species& each) {
           return each.source.kind != SourceLobe::Kind::beam;
         });
}

// Beams are found quickly, and their shadows have sharp edges.
bool carries_flux(const Survey& survey, const FluxPlan& plan) {
  const auto is_beam = [](const FluxField& field) { return field.engine == FluxEngine::beam; };
  return plan.carry_within > 0 && !std::ranges::all_of(survey.flux, is_beam);
}

// The stages of a survey, each with what the ones before it found.
class Surveyor {
 public:
  Surveyor(const State& state, const Recipe& recipe)
      : state_(state), recipe_(recipe), step_(current_step(state, recipe.steps)) {
    if (step_.model && step_.model->cycle() != nullptr)
      result_.longest_dt = step_.model->cycle()->longest_time_step();
  }

  Survey survey() {
    make_facets(exposed_surface(state_, result_));
    result_.facet_distance = result_.simplify_bound + recipe_.flux.keep_mesh_within;
    FluxOptions options = recipe_.flux.options;
    const bool refines = aims_at_position(step_, recipe_.flux);
    if (refines) options.target_error = first_flux_error;
    trace(options);
    look_ahead();
    if (refines) refine_to_position();
    return std::move(result_);
  }

 private:
  void make_facets(TriMesh surface) {
    find_facets(std::move(surface));
    if (result_.tree) return;
    const auto measurement = result_.timer.measure("map");
    result_.tree = std::make_shared<const TriangleTree>(result_.facets);
  }

  void find_facets(TriMesh surface) {
    const auto measurement = result_.timer.measure("simplify");
    const Simplification& simplification = recipe_.simplification;
    result_.simplify_choice = simplify_choice(simplification, step_, result_.facets_full);
    result_.simplify_bound = simplify_bound(state_.layers, simplification, result_.simplify_choice);
    const double within = recipe_.flux.keep_mesh_within;
    if (within > 0 && keeps_hits(step_, recipe_.flux.options.engine) &&
        keep_mesh(surface, state_.mesh, within, result_)) {
      return;
    }
    result_.made_at = state_.time_step;
    result_.facets = std::move(surface);
    if (!simplification.options || result_.simplify_choice != SimplifyChoice::simplify) return;
    SimplifyOptions options = *simplification.options;
    if (options.max_error) options.max_error = result_.simplify_bound;
    SimplifyResult coarse = simplify(result_.facets, options);
    result_.simplify_max_distance = coarse.max_distance;
    result_.facets = std::move(coarse.mesh);
  }

  void trace(FluxOptions options) {
    const auto measurement = result_.timer.measure("flux");
    if (step_.model && step_.model->bath() != nullptr) {
      result_.flux = {dissolved(state_, *step_.model->bath(), result_.facets)};
      return;
    }
    const std::vector<Species> species = species_of(step_);
    if (species.empty()) return;
    options.time_step = result_.made_at;
    std::vector<FluxField> flux = solve_covered(species, options);
    for (std::size_t i = 0; i < result_.flux.size(); ++i) {
      flux[i].rays += result_.flux[i].rays;
      flux[i].segments += result_.flux[i].segments;
    }
    result_.flux = std::move(flux);
    require_nothing_lost(result_.flux);
  }

  // The flux on a surface that it covers; where it was solved before, on from the coverages then.
  std::vector<FluxField> solve_covered(std::span<const Species> species,
                                       const FluxOptions& options) {
    const SurfaceModel& model = *step_.model;
    const TriMesh& facets = result_.facets;
    if (model.coverages() == nullptr)
      return solve_flux(facets, species, options, {},
                        emission_from(facets, model, species, result_.coverages),
                        result_.hits.get());
    if (model.cycle() != nullptr) {
      CoverageCycle cycle(*model.cycle(), facets, recipe_.flux.coverages);
      return solve_with(cycle, species, options, model, result_);
    }
    if (result_.coverages.empty() && state_.coverages.names == coverage_names(&model))
      carry_coverages();
    CoverageIteration iteration(*model.balance(), facets, result_.coverages,
                                recipe_.flux.coverages);
    return solve_with(iteration, species, options, model, result_);
  }

  void carry_coverages() {
    const Frame& frame = state_.layers.frame;
    const double reach = (1 + most_moves * recipe_.advection.cfl) * frame.spacing;
    result_.coverages =
        carried(state_.coverages.values, state_.mesh.facets, result_.facets, reach, frame);
    result_.carried_areas = covered_areas(areas_around(result_.facets, frame), result_.coverages);
  }

  // Speeds, and how far they carry.
  void look_ahead() {
    const double carry_within = recipe_.flux.carry_within;
    find_speeds(state_, step_, recipe_.materials, result_);
    if (carry_within > 0) find_change(state_, step_, result_);
    const double longest = longest_time_step(state_, recipe_.advection.cfl, carry_within, result_);
    result_.longest_dt = std::min(result_.longest_dt, longest);
  }

  // The flux again, to the error that a rough one shows to be needed.
  void refine_to_position() {
    const double end = next_moment(state_, step_, next_output(state_, recipe_.outputs.every));
    result_.planned_dt = cut_to(end - state_.time, result_.longest_dt);
    FluxOptions options = recipe_.flux.options;
    options.responses = responses(*step_.model, result_);
    options.target_error =
        recipe_.flux.position_error / std::sqrt(static_cast<double>(result_.flux.size()));
    trace(options);
    look_ahead();
  }

  const State& state_;
  const Recipe& recipe_;
  const ProcessStep& step_;
  Survey result_;
};

}  // namespace

KeptMesh mesh_of(const Survey& survey, const FluxPlan& plan) {
  const bool is_needed =
      plan.keep_mesh_within > 0 || carries_flux(survey, plan) || !survey.coverages.empty();
  if (!is_needed) return {};
  return {.facets = survey.facets,
          .made_at = survey.made_at,
          .bound = survey.simplify_bound,
          .max_distance = survey.simplify_max_distance,
          .hits = survey.hits,
          .tree = survey.tree};
}

EarlierFlux earlier_flux(const Survey& survey, const FluxPlan& plan, double dt) {
  if (!carries_flux(survey, plan)) return {};
  EarlierFlux earlier{.dt = dt};
  for (const std::span<const float> tally : tallies_on_facets(survey.flux))
    earlier.tallies.emplace_back(tally.begin(), tally.end());
  return earlier;
}

SurfaceCoverages coverages_of(const Survey& survey, const SurfaceModel& model) {
  if (survey.coverages.empty()) return {};
  return {.names = coverage_names(&model), .values = survey.coverages};
}

Survey survey(const State& state, const Recipe& recipe) {
  try {
    return Surveyor(state, recipe).survey();
  } catch (const NumericalError& error) {
    throw NumericalError(fmt::format("time step {} of step \"{}\", t = {:g} s: {}", state.time_step,
                                     current_step(state, recipe.steps).name, state.time,
                                     error.what()));
  }
}

std::optional<double> position_error(const Survey& survey, double dt) {
  double squares = 0;
  bool was_target = false;
  for (const FluxField& field : survey.flux) {
    was_target = was_target || field.response_error;
    squares += std::pow(field.response_error.value_or(0), 2);
  }
  if (!was_target) return std::nullopt;
  return std::sqrt(squares) * dt / survey.planned_dt;
}

}  // namespace scarp
