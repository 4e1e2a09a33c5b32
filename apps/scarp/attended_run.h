#pragma once

#include <filesystem>
#include <string>

#include "apps/run/run.h"
#include "apps/simulator/recipe.h"

namespace scarp {

/// How a run that somebody waits for behaves.
struct AttendedOptions {
  bool resume = false;
  bool quiet = false;  ///< no progress and no notes
  double memory_limit_mb = available_memory_mb();
};

/// Runs a recipe with its progress on standard error.
///
/// SIGINT, SIGTERM, SIGHUP and SIGXCPU let the time step end, then a checkpoint is written and the
/// run ends; a second SIGINT or SIGTERM ends the process at once. SIGUSR1 has a checkpoint written
/// after the time step, and the run goes on.
///
/// Throws: as run(); a full disk also says which command goes on.
RunEnd attended_run(Recipe recipe, const std::filesystem::path& folder,
                    const AttendedOptions& options);

/// Which command goes on with a run that was stopped; before its first state, that none does.
std::string how_to_go_on(const std::filesystem::path& folder);

}  // namespace scarp
