#pragma once

#include <set>
#include <span>
#include <string>
#include <vector>

#include "apps/simulator/survey.h"

namespace scarp {

/// Asks the model of the current step how every layer would move; nothing where there is none.
///
/// Throws: NumericalError with the place when a speed is not finite, or when the surface
///         grows in a step that deposits nothing.
void find_speeds(const State& state, const ProcessStep& step, const Materials& materials,
                 Survey& result);

/// Compares them with those of the time step before, if it was of the same step of the recipe.
void find_change(const State& state, const ProcessStep& step, Survey& result);

/// The speed of every facet, of the layer that is seen there. Units: nm/s.
std::vector<float> facet_speeds(const State& state, const Survey& survey);

/// What to say of a step that moved none of the materials that it met.
std::string standstill_text(const ProcessStep& step, const std::set<MaterialId>& seen,
                            const Materials& materials);

/// The same of a step that acted at once and changed nothing, with a remedy.
std::string standstill_text(const ProcessStep& step, const Layers& layers,
                            const Materials& materials);

/// All tallies in a row, as models take them.
std::vector<std::span<const float>> tallies_on_facets(std::span<const FluxField> flux);

}  // namespace scarp
