#pragma once

#include <numbers>
#include <span>

#include "flux/species.h"
#include "models/parameter.h"

namespace scarp {

/// Columns of tables about ions.
inline constexpr Column angle_column{
    "angle", Dimension::angle, {.minimum = 0, .maximum = std::numbers::pi / 2}};
inline constexpr Column energy_column{"energy", Dimension::energy, {.minimum = 0, .maximum = 1e6}};

/// Rows of the keys of an [[step.ion]] table that say with which angles and energies ions come from
/// the source, and how they stick and are reflected.
std::span<const Parameter> ion_parameters();

/// Reads them. The species has no name and no yields yet.
Species read_ions(const RecipeTable& table, const StepScope& scope);

/// Ions stay where they arrive once no yield counts them any more. After the yields are known.
void stop_without_yield(Species& ions);

/// A factor by angle of incidence from a table of the recipe.
AngleTable read_angle_table(const RecipeTable& table, const Parameter& parameter);

/// cos(theta) (1 + B sin^2(theta)): more is sputtered by ions that come at a slant.
/// Source: Chang, Sawin 1997.
AngleTable sputter_factor(double b);

/// 1 up to 60 degrees, from there linear to 0 at 90 degrees: etching by ions together with a gas.
/// Source: Belen et al. 2005.
AngleTable enhanced_factor();

}  // namespace scarp
