#pragma once

#include <optional>
#include <span>
#include <vector>

#include "flux/species.h"
#include "models/open_response.h"
#include "models/parameter.h"

namespace scarp {

/// Rows of the keys that say how much ions sputter of a material by their energy and angle; the
/// strength of it is a matter of the model.
std::span<const Parameter> sputter_yield_parameters();

/// Yields with an amplitude of 1. Materials that have the same share one.
///
/// Shape: law_of has one entry per material.
struct SputterYields {
  std::vector<YieldLaw> laws{};
  std::vector<std::size_t> law_of{};
};

SputterYields read_sputter_yields(const RecipeTable& step, const StepScope& scope,
                                  std::optional<MaterialId> deposited);

/// Ions number `index` of `count` kinds, with these yields.
Species read_sputtering_ions(const RecipeTable& table, const StepScope& scope,
                             const std::vector<YieldLaw>& laws, std::size_t index,
                             std::size_t count);

/// A beam along the axis of ions, in two dimensions along its part in the cross-section; none where
/// the wafer turns under a source that leans.
std::optional<Species> axis_of(const Species& ions, const Frame& frame);

/// Atoms that the surface sends out. Shape: sticking by material.
Species sputtered_atoms(const std::vector<float>& sticking);

}  // namespace scarp
