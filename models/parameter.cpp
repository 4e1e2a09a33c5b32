#include "models/parameter.h"

#include <algorithm>
#include <array>
#include <string>

namespace scarp {

std::vector<MaterialId> met_by(const StepScope& scope, std::optional<MaterialId> deposited) {
  std::vector<MaterialId> materials = scope.reachable;
  if (deposited && std::find(materials.begin(), materials.end(), *deposited) == materials.end()) {
    materials.push_back(*deposited);
  }
  return materials;
}

Parameter inner(Parameter parameter) {
  parameter.name.remove_prefix(parameter.name.rfind('.') + 1);
  return parameter;
}

void require_one(const RecipeTable& step, const StepScope& scope, const Parameter& parameter,
                 const std::function<bool(MaterialId)>& holds, std::string_view what,
                 std::string_view so) {
  std::string names;
  for (const MaterialId m : scope.reachable) {
    if (holds(m)) return;
    names += (names.empty() ? "" : ", ") + scope.materials[m].name;
  }
  if (!step.ok(parameter.name)) return;
  step.error(parameter.name,
             std::string(what) + " the step finds (" + names + "), " + std::string(so));
}

double read_value(const RecipeTable& table, const Parameter& parameter) {
  return table.quantity(parameter.name, parameter.dimension, parameter.limits);
}

bool read_flag(const RecipeTable& table, const Parameter& parameter) {
  return table.flag(parameter.name, parameter.limits.fallback == "true");
}

std::vector<MaterialId> read_material_list(const RecipeTable& table, const Parameter& parameter,
                                           const StepScope& scope) {
  return table.material_list(parameter.name, scope.materials, {.minimum = 0},
                             parameter.limits.fallback);
}

std::vector<float> read_per_material(const RecipeTable& table, const Parameter& parameter,
                                     const StepScope& scope, std::optional<MaterialId> deposited) {
  const std::vector<double> values =
      table.per_material(parameter.name, parameter.dimension,
                         {scope.materials, met_by(scope, deposited)}, parameter.limits);
  return {values.begin(), values.end()};
}

std::vector<std::string> read_per_material_text(const RecipeTable& table,
                                                const Parameter& parameter, const StepScope& scope,
                                                std::optional<MaterialId> deposited) {
  return table.per_material_text(parameter.name, {scope.materials, met_by(scope, deposited)});
}

bool stands_in(const RecipeTable& table, const Parameter& parameter) {
  if (!table.has(parameter.name)) return false;
  for (const std::string_view other : parameter.replaces) {
    if (other.empty() || !table.has(other)) continue;
    table.error(other, std::string(parameter.name).append(" and ").append(other) +
                           " exclude each other; leave one out");
  }
  return true;
}

Parameter deposited_parameter(std::string_view growth_name) {
  return {.name = "material",
          .kind = Parameter::Kind::material,
          .needed = growth_name == "growth_rate" ? "with growth_rate" : "when it grows",
          .meaning = "what is deposited"};
}

std::optional<Action> read_action(const RecipeTable& step, const Parameter& growth,
                                  const Parameter& etch, std::span<const Parameter> all,
                                  const StepScope& scope) {
  const bool grows = step.has(growth.name);
  const bool etches = step.has(etch.name);
  if (grows && etches) {
    step.error(etch.name, std::string(growth.name).append(" and ").append(etch.name) +
                              " exclude each other; leave one out");
  }
  if (!grows && !etches) {
    step.missing(std::array{growth.name, etch.name},
                 std::string(growth.name) + " or " + std::string(etch.name) +
                     " is missing; write for example " + std::string(etch.name) + " = \"" +
                     quantity_example(etch.dimension) + '"');
  }
  if (grows == etches) {
    // The other keys of the model are not read, but they are known.
    for (const Parameter& parameter : all) {
      step.has(parameter.name.substr(0, parameter.name.find('.')));
    }
    return std::nullopt;
  }
  if (etches) return Action{};
  return Action{.grows = true, .deposited = step.material("material", scope.materials)};
}

}  // namespace scarp
