#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/estimate/blanket_rates.h"
#include "apps/estimate/estimate.h"
#include "apps/run/restart.h"
#include "apps/run/results.h"
#include "apps/run/tell.h"
#include "apps/scarp/commands.h"
#include "apps/simulator/recipe.h"
#include "apps/simulator/region_text.h"
#include "apps/simulator/symmetry.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/plain_number.h"
#include "core/printable.h"

namespace scarp {

namespace {

nlohmann::ordered_json ends_of(const CostEstimate& cost, std::span<const ProcessStep> steps,
                               const Materials& materials, const Frame& frame) {
  nlohmann::ordered_json ends = nlohmann::ordered_json::array();
  for (const ExpectedEnd& end : cost.ends) {
    const ProcessStep& step = steps[end.step];
    ends.push_back({{"step", end.step},
                    {"name", step.name},
                    {"until", text_of(*step.until, materials, frame)},
                    {"expected_s", end.duration},
                    {"longest_s", step.duration}});
  }
  return ends;
}

nlohmann::ordered_json left_out_of(const CostEstimate& cost,
                                   std::span<const ProcessStep> recipe_steps) {
  nlohmann::ordered_json steps = nlohmann::ordered_json::array();
  for (const auto& [step, choice] : cost.left_out)
    steps.push_back(
        {{"step", step}, {"name", recipe_steps[step].name}, {"reason", cell_of(choice)}});
  return steps;
}

void print_left_out(const CostEstimate& cost, std::span<const ProcessStep> steps) {
  for (const auto& [step, choice] : cost.left_out)
    fmt::print("# The mesh of step \"{}\" is not simplified: {}\n", steps[step].name,
               reason_of(choice));
}

nlohmann::ordered_json rates_of(std::span<const StepRates> all, std::span<const ProcessStep> steps,
                                const Materials& materials) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const StepRates& rates : all) {
    nlohmann::ordered_json speeds = nlohmann::ordered_json::object();
    nlohmann::ordered_json selectivities = nlohmann::ordered_json::object();
    for (const BlanketRate& rate : rates.rates) {
      const std::string& name = materials[rate.material].name;
      speeds[name] = rate.speed;
      if (const auto selectivity = rates.selectivity_to(rate)) selectivities[name] = *selectivity;
    }
    json.push_back({{"step", rates.step},
                    {"name", steps[rates.step].name},
                    {"rates_nm_s", speeds},
                    {"selectivity_to", selectivities}});
    const BlanketRate* const fastest = rates.fastest_etched();
    if (fastest != nullptr) json.back()["selectivity_of"] = materials[fastest->material].name;
  }
  return json;
}

void print_rates(std::span<const StepRates> all, std::span<const ProcessStep> steps,
                 const Materials& materials) {
  if (all.empty()) return;
  fmt::print("# Rates on an open flat wafer, and selectivities:\n");
  for (const StepRates& rates : all)
    fmt::print("#   {}: {}\n", steps[rates.step].name, text_of(rates, materials));
}

void print_ends(const CostEstimate& cost, std::span<const ProcessStep> steps,
                const Materials& materials, const Frame& frame) {
  if (cost.ends.empty()) return;
  fmt::print("# Ends of steps, extrapolated from the start geometry:\n");
  for (const ExpectedEnd& end : cost.ends) {
    const ProcessStep& step = steps[end.step];
    const bool is_known = end.duration < step.duration;
    fmt::print(
        "#   {}: {}{}, {}, at most {} s\n", step.name, text_of(*step.until, materials, frame),
        over_etch_text(*step.until),
        is_known ? fmt::format("after about {} s", plain_number(end.duration, 3)) : "not foreseen",
        plain_number(step.duration, 4));
  }
}

nlohmann::ordered_json names_of(const MirrorPlanes& planes) {
  nlohmann::ordered_json names = nlohmann::ordered_json::array();
  if (planes.across[0]) names.push_back("x = 0");
  if (planes.across[1]) names.push_back("y = 0");
  if (planes.diagonal) names.push_back("x = y");
  return names;
}

}  // namespace

ExitCode execute(const CheckArguments& arguments, const CommonOptions& common) {
  const Recipe recipe = read_runnable(arguments.recipe, arguments.set);
  const double memory_limit = arguments.memory_limit_mb();
  require_memory(least_memory(recipe), memory_limit, "at least");  // before it is taken here
  const FoundPlanes found = mirror_planes(recipe);
  const Log log =
      common.quiet || common.json ? Log(std::cerr, Log::Level::warnings) : Log(std::cerr);
  const CostEstimate cost = estimate_cost(on_part(recipe, found), log, write_trial_output);
  const std::vector<StepRates> rates = blanket_rates(recipe);
  std::vector<std::string> warnings = recipe.warnings;
  warnings.insert(warnings.end(), cost.standstills.begin(), cost.standstills.end());
  warnings.insert(warnings.end(), cost.used_masks.begin(), cost.used_masks.end());
  if (const auto warning = missed_target_warning(cost, recipe.flux)) warnings.push_back(*warning);
  if (const auto warning = expensive_flux_warning(cost, recipe.flux)) warnings.push_back(*warning);
  if (cost.memory.total() > memory_limit) {
    warnings.push_back(fmt::format("scarp run would refuse it: it takes {} of memory, {}",
                                   memory_text(cost.memory), memory_limit_text(memory_limit)));
  }
  for (const std::string& warning : warnings) tell(fmt::format("warning: {}\n", warning));
  if (common.json) {
    const nlohmann::ordered_json result{
        {"valid", true},
        {"warnings", warnings},
        {"recipe", recipe.resolved},
        {"active_nodes", cost.active_nodes},
        {"lowest_nm", cost.lowest},
        {"highest_nm", cost.highest},
        {"facets_full", cost.facets_full},
        {"facets", cost.facets},
        {"time_steps", cost.time_steps},
        {"rays_per_time_step", cost.rays_per_time_step},
        {"memory_mb", cost.memory.total()},
        {"memory_parts_mb",
         {{"program", cost.memory.program},
          {"grid", cost.memory.grid},
          {"mesh", cost.memory.mesh},
          {"flux", cost.memory.flux},
          {"output", cost.memory.output}}},
        {"seconds", cost.seconds},
        {"threads", thread_count()},
        {"at_most", cost.at_most},
        {"mirror_planes", names_of(found.planes)},
        {"simplify_left_out", left_out_of(cost, recipe.steps)},
        {"blanket_rates", rates_of(rates, recipe.steps, recipe.materials)},
        {"ends", ends_of(cost, recipe.steps, recipe.materials, recipe.domain.frame)}};
    std::cout << result.dump(2) << '\n';
    return done;
  }
  fmt::print("{}\n", recipe.resolved);
  if (const std::string text = symmetry_text(recipe.domain, found); !text.empty())
    fmt::print("# Symmetry: {}\n", text);
  print_left_out(cost, recipe.steps);
  print_rates(rates, recipe.steps, recipe.materials);
  print_ends(cost, recipe.steps, recipe.materials, recipe.domain.frame);
  const std::string seconds =
      cost.seconds < 10 ? fmt::format("{:.2g}", cost.seconds) : fmt::format("{:.0f}", cost.seconds);
  fmt::print(
      "# Cost, good to about a factor of two{}:\n"
      "#   grid        {} cells in the band, from z = {} nm to {} nm at the start\n"
      "#   facets      {} of {} after simplification\n"
      "#   time steps  {:.0f}\n"
      "#   rays        {:.2g} per time step on average\n"
      "#   memory      {}\n"
      "#   time        {} {} s on {} of this machine\n"
      "# Results would go to {}\n",
      cost.at_most ? "; counting all rounds of repeats with until" : "", cost.active_nodes,
      plain_number(cost.lowest, 4), plain_number(cost.highest, 4), cost.facets, cost.facets_full,
      cost.time_steps, cost.rays_per_time_step, memory_text(cost.memory),
      cost.at_most ? "at most about" : "about", seconds,
      counted(static_cast<std::size_t>(thread_count()), "thread"),
      shown(arguments.result_folder()));
  return done;
}

}  // namespace scarp
