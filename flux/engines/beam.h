#pragma once

#include "flux/rays/problem.h"

namespace scarp {

/// The flux of a parallel beam: max(0, -d.n) times the part of the facet that sees the source; that
/// part is a second tally.
///
/// Sees: 11 points per facet, 248 more where they differ, each by a flight against the beam; but
/// for the three corners two scrambled Sobol sets, whose difference gives the standard error. What
/// does not stick is not followed.
///
/// The sides of the domain unfold: a beam that leans towards a reflective side falls on the domain
/// and on its mirror images alike.
FluxField trace_beam(const FluxProblem& problem);

}  // namespace scarp
