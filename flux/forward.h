#pragma once

#include <cstdint>
#include <span>

#include "core/tri_mesh.h"
#include "flux/patches.h"
#include "flux/ray_scene.h"
#include "flux/solve.h"

namespace scarp {

/// What all engines get: a surface, a species, and what is wanted.
struct FluxProblem {
  const RayScene& scene;
  const Patches& patches;
  std::span<const float> sticking;  ///< one per facet
  const Species& species;
  std::uint32_t species_index = 0;  ///< part of the random number's key
  const FluxOptions& options;
};

/// Follows particles from the source plane until they stick or leave.
///
/// Neutral particles are re-emitted by the cosine law, ions as their species says. The estimate on
/// a facet is the weight that arrives there, times source area over number of rays and facet area.
/// Rays form 32 independent batches; the spread between batches gives the standard errors, on
/// facets and on patches, which are right although one particle arrives many times. In a batch the
/// start and first direction follow a scrambled Sobol sequence, later directions are plain random
/// numbers.
///
/// Cost: 256 bytes per facet and tally, up to 60 MB per thread, and 1/4 to 1 us per flight on one
/// core.
FluxField trace_forward(const FluxProblem& problem);

}  // namespace scarp
