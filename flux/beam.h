#pragma once

#include "flux/forward.h"

namespace scarp {

/// The flux of a parallel beam: max(0, -d.n) times the part of the facet that sees the source.
///
/// Sees: 16 points per facet, or 64 where they differ, each by a flight against the beam. Standard
/// errors are zero; the balance of the audit holds up to the points' resolution of shadow borders.
/// What does not stick is not followed.
FluxField trace_beam(const FluxProblem& problem);

}  // namespace scarp
