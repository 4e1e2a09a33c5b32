#include "apps/estimate/estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "apps/estimate/coarse_run.h"
#include "apps/estimate/expected_end.h"
#include "apps/simulator/flux_target.h"
#include "apps/simulator/recipe_warnings.h"
#include "apps/simulator/surface_speeds.h"
#include "core/error.h"
#include "core/plain_number.h"
#include "core/recipe/quantity.h"

namespace scarp {

namespace {

constexpr std::uint64_t trial_rays = 1 << 16;
constexpr std::uint64_t most_trial_rays = 1 << 19;  // half a second: enough for most targets
constexpr double rounding = 1 - 1e-6;  // of speeds: what they make is no time step more
constexpr double least_area = 0.2;     // a surface that closes keeps a part of its size

// A time step with few rays: what it took, and what it found.
struct TrialStep {
  double grid_seconds = 0;  ///< of all but the flux
  double flux_seconds = 0;
  double rays = 0;
  double kept_rays = 0;          ///< of them those whose hits are stored
  std::vector<double> missed{};  ///< error over its target, by species
  double dt = 0;
  double moves = 1;  ///< that the flux is carried for in it
  double time = 0;   ///< at its beginning
  double area = 0;   ///< of the surface then, in those of the domain
};

// What the time steps of a step of the recipe take, and how the surface grows in it.
struct StepCost {
  double rays = 0;     ///< of one time step
  double lacking = 1;  ///< how many times as many the target would take
  double kept_rays = 0;
  double seconds = 0;
  double flux_seconds = 0;  ///< of them
  double dt = 0;
  double moves = 1;
  double area = 0;    ///< of the surface that this is for, in those of the domain
  double growth = 0;  ///< of that in a second
  double duration = 0;
};

TrialStep trial_step(const State& state, const Survey& now, const FluxPlan& plan, double cfl) {
  TrialStep trial{
      .grid_seconds =
          now.timer.seconds("surface") + now.timer.seconds("simplify") + now.timer.seconds("map"),
      .flux_seconds = now.timer.seconds("flux"),
      .dt = now.longest_dt,
      .moves = std::max(1.0, now.longest_dt / stable_time_step(state.layers, now.speeds_of_layers,
                                                               now.factors, cfl)),
      .time = state.time,
      .area = area_of(now, state.layers.frame)};
  for (const FluxField& flux : now.flux) {
    // Where all species are as far from a target in position as the worst one.
    const double target = flux.response_error ? plan.position_error / std::sqrt(now.flux.size())
                                              : plan.options.target_error;
    trial.missed.push_back(flux.target_measure() / target);
    trial.rays += static_cast<double>(flux.rays);
    const bool keeps =
        flux.engine == FluxEngine::gather || flux.engine == FluxEngine::gather_forward;
    if (keeps) trial.kept_rays += static_cast<double>(flux.rays);
  }
  return trial;
}

// How many times the rays of the last trial a target takes. The error falls with the root of their
// number, or faster: as from the last trial that had fewer.
double ray_factor(std::span<const TrialStep> trials) {
  const TrialStep& last = trials.back();
  const auto before = std::find_if(trials.rbegin(), trials.rend(), [&](const TrialStep& each) {
    return last.rays > 1.5 * each.rays;
  });
  double factor = 1;
  for (std::size_t s = 0; s < last.missed.size(); ++s) {
    double power = 0.5;
    if (before != trials.rend()) {
      const double fall = std::log(before->missed[s] / last.missed[s]);
      power = std::clamp(fall / std::log(last.rays / before->rays), 0.5, 1.0);
    }
    factor = std::max(factor, std::pow(last.missed[s], 1 / power));
  }
  return factor;
}

// How many times the rays of a trial the caps allow.
double most_factor(const TrialStep& trial, const FluxOptions& options) {
  const auto species = static_cast<double>(trial.missed.size());
  const double by_number =
      static_cast<double>(options.max_rays) * species / std::max(trial.rays, 1.0);
  const double by_memory = static_cast<double>(options.memory_limit) / bytes_per_hit * species /
                           std::max(trial.kept_rays, 1.0);
  return std::max(1.0, std::min(by_number, by_memory));
}

// The first one finds caches and coverages empty, and edges sharper than they stay: it counts only
// where it is the only one.
StepCost cost_of(std::span<const TrialStep> trials, const FluxOptions& options) {
  if (trials.size() > 1) trials = trials.subspan(1);
  const TrialStep& first = trials.front();
  const TrialStep& last = trials.back();
  const bool is_fixed = options.rays > 0 && last.rays > 0;
  const auto wanted = static_cast<double>(options.rays) * static_cast<double>(last.missed.size());
  const double aimed = is_fixed ? std::max(1.0, wanted / last.rays) : ray_factor(trials);
  const double factor = is_fixed ? aimed : std::min(aimed, most_factor(last, options));
  StepCost cost{.rays = factor * last.rays,
                .lacking = aimed / factor,
                .kept_rays = factor * last.kept_rays,
                .seconds = factor * last.flux_seconds,
                .flux_seconds = factor * last.flux_seconds,
                .dt = 0,
                .moves = 0,
                .area = first.area};
  for (const TrialStep& each : trials)
    cost.seconds += each.grid_seconds / static_cast<double>(trials.size());
  // With one move, two and then more.
  const auto grown = trials.last(trials.size() > 2 ? trials.size() - 2 : 1);
  for (const TrialStep& each : grown) {
    cost.dt += each.dt / static_cast<double>(grown.size());
    cost.moves += each.moves / static_cast<double>(grown.size());
  }
  cost.moves = std::max(1.0, cost.moves);
  if (last.time > first.time) cost.growth = (last.area - first.area) / (last.time - first.time);
  return cost;
}

// Of a step that lies between two others.
StepCost between(const StepCost& before, const StepCost& after, double part) {
  const auto at = [&](double StepCost::*value) {
    return std::lerp(before.*value, after.*value, part);
  };
  return {.rays = at(&StepCost::rays),
          .lacking = at(&StepCost::lacking),
          .kept_rays = at(&StepCost::kept_rays),
          .seconds = at(&StepCost::seconds),
          .flux_seconds = at(&StepCost::flux_seconds),
          .dt = at(&StepCost::dt),
          .moves = at(&StepCost::moves),
          .area = at(&StepCost::area),
          .growth = at(&StepCost::growth),
          .duration = at(&StepCost::duration)};
}

double time_between_outputs(double duration, double every) {
  return every > 0 ? std::min(duration, every) : duration;
}

// How many more time steps some moves take since the first ones have one move, two, four, ...
double time_steps_to_begin_with(double moves, double at_most) {
  return std::log2(std::min(moves + 1, at_most)) - std::min(moves, at_most - 1) / at_most;
}

// With those that outputs cut short, and the speeds that are met or will be.
template <class Moves>
double time_steps(const ProcessStep& step, const StepCost& cost, double between_outputs,
                  const Moves& on_open_wafer) {
  const double duration = cost.duration;
  const auto moves = [&](double time) {
    return std::max(on_open_wafer(time), rounding * time / cost.dt * cost.moves);
  };
  const auto count = [&](double time, double to_begin_with) {
    return std::max(1.0, std::ceil(rounding * (to_begin_with + moves(time) / cost.moves)));
  };
  if (!step.model || !(between_outputs > 0)) return 1;
  const double outputs = std::floor(duration / between_outputs);
  const double rest = duration - outputs * between_outputs;
  const double first = time_steps_to_begin_with(moves(between_outputs), cost.moves);
  return count(between_outputs, first) + (outputs - 1) * count(between_outputs, 0) +
         (rest > 1e-9 * duration ? count(rest, 0) : 0);
}

// The steps to try: of those that share a model the first and the last one.
struct Trials {
  std::map<const SurfaceModel*, std::array<std::size_t, 2>> of_model;
  std::size_t last = 0;  ///< of all

  explicit Trials(std::span<const ProcessStep> steps) {
    for (std::size_t n = 0; n < steps.size(); ++n)
      of_model.try_emplace(steps[n].model.get(), std::array{n, n}).first->second[1] = n;
    for (const auto& [model, first_and_last] : of_model) last = std::max(last, first_and_last[1]);
  }

  bool has(std::size_t step, const SurfaceModel* model) const {
    const auto& [first, last] = of_model.at(model);
    return step == first || step == last;
  }
};

// Tries steps on the geometry that they meet, and goes by the area of the surface between them.
class Estimator {
 public:
  Estimator(Recipe recipe, const Log& log, const WriteOutput& write_output)
      : recipe_(std::move(recipe)),
        log_(log),
        write_output_(write_output),
        few_rays_(with_few_rays(recipe_, trial_rays)),
        trials_(recipe_.steps),
        state_(start_state(recipe_.domain.frame, recipe_.start)) {}

  CostEstimate estimate() {
    cost_.lowest = state_.layers.top().lower();
    cost_.highest = state_.layers.top().upper();
    for (const Layer& layer : state_.layers.stack) cost_.active_nodes += layer.phi.active_count();
    for (std::size_t n = 0; n < recipe_.steps.size(); ++n)
      if (trials_.has(n, recipe_.steps[n].model.get())) try_step(n);
    for (std::size_t n = 0; n < recipe_.steps.size(); ++n) add(n);
    for (const auto& [n, tried] : tried_) add_memory(n, tried);
    find_used_masks();
    cost_.rays_per_time_step = rays_ / cost_.time_steps;
    cost_.seconds += (1 + outputs_) * output_seconds_;
    return cost_;
  }

 private:
  // Where it is too far to go there, the geometry stays what it was, and is not tried twice.
  void try_step(std::size_t n) {
    const ProcessStep& step = recipe_.steps[n];
    const bool is_there = n == 0 || ahead_->reach(n);
    if (!is_there && n != trials_.of_model.at(step.model.get())[0]) return;
    if (n > 0) state_ = ahead_->state();
    state_.step = n;
    begin_step(state_, recipe_.steps);
    Survey first = survey(state_, few_rays_);
    constexpr std::chrono::milliseconds unnoticed{500};
    if (step.model && std::chrono::steady_clock::now() - began_ > unnoticed) {
      log_.info(fmt::format("tries the first time steps of step \"{}\" ({} of {})", step.name,
                            n + 1, recipe_.steps.size()));
    }
    if (n == 0 && trials_.last > 0)
      ahead_.emplace(recipe_, state_, time_steps_ahead() * CoarseRun::work(first));
    cost_.facets_full = std::max(cost_.facets_full, first.facets_full);
    cost_.facets = std::max(cost_.facets, first.facets.triangles.size());
    if (first.simplify_choice != SimplifyChoice::simplify)
      cost_.left_out.emplace_back(n, first.simplify_choice);
    const std::vector<float> speeds = facet_speeds(state_, first);
    const bool is_first = n == trials_.of_model.at(step.model.get())[0];
    if (step.model && is_first && std::ranges::count(speeds, 0.0F) == std::ssize(speeds)) {
      const auto& seen = first.facets.materials;
      cost_.standstills.push_back(
          standstill_text(step, {seen.begin(), seen.end()}, recipe_.materials));
    }
    output_seconds_ = seconds_of_output(first);
    const double duration = expected_duration(step, state_, first);
    const std::size_t first_facets_full = first.facets_full;
    const std::size_t first_facets = first.facets.triangles.size();
    if (step.until) cost_.ends.push_back({n, duration});
    StepCost& cost = known_[n];
    cost = cost_of(rehearse(copy_of(state_), std::move(first)), recipe_.flux.options);
    cost.duration = duration;
    tried_[n] = {state_.layers.copy(), static_cast<double>(first_facets_full),
                 static_cast<double>(first_facets)};
  }

  // On an open flat wafer, of the steps that a CoarseRun may go through.
  double time_steps_ahead() const {
    double count = 0;
    for (std::size_t n = 0; n < trials_.last; ++n)
      count += open_time_steps(recipe_.steps[n], recipe_.steps[n].duration);
    return count;
  }

  double open_time_steps(const ProcessStep& step, double duration) const {
    return time_steps(step, duration, recipe_.longest_move(), recipe_.materials.size());
  }

  double seconds_of_output(const Survey& now) const {
    if (!write_output_) return 0;
    const auto start = std::chrono::steady_clock::now();
    write_output_(state_, now, recipe_);
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
    return wall.count();
  }

  // The first time steps of a step after the given survey, half of them with more rays: how far a
  // time step goes depends on noise, too. Where they take long, fewer have to do. What acts at once
  // is not tried.
  std::vector<TrialStep> rehearse(State state, Survey now) const {
    constexpr std::size_t most_trials = 8;
    const Recipe more_rays = with_few_rays(recipe_, most_trial_rays);
    constexpr std::size_t least_trials = 3;
    constexpr std::chrono::seconds long_enough{3};
    const std::size_t step = state.step;
    const auto start = std::chrono::steady_clock::now();
    std::vector<TrialStep> trials;
    while (true) {
      trials.push_back(trial_step(state, now, recipe_.flux, recipe_.advection.cfl));
      if (!recipe_.steps[step].model) return trials;
      const Move move = advance(state, few_rays_, now, std::numeric_limits<double>::infinity());
      trials.back().grid_seconds += move.timer.seconds("map") + move.timer.seconds("advect");
      if (state.step != step) return trials;
      trials.back().moves *= move.dt / trials.back().dt;
      trials.back().dt = move.dt;
      const auto taken = std::chrono::steady_clock::now() - start;
      if (trials.size() == most_trials || (trials.size() >= least_trials && taken > long_enough))
        return trials;
      now = survey(state, 2 * trials.size() >= most_trials ? more_rays : few_rays_);
    }
  }

  // As the step was tried; between two that were, by the way from one to the other.
  StepCost cost_of_step(std::size_t n) const {
    const auto& [first, last] = trials_.of_model.at(recipe_.steps[n].model.get());
    const StepCost& before = known_.at(first);
    if (n == first || !known_.contains(last)) return before;
    const StepCost& after = known_.at(last);
    const double part = static_cast<double>(n - first) / static_cast<double>(last - first);
    return between(before, after, part);
  }

  void add(std::size_t n) {
    const ProcessStep& step = recipe_.steps[n];
    const StepCost of_step = cost_of_step(n);
    const double between_outputs = time_between_outputs(of_step.duration, recipe_.outputs.every);
    const double count = time_steps(step, of_step, between_outputs,
                                    [&](double time) { return open_time_steps(step, time); });
    if (ahead_ && n < ahead_->areas().size()) area_ = ahead_->areas()[n];
    if (known_.contains(n)) area_ = of_step.area;
    const double end_area =
        std::max(least_area * of_step.area, area_ + of_step.growth * of_step.duration);
    const double of_area = 0.5 * (area_ + end_area) / of_step.area;
    area_ = end_area;
    rays_ += count * of_area * of_step.rays;
    cost_.time_steps += count;
    cost_.lacking_rays = std::max(cost_.lacking_rays, of_step.lacking);
    outputs_ += of_step.duration > 0 ? std::ceil(rounding * of_step.duration / between_outputs) : 1;
    cost_.seconds += count * of_area * of_step.seconds;
    cost_.flux_seconds += count * of_area * of_step.flux_seconds;
    cost_.at_most = cost_.at_most || step.round_end;
  }

  // What a step was tried on.
  struct Tried {
    Layers layers;
    double facets_full = 0;
    double facets = 0;
  };

  void find_used_masks() {
    std::map<std::size_t, double> ends;
    for (std::size_t n = 0; n < recipe_.steps.size(); ++n) {
      const double duration = cost_of_step(n).duration;
      if (recipe_.steps[n].until && duration < recipe_.steps[n].duration) ends[n] = duration;
    }
    const auto used_with = [&](const std::map<std::size_t, double>& known_ends) {
      return used_masks(recipe_.start.shapes, recipe_.steps, recipe_.materials, known_ends);
    };
    const std::vector<UsedMask> known = used_with({});
    for (const UsedMask& used : used_with(ends)) {
      const auto is_this = [&](const UsedMask& each) { return each.step == used.step; };
      if (std::ranges::none_of(known, is_this))
        cost_.used_masks.push_back(
            fmt::format("step \"{}\" {}", recipe_.steps[used.step].name, used.text));
    }
  }

  // As the surface is when it is largest.
  void add_memory(std::size_t n, const Tried& tried) {
    const StepCost& step = known_.at(n);
    const double growth = std::max(1.0, 1 + step.growth * step.duration / step.area);
    const MemoryEstimate memory =
        expected_memory(tried.layers, recipe_.steps,
                        {.facets_full = growth * tried.facets_full,
                         .facets = growth * tried.facets,
                         .kept_rays = growth * step.kept_rays,
                         .memory_limit = recipe_.flux.options.memory_limit,
                         .outputs = outputs_});
    if (memory.total() > cost_.memory.total()) cost_.memory = memory;
  }

  Recipe recipe_;
  Log log_;
  const WriteOutput& write_output_;
  const std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  Recipe few_rays_;
  Trials trials_;
  State state_;
  std::optional<CoarseRun> ahead_;
  std::map<std::size_t, StepCost> known_;  // by step
  std::map<std::size_t, Tried> tried_;     // likewise
  double area_ = 0;                        // of the surface, as it is expected
  double rays_ = 0;
  double outputs_ = 0;
  double output_seconds_ = 0;  // of one
  CostEstimate cost_;
};

}  // namespace

std::optional<std::string> missed_target_warning(const CostEstimate& cost, const FluxPlan& plan) {
  constexpr double certain = 2;  // estimates are good to that
  if (cost.lacking_rays < certain) return std::nullopt;
  const WantedError wanted = wanted_error(plan);
  return fmt::format(
      "{}: {} is out of reach: it takes about {:.2g} times the rays that flux.max_rays ({}) and "
      "flux.memory_limit allow; raise them, or the target to {:.2g}",
      wanted.key(), wanted.text(wanted.value), cost.lacking_rays, plan.options.max_rays,
      wanted.value * std::sqrt(cost.lacking_rays));
}

std::optional<std::string> expensive_flux_warning(const CostEstimate& cost, const FluxPlan& plan) {
  const WantedError wanted = wanted_error(plan);
  if (wanted.value == 0 || cost.flux_seconds <= plan.warn_above) return std::nullopt;
  // The time goes with the inverse square of the target.
  const double affordable = wanted.value * std::sqrt(cost.flux_seconds / plan.warn_above);
  return fmt::format(
      "{}: {} takes about {:.2g} rays per time step and {} on this machine, more than "
      "flux.warn_above ({}); {:.2g}{} would not",
      wanted.key(), wanted.text(wanted.value), cost.rays_per_time_step,
      plain_duration(cost.flux_seconds), format_quantity(plan.warn_above, Dimension::time),
      1.1 * affordable, wanted.in_position ? " nm" : "");
}

namespace {

// What is tried on a grid of more columns of nodes than can be tried in seconds, on one that is
// coarser by this factor.
int coarsening(const Frame& frame) {
  constexpr double most_columns = 3e5;
  if (frame.is_section()) return 1;
  const double columns = static_cast<double>(frame.cells[0]) * frame.cells[1];
  int factor = 1;
  for (int k = 2; columns > most_columns * factor * factor && k < 64; ++k)
    if (divides(k, frame)) factor = k;
  return factor;
}

// As the number of facets goes with the square of the factor, and that of time steps with it.
CostEstimate refined(CostEstimate cost, int factor) {
  const double square = static_cast<double>(factor) * factor;
  for (std::size_t* count : {&cost.active_nodes, &cost.facets_full, &cost.facets})
    *count = static_cast<std::size_t>(square * static_cast<double>(*count));
  for (double* value : {&cost.rays_per_time_step, &cost.memory.grid, &cost.memory.mesh,
                        &cost.memory.flux, &cost.memory.output})
    *value *= square;
  cost.time_steps *= factor;
  cost.seconds *= square * factor;
  cost.flux_seconds *= square * factor;
  return cost;
}

}  // namespace

CostEstimate estimate_cost(const Recipe& recipe, const Log& log, const WriteOutput& write_output) {
  const int factor = recipe.start.state ? 1 : coarsening(recipe.domain.frame);
  if (factor > 1) {
    try {
      return refined(Estimator(coarser(recipe, factor), log, write_output).estimate(), factor);
    } catch (const InputError&) {
      // Shapes may be too narrow for a coarser grid.
    }
  }
  return Estimator(recipe, log, write_output).estimate();
}

}  // namespace scarp
