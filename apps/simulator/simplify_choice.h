#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "apps/simulator/recipe.h"

namespace scarp {

/// What becomes of the full mesh of a time step.
enum class SimplifyChoice {
  simplify,
  no_rays,    ///< left out: the step traces no rays
  few_facets  ///< left out: the mesh is small
};

/// Of a full mesh with as many facets: with `simplify.enabled = "auto"` simplification is left out
/// where it is known to cost more than it saves. Depends on counts alone, so a resumed run chooses
/// the same.
SimplifyChoice simplify_choice(const Simplification& simplification, const ProcessStep& step,
                               std::size_t facets_full);

/// As metrics.csv has it; empty where the mesh is simplified.
std::string cell_of(SimplifyChoice choice);

/// Why simplification is left out, as a sentence goes on with it.
std::string reason_of(SimplifyChoice choice);

/// In how many time steps of a run simplification was left out.
struct LeftOutCount {
  std::size_t time_steps = 0;  ///< of the run
  std::size_t no_rays = 0;
  std::size_t few_facets = 0;

  std::size_t sum() const { return no_rays + few_facets; }
};

/// Throws: InputError if metrics.csv cannot be read.
LeftOutCount left_out_count(const std::filesystem::path& metrics);

}  // namespace scarp
