#include "models/catalogue/isotropic.h"

#include <array>

namespace scarp {

namespace {

const Parameter growth_rate{.name = "growth_rate",
                            .kind = Parameter::Kind::per_material,
                            .dimension = Dimension::rate,
                            .limits = rate_limits,
                            .needed = "this or etch_rate",
                            .meaning = "speed of growth",
                            .source = "blanket wafer"};
const Parameter etch_rate{.name = "etch_rate",
                          .kind = Parameter::Kind::per_material,
                          .dimension = Dimension::rate,
                          .limits = rate_limits,
                          .needed = "this or growth_rate",
                          .meaning = "speed of etching; 0 for a mask that withstands",
                          .source = "blanket wafer"};

std::span<const Parameter> parameters() {
  static const std::array rows{growth_rate, etch_rate, deposited_parameter("growth_rate")};
  return rows;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  const std::optional<Action> action =
      read_action(step, growth_rate, etch_rate, parameters(), scope);
  if (!action) return {};
  std::vector<float> speed =
      read_per_material(step, action->grows ? growth_rate : etch_rate, scope, action->deposited);
  for (float& v : speed) v = action->speed(v);
  return {std::make_shared<Isotropic>(std::move(speed)), action->deposited};
}

}  // namespace

std::vector<float> Isotropic::speeds(const SurfacePoints& points,
                                     std::span<const std::span<const float>>) const {
  std::vector<float> speeds;
  speeds.reserve(points.material.size());
  for (const MaterialId material : points.material) speeds.push_back(speed_[material]);
  return speeds;
}

ModelDescription isotropic_description() {
  return {.name = "isotropic",
          .summary = "the same speed in all directions, by material",
          .equation = "v = growth_rate or -etch_rate",
          .symbols =
              "v is the speed along the outward normal: the surface is offset by rate times "
              "time.",
          .limits =
              "No particles, so no shadow and no dependence on the aspect ratio: wet etching, or "
              "a gas that reacts so seldom that it is everywhere the same. A mask is a material "
              "of rate 0. Growth coats masks as well, unless its table says 0 for them. Voids "
              "that are closed off do not move.",
          .source = "J. A. Sethian, D. Adalsteinsson, IEEE Trans. Semicond. Manuf. 10, 167 (1997)",
          .parameters = parameters(),
          .read = read};
}

}  // namespace scarp
