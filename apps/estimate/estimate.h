#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/estimate/memory_estimate.h"
#include "apps/simulator/recipe.h"
#include "apps/simulator/simplify_choice.h"
#include "core/log.h"

namespace scarp {

struct Survey;

/// When a step with an end condition is expected to meet it. Units: s from its beginning.
struct ExpectedEnd {
  std::size_t step = 0;
  double duration = 0;
};

/// What a run is going to cost, from the first time steps of every step with few rays: how long
/// they may be, what they take, and how the surface grows in them. Each is tried on the geometry
/// that it meets, as far as a CoarseRun gets.
///
/// Good to about a factor of two, where steps go on as they begin. What would take long to try is
/// tried on a coarser grid.
/// Units: heights in nm; seconds of wall time on this machine, with as many threads
///        as now: what the trials took for each time step, ray and output, times their
///        numbers.
struct CostEstimate {
  std::size_t active_nodes = 0;
  double lowest = 0;  ///< of the start geometry's band
  double highest = 0;
  std::size_t facets_full = 0;  ///< of the step that has most, as facets
  std::size_t facets = 0;
  double time_steps = 0;
  double rays_per_time_step = 0;  ///< mean over all of them
  /// How many times as many the target would take as the caps allow, in the step where it is most.
  double lacking_rays = 1;
  MemoryEstimate memory{};  ///< when it is most
  double seconds = 0;
  double flux_seconds = 0;  ///< of them those that fluxes take
  /// All rounds are counted of steps that repeat until a condition holds, which may end sooner.
  bool at_most = false;
  /// Of steps whose mesh is not simplified at their beginning, repeated ones once.
  std::vector<std::pair<std::size_t, SimplifyChoice>> left_out{};
  std::vector<ExpectedEnd> ends{};         ///< of steps with an end condition, repeated ones once
  std::vector<std::string> standstills{};  ///< what to say of steps that move nothing, likewise
  /// The same of those that use up a mask before the end that is expected of them; what the recipe
  /// alone tells is not repeated.
  std::vector<std::string> used_masks{};
};

/// Warns of fluxes that take longer than FluxPlan::warn_above to reach their target, with a target
/// that would not; nothing where they do not, or have none.
std::optional<std::string> expensive_flux_warning(const CostEstimate& cost, const FluxPlan& plan);

/// Says that the caps on rays will come before the recipe's target, and which target they reach.
std::optional<std::string> missed_target_warning(const CostEstimate& cost, const FluxPlan& plan);

/// Writes the files of an output somewhere.
using WriteOutput = std::function<void(const State&, const Survey&, const Recipe&)>;

/// Of a recipe as it runs: on a part of its domain where it uses symmetry (see on_part()). Where
/// that takes a while the log says what is tried. Without a way to write outputs these take no
/// time.
CostEstimate estimate_cost(const Recipe& recipe, const Log& log = {},
                           const WriteOutput& write_output = {});

}  // namespace scarp
