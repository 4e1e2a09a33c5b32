#pragma once

#include <optional>

#include "apps/simulator/survey.h"

namespace scarp {

/// About how long a step takes to its end condition, over-etch included, if the surface of the
/// survey went on straight down (a film: up) at the speeds that it has there; at most its duration.
/// The state may be anywhere in the step, and one time step behind its survey.
///
/// Films that are to be exposed or to go and are not there yet are not known: such a step takes its
/// duration. Units: s.
double expected_duration(const ProcessStep& step, const State& state, const Survey& survey);

}  // namespace scarp
