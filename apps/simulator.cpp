#include "apps/simulator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "flux/reconstruct.h"
#include "flux/solve.h"
#include "levelset/advect.h"
#include "levelset/extend.h"
#include "levelset/extract_surface.h"
#include "levelset/shapes.h"
#include "mesh/simplify.h"

namespace scarp {

namespace {

// Gas that no path joins to the source sees no particle and does not move: its surface is left out.
TriMesh exposed_surface(const State& state, const Recipe& recipe, Survey& result) {
  const auto measurement = result.timer.measure("surface");
  result.gas = open_gas(state.layers);
  TriMesh surface = extract_surface(state.layers, result.gas);
  if (surface.triangles.empty()) {
    throw NumericalError(
        fmt::format("time step {} of step \"{}\", t = {:g} s: no surface is left that the source "
                    "can see",
                    state.time_step, current_step(state, recipe).name, state.time));
  }
  result.vertices_full = surface.vertices.size();
  result.facets_full = surface.triangles.size();
  return surface;
}

TriMesh simplified(TriMesh surface, const Recipe& recipe, Survey& result) {
  const auto measurement = result.timer.measure("simplify");
  if (!recipe.simplify) return surface;
  SimplifyResult coarse = simplify(surface, *recipe.simplify);
  result.simplify_max_distance = coarse.max_distance;
  return std::move(coarse.mesh);
}

std::vector<FluxField> trace(const TriMesh& facets, const State& state, const Recipe& recipe,
                             StageTimer& timer) {
  const auto measurement = timer.measure("flux");
  const std::vector<Species> species = current_step(state, recipe).model->species();
  if (species.empty()) return {};
  FluxOptions options = recipe.flux;
  options.time_step = state.time_step;
  return solve_flux(facets, species, options);
}

// A model speaks of points: here the three corners of every facet, with the facet's own material
// and normal, so that speeds break where the surface does.
std::vector<std::array<float, 3>> speeds_at_corners(const TriMesh& facets,
                                                    std::span<const FluxField> flux,
                                                    const SurfaceModel& model) {
  const std::vector<Vec3f> facet_normal = facet_normals(facets);
  const std::size_t count = facets.triangles.size();
  std::vector<MaterialId> material(3 * count);
  std::vector<Vec3f> normal(3 * count);
  for (std::size_t p = 0; p < 3 * count; ++p) {
    material[p] = facets.materials[p / 3];
    normal[p] = facet_normal[p / 3];
  }
  std::vector<std::vector<std::array<float, 3>>> corner_flux;
  std::vector<std::span<const float>> views;
  for (const FluxField& field : flux) {
    corner_flux.push_back(corner_values(facets, field.arrivals().mean));
    views.emplace_back(corner_flux.back().data()->data(), 3 * count);
  }
  const std::vector<float> speeds = model.speeds({.material = material, .normal = normal}, views);
  std::vector<std::array<float, 3>> corner_speeds(count);
  for (std::size_t p = 0; p < 3 * count; ++p) corner_speeds[p / 3][p % 3] = speeds[p];
  return corner_speeds;
}

void require_finite(const Survey& survey, const State& state, const Recipe& recipe) {
  for (std::size_t f = 0; f < survey.corner_speeds.size(); ++f) {
    for (const float speed : survey.corner_speeds[f]) {
      if (std::isfinite(speed)) continue;
      const Vec3f r = survey.facets.vertices[survey.facets.triangles[f][0]];
      throw NumericalError(fmt::format(
          "time step {} of step \"{}\", t = {:g} s: speed is not finite on facet {} at ({:g}, "
          "{:g}, {:g}) nm, material {}",
          state.time_step, current_step(state, recipe).name, state.time, f, r.x, r.y, r.z,
          recipe.materials[survey.facets.materials[f]].name));
    }
  }
}

// The last two time steps before a limit share what is left, so that none is a tiny remainder.
double cut_to(double limit, double dt) {
  if (dt >= limit) return limit;
  return dt > 0.5 * limit ? 0.5 * limit : dt;
}

}  // namespace

const ProcessStep& current_step(const State& state, const Recipe& recipe) {
  return recipe.steps[std::min(state.step, recipe.steps.size() - 1)];
}

State start_state(const Recipe& recipe) {
  return {.layers = build_layers(recipe.frame, recipe.geometry)};
}

void begin_step(State& state, const Recipe& recipe) {
  const ProcessStep& step = current_step(state, recipe);
  if (step.deposits) add_layer(state.layers, *step.deposits);
}

Survey survey(const State& state, const Recipe& recipe) {
  Survey result;
  TriMesh surface = exposed_surface(state, recipe, result);
  result.facets = simplified(std::move(surface), recipe, result);
  result.flux = trace(result.facets, state, recipe, result.timer);
  result.corner_speeds =
      speeds_at_corners(result.facets, result.flux, *current_step(state, recipe).model);
  require_finite(result, state, recipe);
  return result;
}

Move advance(State& state, const Recipe& recipe, const Survey& survey, double time_limit) {
  const ProcessStep& step = current_step(state, recipe);
  Move move;
  const SpeedField band = [&] {
    const auto measurement = move.timer.measure("map");
    return extend_speeds(state.layers, survey.gas, survey.facets, survey.corner_speeds);
  }();

  // Moments are set, not summed, where one is hit: no rounding error can leave a remainder. An
  // output wanted within rounding of the end of a step is the end of the step.
  const double end = state.step_start + step.duration;
  const double target = time_limit < end - 1e-9 * step.duration ? time_limit : end;
  const double left = target - state.time;
  move.dt = cut_to(left, stable_time_step(state.layers, band, recipe.cfl));
  {
    const auto measurement = move.timer.measure("advect");
    advect(state.layers, band, move.dt);
  }

  state.time = move.dt == left ? target : state.time + move.dt;
  ++state.time_step;
  if (state.time == end) {
    state.step_start = end;
    ++state.step;
  }
  return move;
}

bool finished(const State& state, const Recipe& recipe) {
  return state.step >= recipe.steps.size();
}

}  // namespace scarp
