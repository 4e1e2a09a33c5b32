#include "models/registry.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/suggestion.h"
#include "models/directional.h"
#include "models/isotropic.h"
#include "models/single_particle.h"

namespace scarp {

namespace {

std::vector<std::string> model_names() {
  std::vector<std::string> names;
  for (const ModelDescription& model : models()) names.emplace_back(model.name);
  return names;
}

/// Text in columns, two spaces apart.
std::string aligned(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      line += "  " + row[c] + std::string(widths[c] - row[c].size(), ' ');
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + '\n';
  }
  return text;
}

}  // namespace

std::span<const ModelDescription> models() {
  static const std::array<ModelDescription, 3> table{{
      {"isotropic", "the same speed in all directions, by material", "v = rate",
       isotropic_parameters(), read_isotropic},
      {"directional", "parallel beams with shadows, and an isotropic part",
       "v = directional_rate sum_i share_i max(0, -d_i.n) seen_i + isotropic_rate",
       directional_parameters(), read_directional},
      {"single_particle", "one species with constant sticking: CVD, plain reactive etching",
       "v = rate F, with F = 1 on an open flat wafer", single_particle_parameters(),
       read_single_particle},
  }};
  return table;
}

const ModelDescription* find_model(std::string_view name) {
  for (const ModelDescription& model : models()) {
    if (model.name == name) return &model;
  }
  return nullptr;
}

StepModel read_model(const RecipeTable& step, const StepScope& scope) {
  const std::string name = step.text("model");
  const ModelDescription* const model = find_model(name);
  if (model != nullptr) return model->read(step, scope);
  if (step.ok("model")) step.error("model", unknown_model_text(name));
  step.accept_rest();
  return {};
}

std::string unknown_model_text(std::string_view name) {
  std::string known;
  for (const std::string& other : model_names()) known.append(known.empty() ? "" : ", ") += other;
  return "there is no model \"" + std::string(name) + '"' + suggestion(name, model_names()) +
         "; there are " + known;
}

std::string model_list() {
  std::vector<std::vector<std::string>> rows;
  for (const ModelDescription& model : models()) {
    rows.push_back({std::string(model.name), std::string(model.summary)});
  }
  return aligned(rows);
}

std::string unit_text(const Parameter& parameter) {
  switch (parameter.kind) {
    case Parameter::Kind::material:
      return "material";
    case Parameter::Kind::flag:
      return "true or false";
    default:
      break;
  }
  const std::string unit(inside_unit(parameter.dimension));
  if (parameter.dimension == Dimension::angle) return "deg";
  return unit.empty() ? "-" : unit;
}

std::string default_text(const Parameter& parameter) {
  return std::string(parameter.limits.fallback.empty() ? parameter.needed
                                                       : parameter.limits.fallback);
}

std::string range_text(const Parameter& parameter) {
  if (parameter.kind == Parameter::Kind::material || parameter.kind == Parameter::Kind::flag) {
    return "";
  }
  const auto shown = [&](double limit) {
    return limit == 0 ? "0" : format_quantity(limit, parameter.dimension);
  };
  const Limits& limits = parameter.limits;
  if (std::isfinite(limits.minimum) && std::isfinite(limits.maximum)) {
    return (limits.exclusive ? '(' : '[') + shown(limits.minimum) + ", " + shown(limits.maximum) +
           (limits.exclusive ? ')' : ']');
  }
  if (std::isfinite(limits.minimum))
    return (limits.exclusive ? "> " : ">= ") + shown(limits.minimum);
  if (std::isfinite(limits.maximum))
    return (limits.exclusive ? "< " : "<= ") + shown(limits.maximum);
  return "any";
}

std::string model_page(const ModelDescription& model) {
  std::vector<std::vector<std::string>> rows{
      {"parameter", "unit", "default", "range", "by material", "meaning", "source"}};
  for (const Parameter& parameter : model.parameters) {
    rows.push_back({std::string(parameter.name), unit_text(parameter), default_text(parameter),
                    range_text(parameter),
                    parameter.kind == Parameter::Kind::per_material ? "yes" : "",
                    std::string(parameter.meaning), std::string(parameter.source)});
  }
  return std::string(model.name) + ": " + std::string(model.summary) + "\n\n  " +
         std::string(model.equation) + "\n\n" + aligned(rows);
}

}  // namespace scarp
