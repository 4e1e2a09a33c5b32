#include "apps/estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "apps/expected_end.h"
#include "apps/simulator.h"
#include "core/peak_memory.h"
#include "levelset/extend.h"
#include "models/open_response.h"

namespace scarp {

namespace {

constexpr std::uint64_t trial_rays = 1 << 16;
constexpr double rounding = 1 - 1e-6;  // of speeds: what they make is no time step more
constexpr double least_area = 0.2;     // a surface that closes keeps a part of its size

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
  if (const auto solute = model.solute()) {
    wafers.flux.emplace_back();
    for (const Exchange& wafer : model.exchange(wafers.points()))
      wafers.flux.back().push_back(static_cast<float>(open_wafer_concentration(*solute, wafer)));
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

// A time step with few rays: what it took, and what it found.
struct TrialStep {
  double grid_seconds = 0;  ///< of all but the flux
  double flux_seconds = 0;
  double rays = 0;
  std::vector<double> missed{};  ///< error over its target, by species
  double stable_dt = 0;
  double time = 0;  ///< at its beginning
  double area = 0;  ///< of the surface then
};

// What the time steps of a step of the recipe take, and how the surface grows in it.
struct StepCost {
  double rays = 0;  ///< of one time step
  double seconds = 0;
  double stable_dt = 0;
  double growth = 0;  ///< of the area of the surface, nm^2/s over nm^2
  double duration = 0;
};

double area_of(const TriMesh& facets) {
  const std::vector<double> areas = facet_areas(facets);
  return std::accumulate(areas.begin(), areas.end(), 0.0);
}

TrialStep trial_step(const State& state, const Survey& now, const Recipe& recipe) {
  TrialStep trial{
      .grid_seconds = now.timer.seconds("surface") + now.timer.seconds("simplify"),
      .flux_seconds = now.timer.seconds("flux"),
      .stable_dt = stable_time_step(state.layers, now.speeds_of_layers, now.factors, recipe.cfl),
      .time = state.time,
      .area = area_of(now.facets)};
  for (const FluxField& flux : now.flux) {
    // Where all species are as far from a target in position as the worst one.
    const double target = flux.response_error ? recipe.position_error / std::sqrt(now.flux.size())
                                              : recipe.flux.target_error;
    trial.missed.push_back(flux.target_measure() / target);
    trial.rays += static_cast<double>(flux.rays);
  }
  return trial;
}

// How many times the rays of the last trial a target takes. The error falls with the root of their
// number, or faster: as from the trial before, which had fewer.
double ray_factor(std::span<const TrialStep> trials) {
  const TrialStep& last = trials.back();
  double factor = 1;
  for (std::size_t s = 0; s < last.missed.size(); ++s) {
    double power = 0.5;
    if (trials.size() > 1) {
      const TrialStep& before = trials[trials.size() - 2];
      const double fall = std::log(before.missed[s] / last.missed[s]);
      if (last.rays > 1.5 * before.rays)
        power = std::clamp(fall / std::log(last.rays / before.rays), 0.5, 1.0);
    }
    factor = std::max(factor, std::pow(last.missed[s], 1 / power));
  }
  return factor;
}

State copy_of(const State& state) {
  return {.layers = state.layers.copy(),
          .time = state.time,
          .step = state.step,
          .step_start = state.step_start,
          .progress = state.progress,
          .repeat_start = state.repeat_start,
          .time_step = state.time_step,
          .voids = state.voids,
          .coverages = state.coverages,
          .mesh = state.mesh};
}

// With at most so many rays.
Recipe with_few_rays(const Recipe& recipe, std::uint64_t count) {
  Recipe few = recipe;
  if (few.flux.rays > 0) few.flux.rays = std::min(few.flux.rays, count);
  few.flux.max_rays = std::min(few.flux.max_rays, count);
  return few;
}

// The first time steps of a step after the given survey, the last of them with more rays. What acts
// at once is not tried.
std::vector<TrialStep> rehearse(State state, const Recipe& recipe, const Recipe& few_rays,
                                Survey now) {
  constexpr std::size_t most_trials = 5;
  const Recipe more_rays = with_few_rays(recipe, 4 * trial_rays);
  const std::size_t step = state.step;
  std::vector<TrialStep> trials;
  while (true) {
    trials.push_back(trial_step(state, now, recipe));
    if (!recipe.steps[step].model) return trials;
    const Move move = advance(state, few_rays, now, std::numeric_limits<double>::infinity());
    trials.back().grid_seconds += move.timer.seconds("map") + move.timer.seconds("advect");
    if (trials.size() == most_trials || state.step != step) return trials;
    now = survey(state, trials.size() + 1 == most_trials ? more_rays : few_rays);
  }
}

// The first one finds caches and coverages empty, and edges sharper than they stay: it counts only
// where it is the only one.
StepCost cost_of(std::span<const TrialStep> trials, const Recipe& recipe) {
  if (trials.size() > 1) trials = trials.subspan(1);
  const TrialStep& first = trials.front();
  const TrialStep& last = trials.back();
  const bool is_fixed = recipe.flux.rays > 0 && last.rays > 0;
  const auto wanted =
      static_cast<double>(recipe.flux.rays) * static_cast<double>(last.missed.size());
  const double factor = is_fixed ? std::max(1.0, wanted / last.rays) : ray_factor(trials);
  StepCost cost{.rays = factor * last.rays,
                .seconds = factor * last.flux_seconds,
                .stable_dt = std::numeric_limits<double>::infinity()};
  for (const TrialStep& each : trials) {
    cost.seconds += each.grid_seconds / static_cast<double>(trials.size());
    cost.stable_dt = std::min(cost.stable_dt, each.stable_dt);
  }
  if (last.time > first.time)
    cost.growth = (last.area - first.area) / ((last.time - first.time) * first.area);
  return cost;
}

// With those that outputs cut short, and the speeds that are met or will be.
double time_steps(const ProcessStep& step, const StepCost& cost, const Recipe& recipe) {
  const double duration = cost.duration;
  const double between_outputs =
      recipe.output_every > 0 ? std::min(duration, recipe.output_every) : duration;
  const auto count = [&](double time) {
    return std::max(time_steps(step, time, recipe), std::ceil(rounding * time / cost.stable_dt));
  };
  if (!step.model || !(between_outputs > 0)) return 1;
  const double outputs = std::floor(duration / between_outputs);
  const double rest = duration - outputs * between_outputs;
  return outputs * count(between_outputs) + (rest > 1e-9 * duration ? count(rest) : 0);
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
  const double at_least = std::ceil(rounding * duration / step.model->longest_time_step());
  return std::max({1.0, at_least, std::ceil(rounding * cells / recipe.cfl)});
}

CostEstimate estimate_cost(const Recipe& recipe) {
  const Recipe few_rays = with_few_rays(recipe, trial_rays);
  State state = start_state(recipe);
  CostEstimate cost;
  cost.lowest = state.layers.top().lower();
  cost.highest = state.layers.top().upper();

  // Repeated steps share their model: one trial is enough for all of them.
  std::map<const SurfaceModel*, StepCost> known;
  double rays = 0;
  double area = 1;  // of the surface, in parts of that of the start
  for (; state.step < recipe.steps.size(); ++state.step) {
    const ProcessStep& step = recipe.steps[state.step];
    const auto [entry, is_new] = known.try_emplace(step.model.get());
    StepCost& of_step = entry->second;
    if (is_new) {
      begin_step(state, recipe);
      Survey first = survey(state, few_rays);
      const double duration = expected_duration(step, state, first);
      if (step.until) cost.ends.push_back({state.step, duration});
      cost.facets_full = std::max(cost.facets_full, first.facets_full);
      cost.facets = std::max(cost.facets, first.facets.triangles.size());
      of_step = cost_of(rehearse(copy_of(state), recipe, few_rays, std::move(first)), recipe);
      of_step.duration = duration;
    }
    const double count = time_steps(step, of_step, recipe);
    cost.at_most = cost.at_most || step.round_end;
    const double end_area = std::max(least_area, area + of_step.growth * of_step.duration);
    const double mean_area = 0.5 * (area + end_area);
    area = end_area;
    cost.time_steps += count;
    cost.seconds += count * mean_area * of_step.seconds;
    rays += count * mean_area * of_step.rays;
  }
  cost.rays_per_time_step = rays / cost.time_steps;
  for (const Layer& layer : state.layers.stack) cost.active_nodes += layer.phi.active_count();
  cost.memory_mb = memory_mb(state.layers);
  return cost;
}

}  // namespace scarp
