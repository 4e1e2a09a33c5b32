#pragma once

// Recipes run to their end within a benchmark, and how far apart the surfaces are that they leave.

#include <cstddef>

#include "apps/simulator/recipe.h"
#include "core/stage_timer.h"
#include "core/tri_mesh.h"

namespace scarp::bench {

/// What a recipe leaves, and what its time steps took: no files, no metrology.
///
/// Units: nm; CPU seconds of all threads, those of a stage too.
struct WholeRun {
  TriMesh surface;  ///< of the whole wafer, without closed voids
  double cpu_seconds = 0;
  StageTimer stages;
  std::size_t time_steps = 0;
  double facets = 0;  ///< that the flux is solved on, mean over the time steps
  double rays = 0;
};

/// Time steps end at the recipe's outputs, as in `scarp run`.
WholeRun run_to_end(const Recipe& recipe);

/// Mean distance between two surfaces, both ways, in spacings.
double distance_between(const TriMesh& a, const TriMesh& b, double spacing);

}  // namespace scarp::bench
