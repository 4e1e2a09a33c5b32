#pragma once

#include <filesystem>
#include <string>

#include "apps/simulator/recipe.h"
#include "flux/flux_field.h"

namespace scarp {

/// The error that a recipe asks for; 0 where flux.rays takes its place.
struct WantedError {
  bool in_position = false;
  double value = 0;

  std::string key() const { return in_position ? "flux.position_error" : "flux.target_error"; }
  /// With its unit.
  std::string text(double error) const;
};
WantedError wanted_error(const FluxPlan& plan);

/// How the fluxes of a run kept to it.
struct FluxTarget {
  WantedError wanted;
  double largest = 0;  ///< error of all time steps
  std::size_t missed = 0;
  std::size_t time_steps = 0;
};

/// Throws: InputError if metrics.csv cannot be read.
FluxTarget flux_target(const std::filesystem::path& metrics, const FluxPlan& plan);

/// What users call what may end the search for a target.
struct TargetKeys {
  std::string max_rays = "flux.max_rays";
  std::string memory_limit = "flux.memory_limit";  ///< empty where they cannot raise it
  std::string engine = "flux.engine";
  std::string target = "flux.target_error";
};

/// Which cap came before the target, and what to do about it.
std::string missed_target_text(const FluxField& flux, const FluxOptions& options,
                               const TargetKeys& keys = {});

}  // namespace scarp
