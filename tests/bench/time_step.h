#pragma once

#include <string>
#include <vector>

namespace scarp::bench {

// Time steps of the default trench, on the threads that are allowed.

/// CPU seconds of the first one, the least of some runs. Overrides are those of the recipe,
/// PATH=VALUE.
double first_time_step(const std::vector<std::string>& overrides, int repeats);

/// The part of the wall time of all of them that the flux takes.
double flux_share_of_run();

}  // namespace scarp::bench
