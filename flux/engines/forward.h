#pragma once

#include "flux/rays/problem.h"

namespace scarp {

/// Follows particles from the source plane, and from facets that emit, until they stick or leave.
///
/// The estimate on a facet is the weight that arrives there, times source area (and what facets
/// emit) over number of rays and facet area. Rays form 32 independent batches; the spread between
/// batches gives the standard errors, on facets and on patches, which are right although one
/// particle arrives many times. In a batch the start and first direction follow a scrambled Sobol
/// sequence, later directions are plain random numbers.
///
/// A target is first tried with least_rays, where these are more than the first round has.
///
/// Cost: 256 bytes per facet and tally, up to 10 MB per thread, and 1/4 to 1/2 us per flight on one
/// core (./dev bench flux).
FluxField trace_forward(const FluxProblem& problem, std::uint64_t least_rays = 0);

}  // namespace scarp
