#pragma once

#include "flux/rays/problem.h"

namespace scarp {

/// Asks every facet what comes straight from the source, and follows what does not stick there.
///
/// First arrivals: from places spread over each facet, rays leave against directions of the
/// source's lobe; one that reaches the sky stands for a flux of cos(theta to the facet) / cos(theta
/// to the wafer). Yields there are means over all energies. As in gather(), two scrambled Sobol
/// sets per element (a piece of a facet no longer than three spacings) give the errors.
///
/// What goes on: particles start where and as rays found first arrivals, equally spaced in a list
/// of them by what does not stick, so that all stand for the same flux. They form 32 batches as in
/// trace_forward(); each draws from rays of its own, so the spread of batches tells also what the
/// choice of rays adds. On a facet the two parts have independent errors: what goes on comes from
/// other facets.
///
/// The error of the balance is at least what rays leave unknown at the borders of shadows.
///
/// Rays are shared out between the parts so that the fewest flights reach the target.
///
/// Throws: InputError if 8 rays per piece of a facet, 16 per ring, exceed options.memory_limit.
/// Cost:   1/2 us per ray on one core, 1 us per flight of what goes on; 256 bytes per facet and
///         tally.
FluxField gather_forward(const FluxProblem& problem);

}  // namespace scarp
