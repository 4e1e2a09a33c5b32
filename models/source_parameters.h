#pragma once

#include <span>
#include <string_view>

#include "flux/species.h"
#include "models/parameter.h"

namespace scarp {

/// Rows of the keys that say how particles leave the source, by the name that a model gives them:
/// "source_power", "ion.tilt".
Parameter source_power_parameter(std::string_view name);
Parameter source_table_parameter(std::string_view name);
Parameter source_map_parameter(std::string_view name);
Parameter tilt_parameter(std::string_view name);
Parameter azimuth_parameter(std::string_view name);
Parameter rotating_parameter(std::string_view name);

/// Reads `source_power`, with the given row, or `source_table`, and `source_map`.
SourceLobe read_upright_source(const RecipeTable& table, const Parameter& power,
                               const StepScope& scope);
/// The same with `tilt`, `azimuth` and `rotating`.
SourceLobe read_source(const RecipeTable& table, const Parameter& power, const StepScope& scope);

/// Whether what leaves the sources is its own mirror image along x (axis 0) or y.
bool are_mirror_symmetric(std::span<const Species> species, int axis);

}  // namespace scarp
