#pragma once

#include <cstdint>

#include "apps/recipe.h"

namespace scarp {

/// What a run is going to cost, from a short trial of every step's flux on the start geometry.
///
/// Good to about a factor of three: the surface changes while the recipe runs.
/// Units: heights in nm, seconds of wall time on this machine, memory in MB.
struct CostEstimate {
  std::size_t active_nodes = 0;
  double lowest = 0;  ///< of the start geometry's band
  double highest = 0;
  std::size_t facets_full = 0;  ///< of the step that has most, as facets
  std::size_t facets = 0;
  double time_steps = 0;
  double rays_per_time_step = 0;  ///< mean over all of them
  double memory_mb = 0;
  double seconds = 0;
};

/// About how many time steps a step takes, at the speed of a surface that sees the whole source.
double time_steps(const ProcessStep& step, const Recipe& recipe);

CostEstimate estimate_cost(const Recipe& recipe);

}  // namespace scarp
