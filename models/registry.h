#pragma once

#include <span>
#include <string>
#include <string_view>

#include "models/parameter.h"
#include "models/surface_model.h"

namespace scarp {

/// A process model: what `scarp models` prints of it, and how it is read from a step of a recipe.
struct ModelDescription {
  std::string_view name;
  std::string_view summary;
  std::string_view equation;
  std::span<const Parameter> parameters;
  /// Reads the keys of the model from the table of a step; errors are noted in the recipe.
  StepModel (*read)(const RecipeTable& step, const StepScope& scope);
};

/// All models. A new one is a header, a source and a line here.
std::span<const ModelDescription> models();

/// Null if there is none of that name.
const ModelDescription* find_model(std::string_view name);

/// Reads `model` and the keys of that model from the table of a step.
///
/// Errors are noted in the recipe; there is no model then, or one that must not be used.
StepModel read_model(const RecipeTable& step, const StepScope& scope);

/// What to tell a user who asked for a model that there is not: the nearest name, and all of them.
std::string unknown_model_text(std::string_view name);

/// A line per model: name and summary.
std::string model_list();

/// Equation and a table of the parameters with units, defaults, ranges, meanings and sources.
std::string model_page(const ModelDescription& model);

/// Columns of that table, for other listings: "nm/s"; "0 deg", "required"; "[0, 1]".
std::string unit_text(const Parameter& parameter);
std::string default_text(const Parameter& parameter);
std::string range_text(const Parameter& parameter);

}  // namespace scarp
