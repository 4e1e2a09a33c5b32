#pragma once

#include <span>
#include <string>
#include <string_view>

#include "models/model_description.h"

namespace scarp {

/// All models. A new one is a header, a source, its file in CMakeLists.txt and its line here.
std::span<const ModelDescription> models();

/// Null if there is none of that name.
const ModelDescription* find_model(std::string_view name);

/// Reads `model` and the keys of that model from the table of a step.
///
/// Errors are noted in the recipe; there is no model then, or one that must not be used.
StepModel read_model(const RecipeTable& step, const StepScope& scope);

/// What to tell a user who asked for a model that there is not: the nearest name, and all of them.
std::string unknown_model_text(std::string_view name);

/// The reference page: equation, symbols, limits, source, and a table of the parameters with units,
/// defaults, ranges, meanings and sources.
std::string model_page(const ModelDescription& model);
/// The pages of all models.
std::string model_pages();

/// Columns of that table, for other listings: "nm/s"; "0 deg", "required"; "[0, 1]".
std::string unit_text(const Parameter& parameter);
std::string default_text(const Parameter& parameter);
std::string range_text(const Parameter& parameter);
bool is_by_material(const Parameter& parameter);

}  // namespace scarp
