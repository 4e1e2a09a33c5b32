#pragma once

#include <string>
#include <vector>

namespace scarp::bench {

/// The first time step of the default trench, on the threads that are allowed.
struct TimeStep {
  double cpu = 1e9;       ///< CPU seconds
  double flux_share = 1;  ///< of the wall time
};

/// The least of some runs. Overrides are those of the recipe, PATH=VALUE.
TimeStep first_time_step(const std::vector<std::string>& overrides, int repeats);

}  // namespace scarp::bench
