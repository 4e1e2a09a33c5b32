#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/error.h"
#include "core/frame.h"
#include "core/material.h"
#include "core/recipe/recipe_table.h"
#include "levelset/start/shapes.h"
#include "models/surface_model.h"

namespace scarp {

/// One parameter of a process model: its row in `scarp models`, and how it is read from a recipe.
struct Parameter {
  enum class Kind {
    value,
    per_material,
    material,
    material_list,
    flag,
    text,
    formula,
    table,
    outline
  };

  std::string_view name;
  Kind kind = Kind::value;
  Dimension dimension = Dimension::number;
  std::span<const Column> columns{};     ///< of a table
  Limits limits{};                       ///< without a fallback, the key has to be given ...
  std::string_view needed = "required";  ///< ... when this says
  std::string_view meaning;
  std::string_view source = "the tool";        ///< where its value comes from
  std::array<std::string_view, 6> replaces{};  ///< keys beside it that it takes the place of
};

/// The rows of a page in their order; parts are rows, and spans of rows.
template <class... Parts>
std::vector<Parameter> parameter_rows(const Parts&... parts) {
  std::vector<Parameter> rows;
  const auto add = [&](const auto& part) {
    if constexpr (std::is_convertible_v<decltype(part), const Parameter&>) {
      rows.push_back(part);
    } else {
      rows.insert(rows.end(), part.begin(), part.end());
    }
  };
  (add(parts), ...);
  return rows;
}

/// The same in the table that it belongs to: `ion.yield.name` is `name` in an [[step.ion.yield]].
Parameter inner(Parameter parameter);

/// A metre per second; whatever is faster is a mistake of units. Units: nm/s.
constexpr double fastest_rate = 1e9;
constexpr Limits rate_limits{.minimum = 0, .maximum = fastest_rate};

/// What the reader of a step has to know of the rest of the recipe.
struct StepScope {
  const Materials& materials;
  std::vector<MaterialId> reachable;  ///< what the step can meet when it starts
  Frame frame{};                      ///< of the domain
  /// Reads a mask with its outline, as in a [[geometry]] table.
  std::function<MaskShape(const RecipeTable& table)> read_mask{};
};

/// The materials that a step can meet: when it starts, and what it deposits.
std::vector<MaterialId> met_by(const StepScope& scope, std::optional<MaterialId> deposited);

/// An error at a key unless something holds for a material that the step finds. The text is
/// "<what> the step finds (NAMES), <so>".
void require_one(const RecipeTable& step, const StepScope& scope, const Parameter& parameter,
                 const std::function<bool(MaterialId)>& holds, std::string_view what,
                 std::string_view so);

/// Readers of parameters by their rows.
double read_value(const RecipeTable& table, const Parameter& parameter);
bool read_flag(const RecipeTable& table, const Parameter& parameter);
std::vector<MaterialId> read_material_list(const RecipeTable& table, const Parameter& parameter,
                                           const StepScope& scope);
/// Shape: one per material. Reachable are those of the scope and what the step deposits.
std::vector<float> read_per_material(const RecipeTable& table, const Parameter& parameter,
                                     const StepScope& scope, std::optional<MaterialId> deposited);
/// Shape: the same; empty for materials that are not listed.
std::vector<std::string> read_per_material_text(const RecipeTable& table,
                                                const Parameter& parameter, const StepScope& scope,
                                                std::optional<MaterialId> deposited);

/// Whether the key is there, and takes the place of others; then an error for each of those.
bool stands_in(const RecipeTable& table, const Parameter& parameter);

/// What make() gives; nothing if it throws an InputError, which is noted for the key.
template <class T, class Make>
std::optional<T> accepted(const RecipeTable& table, std::string_view key, const Make& make) {
  try {
    return make();
  } catch (const InputError& error) {
    table.error(key, error.what());
    return std::nullopt;
  }
}

/// What a step does: it grows a material, or it etches.
struct Action {
  bool grows = false;
  std::optional<MaterialId> deposited;  ///< set when it grows

  /// A rate as a speed: etching is negative.
  float speed(float rate) const { return grows || rate == 0 ? rate : -rate; }
};

/// The row `material`, which says what is deposited.
Parameter deposited_parameter(std::string_view growth_name);

/// Reads which of two rates a step has, and the material that grows. Exactly one has to be there;
/// nothing, and an error, otherwise. All are the parameters of the model.
std::optional<Action> read_action(const RecipeTable& step, const Parameter& growth,
                                  const Parameter& etch, std::span<const Parameter> all,
                                  const StepScope& scope);

}  // namespace scarp
