#include "apps/estimate.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "apps/expected_end.h"
#include "apps/simulator.h"
#include "core/peak_memory.h"
#include "models/open_response.h"

namespace scarp {

namespace {

constexpr std::uint64_t trial_rays = 1 << 16;

// What ions straight from the source bring to the slope on which their yield counts most.
double largest_yield(const YieldLaw& law, double energy) {
  double largest = 0;
  for (double cosine = 0.01; cosine < 1.005; cosine += 0.01)
    largest = std::max(largest, cosine * law.at(energy, AngleTable::half_sine(cosine)));
  return largest;
}

// Every material once, as a wafer that sees the whole source.
struct OpenWafers {
  std::vector<MaterialId> material;
  std::vector<Vec3f> normal;
  std::vector<std::vector<float>> flux;       // by tally
  std::vector<std::vector<float>> coverages;  // at the end of a cycle, if the model has phases

  SurfacePoints points() const {
    return {.material = material, .normal = normal, .coverages = coverages};
  }
  std::vector<std::span<const float>> tallies() const { return {flux.begin(), flux.end()}; }
};

void go_through_cycle(const SurfaceModel& model, OpenWafers& wafers) {
  const std::vector<double> phases = model.phases();
  if (phases.empty()) return;
  wafers.coverages.assign(model.coverages().size(), std::vector<float>(wafers.material.size()));
  for (std::size_t phase = 0; phase < phases.size(); ++phase)
    wafers.coverages =
        model.coverages_after(phases[phase], phase, wafers.points(), wafers.tallies());
}

// yield(species, law) is what ions bring of a yield.
template <class Yield>
OpenWafers open_wafers(const SurfaceModel& model, std::size_t material_count, const Yield& yield) {
  OpenWafers wafers;
  for (std::size_t m = 0; m < material_count; ++m)
    wafers.material.push_back(static_cast<MaterialId>(m));
  wafers.normal.assign(material_count, Vec3f{0, 0, 1});
  for (const Species& species : model.species()) {
    // What comes from the surface itself hinders at most.
    const bool from_above = species.source.kind != SourceLobe::Kind::none;
    wafers.flux.emplace_back(material_count, from_above ? 1.0F : 0.0F);
    // Of a beam, the part from which it is seen.
    if (species.source.kind == SourceLobe::Kind::beam)
      wafers.flux.emplace_back(material_count, 1.0F);
    for (const YieldLaw& law : species.yields)
      wafers.flux.emplace_back(material_count, static_cast<float>(yield(species, law)));
  }
  go_through_cycle(model, wafers);
  return wafers;
}

// The fastest that a step moves a surface that sees the whole source; with factors of the normal,
// the speed that limits the time step as much as their kinks do.
double top_speed(const SurfaceModel& model, std::size_t material_count) {
  const OpenWafers wafers =
      open_wafers(model, material_count, [](const Species& species, const YieldLaw& law) {
        return largest_yield(law, species.ions->energy.mean());
      });
  const std::vector<AngularFactor> factors = model.angular_factors();
  const std::vector<std::vector<float>> parts = model.amplitudes(wafers.points(), wafers.tallies());
  double top = 0;
  for (std::size_t m = 0; m < material_count; ++m) {
    double speed = std::abs(static_cast<double>(parts[0][m]));
    for (std::size_t k = 0; k < factors.size(); ++k)
      speed += factors[k].limiting_speed() * std::abs(static_cast<double>(parts[1 + k][m]));
    top = std::max(top, speed);
  }
  return top;
}

// The error falls with the root of the number of rays, or faster.
double ray_factor(const Survey& trial, const Recipe& recipe) {
  if (recipe.flux.rays > 0) return static_cast<double>(recipe.flux.rays) / trial_rays;
  double factor = 1;
  for (const FluxField& flux : trial.flux) {
    // Where all species are as far from a target in position as the worst one.
    const double target = flux.response_error ? recipe.position_error / std::sqrt(trial.flux.size())
                                              : recipe.flux.target_error;
    factor = std::max(factor, std::pow(flux.target_measure() / target, 2));
  }
  return factor;
}

// What one time step of a step of the recipe takes.
struct TimeStepCost {
  double rays = 0;
  double seconds = 0;
  double duration = 0;  ///< of the step
};

TimeStepCost time_step_cost(const Survey& trial, const Recipe& recipe) {
  // Mapping and advection together cost about eight times as much as extraction.
  constexpr double grid_part = 8;
  const double factor = ray_factor(trial, recipe);
  TimeStepCost cost{.seconds = (1 + grid_part) * trial.timer.seconds("surface") +
                               trial.timer.seconds("simplify") +
                               factor * trial.timer.seconds("flux")};
  for (const FluxField& flux : trial.flux) cost.rays += factor * static_cast<double>(flux.rays);
  return cost;
}

// What a run holds at once: what the trial did, and a time step's copies of the band.
double memory_mb(const Layers& layers) {
  constexpr double band_copies = 3;
  double band = 0;
  for (const Layer& layer : layers.stack) band += static_cast<double>(layer.phi.memory_bytes());
  return peak_memory_mb() + 1e-6 * band_copies * band;
}

}  // namespace

std::vector<float> open_wafer_speeds(const SurfaceModel& model, std::size_t material_count) {
  const OpenWafers wafers =
      open_wafers(model, material_count, [](const Species& species, const YieldLaw& law) {
        return OpenResponse(species, law).flat();
      });
  return model.speeds(wafers.points(), wafers.tallies());
}

double time_steps(const ProcessStep& step, double duration, const Recipe& recipe) {
  if (!step.model) return 1;
  const double cells =
      duration * top_speed(*step.model, recipe.materials.size()) / recipe.frame.spacing;
  const double at_least = std::ceil(duration / step.model->longest_time_step());
  // Bounds of factors are rounded.
  return std::max({1.0, at_least, std::ceil((1 - 1e-6) * cells / recipe.cfl)});
}

CostEstimate estimate_cost(const Recipe& recipe) {
  Recipe trial_recipe = recipe;
  trial_recipe.flux.rays = 0;
  trial_recipe.flux.max_rays = trial_rays;
  State state = start_state(recipe);
  CostEstimate cost;
  cost.lowest = state.layers.top().lower();
  cost.highest = state.layers.top().upper();

  // Repeated steps share their model: one trial is enough for all of them.
  std::map<const SurfaceModel*, TimeStepCost> known;
  double rays = 0;
  for (; state.step < recipe.steps.size(); ++state.step) {
    const ProcessStep& step = recipe.steps[state.step];
    const auto [entry, is_new] = known.try_emplace(step.model.get());
    if (is_new) {
      begin_step(state, recipe);
      const Survey trial = survey(state, trial_recipe);
      entry->second = time_step_cost(trial, recipe);
      entry->second.duration = expected_duration(step, state, trial);
      if (step.until) cost.ends.push_back({state.step, entry->second.duration});
      cost.facets_full = std::max(cost.facets_full, trial.facets_full);
      cost.facets = std::max(cost.facets, trial.facets.triangles.size());
    }
    const double count = time_steps(step, entry->second.duration, recipe);
    cost.time_steps += count;
    cost.seconds += count * entry->second.seconds;
    rays += count * entry->second.rays;
  }
  cost.rays_per_time_step = rays / cost.time_steps;
  for (const Layer& layer : state.layers.stack) cost.active_nodes += layer.phi.active_count();
  cost.memory_mb = memory_mb(state.layers);
  return cost;
}

}  // namespace scarp
