#include "models/isotropic.h"

#include <array>

namespace scarp {

namespace {

const Parameter growth_rate{.name = "growth_rate",
                            .kind = Parameter::Kind::per_material,
                            .dimension = Dimension::rate,
                            .limits = {.minimum = 0},
                            .needed = "this or etch_rate",
                            .meaning = "speed of growth",
                            .source = "blanket wafer"};
const Parameter etch_rate{.name = "etch_rate",
                          .kind = Parameter::Kind::per_material,
                          .dimension = Dimension::rate,
                          .limits = {.minimum = 0},
                          .needed = "this or growth_rate",
                          .meaning = "speed of etching; 0 for a mask that withstands",
                          .source = "blanket wafer"};

}  // namespace

std::vector<float> Isotropic::speeds(const SurfacePoints& points,
                                     std::span<const std::span<const float>>) const {
  std::vector<float> speeds;
  speeds.reserve(points.material.size());
  for (const MaterialId material : points.material) speeds.push_back(speed_[material]);
  return speeds;
}

std::span<const Parameter> isotropic_parameters() {
  static const std::array parameters{growth_rate, etch_rate, deposited_parameter("growth_rate")};
  return parameters;
}

StepModel read_isotropic(const RecipeTable& step, const StepScope& scope) {
  const std::optional<Action> action =
      read_action(step, growth_rate, etch_rate, isotropic_parameters(), scope);
  if (!action) return {};
  std::vector<float> speed =
      read_per_material(step, action->grows ? growth_rate : etch_rate, scope, action->deposited);
  for (float& v : speed) v = action->speed(v);
  return {std::make_shared<Isotropic>(std::move(speed)), action->deposited};
}

}  // namespace scarp
