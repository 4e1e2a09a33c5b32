#include "apps/estimate.h"

#include <algorithm>
#include <cmath>

#include "apps/simulator.h"

namespace scarp {

namespace {

constexpr std::uint64_t trial_rays = 1 << 16;

// The fastest that a step moves a surface that sees the whole source.
double top_speed(const SurfaceModel& model, std::size_t material_count) {
  std::vector<MaterialId> material(material_count);
  for (std::size_t m = 0; m < material_count; ++m) material[m] = static_cast<MaterialId>(m);
  const std::vector<Vec3f> up(material_count, Vec3f{0, 0, 1});
  const std::vector<float> full(material_count, 1.0F);
  const std::vector<std::span<const float>> flux(model.species().size(), full);
  double top = 0;
  for (const float speed : model.speeds({.material = material, .normal = up}, flux)) {
    top = std::max(top, std::abs(static_cast<double>(speed)));
  }
  return top;
}

double time_steps(const Recipe& recipe) {
  double count = 0;
  for (const ProcessStep& step : recipe.steps) {
    const double cells =
        step.duration * top_speed(*step.model, recipe.materials.size()) / recipe.frame.spacing;
    count += std::max(1.0, std::ceil(cells / recipe.cfl));
  }
  return count;
}

// The error falls with the root of the number of rays, or faster.
double ray_factor(const Survey& trial, const Recipe& recipe) {
  if (recipe.flux.rays > 0) return static_cast<double>(recipe.flux.rays) / trial_rays;
  double factor = 1;
  for (const FluxField& flux : trial.flux) {
    factor = std::max(factor, std::pow(flux.error / recipe.flux.target_error, 2));
  }
  return factor;
}

}  // namespace

CostEstimate estimate_cost(const Recipe& recipe) {
  Recipe trial_recipe = recipe;
  trial_recipe.flux.rays = 0;
  trial_recipe.flux.max_rays = trial_rays;
  State state = start_state(recipe);
  begin_step(state, recipe);
  const Survey trial = survey(state, trial_recipe);

  CostEstimate cost;
  for (const Layer& layer : state.layers.stack) {
    cost.active_nodes += layer.phi.active_count();
    cost.memory_mb += static_cast<double>(layer.phi.memory_bytes()) / 1e6;
  }
  cost.lowest = state.layers.top().lower();
  cost.highest = state.layers.top().upper();
  cost.facets_full = trial.facets_full;
  cost.facets = trial.facets.triangles.size();
  cost.time_steps = time_steps(recipe);
  const double factor = ray_factor(trial, recipe);
  for (const FluxField& flux : trial.flux) {
    cost.rays_per_time_step += factor * static_cast<double>(flux.rays);
  }
  // The full mesh with its half edges, the ray scene, and the ray pools.
  cost.memory_mb += 150 + 1e-6 * (500.0 * static_cast<double>(trial.facets_full) +
                                  400.0 * static_cast<double>(cost.facets));
  const double survey_seconds = trial.timer.seconds("surface") + trial.timer.seconds("simplify") +
                                factor * trial.timer.seconds("flux");
  // Mapping and advection cost about as much as extraction.
  cost.seconds = cost.time_steps * (survey_seconds + 2 * trial.timer.seconds("surface"));
  return cost;
}

}  // namespace scarp
