#pragma once

#include <span>
#include <string_view>

#include "models/parameter.h"
#include "models/surface_model.h"

namespace scarp {

/// A process model: what `scarp models` prints of it, and how it is read from a step of a recipe.
struct ModelDescription {
  std::string_view name;
  std::string_view summary;
  std::string_view equation;
  std::string_view symbols;  ///< what the equation's symbols mean
  std::string_view limits;   ///< what the model leaves out, and where it holds
  std::string_view source;
  std::span<const Parameter> parameters;
  /// Reads the keys of the model from the table of a step; errors are noted in the recipe. Without
  /// a model if the step does not make sense.
  StepModel (*read)(const RecipeTable& step, const StepScope& scope);
  bool acts_at_once = false;  ///< on the layers: the step needs no duration
  /// What keys of the model make of the time that a step takes, in place of its `duration`; empty
  /// for those that have one.
  std::string_view duration_text{};
  bool takes_blanket_rates = false;  ///< see with_blanket_rates()
};

}  // namespace scarp
