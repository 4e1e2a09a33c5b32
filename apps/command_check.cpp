#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/commands.h"
#include "apps/estimate.h"
#include "apps/recipe.h"

namespace scarp {

ExitCode execute(const CheckArguments& arguments, const CommonOptions& common) {
  const Recipe recipe = read_recipe(arguments.recipe, arguments.set);
  const CostEstimate cost = estimate_cost(recipe);
  if (common.json) {
    const nlohmann::ordered_json result{{"valid", true},
                                        {"recipe", recipe.resolved},
                                        {"active_nodes", cost.active_nodes},
                                        {"lowest_nm", cost.lowest},
                                        {"highest_nm", cost.highest},
                                        {"facets_full", cost.facets_full},
                                        {"facets", cost.facets},
                                        {"time_steps", cost.time_steps},
                                        {"rays_per_time_step", cost.rays_per_time_step},
                                        {"memory_mb", cost.memory_mb},
                                        {"seconds", cost.seconds}};
    std::cout << result.dump(2) << '\n';
    return done;
  }
  fmt::print("{}\n", recipe.resolved);
  fmt::print(
      "# Cost, good to about a factor of three, the memory better:\n"
      "#   grid        {} cells in the band, from z = {:.4g} nm to {:.4g} nm at the start\n"
      "#   facets      {} of {} after simplification\n"
      "#   time steps  {:.0f}\n"
      "#   rays        {:.2g} per time step on average\n"
      "#   memory      {:.0f} MB\n"
      "#   time        {:.0f} s on this machine\n"
      "# Results would go to {}\n",
      cost.active_nodes, cost.lowest, cost.highest, cost.facets, cost.facets_full, cost.time_steps,
      cost.rays_per_time_step, cost.memory_mb, cost.seconds, arguments.result_folder().string());
  return done;
}

}  // namespace scarp
