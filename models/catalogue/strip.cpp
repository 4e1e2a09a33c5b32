#include "models/catalogue/strip.h"

#include <array>

namespace scarp {

namespace {

const Parameter material{
    .name = "material", .kind = Parameter::Kind::material, .meaning = "what is taken away"};
const Parameter buried{.name = "buried",
                       .kind = Parameter::Kind::flag,
                       .limits = {.fallback = "false"},
                       .meaning = "true: all of it, also what gas does not reach"};

std::span<const Parameter> parameters() {
  static const std::array rows{material, buried};
  return rows;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  const Strip strip{.material = step.material(material.name, scope.materials),
                    .buried = read_flag(step, buried)};
  if (step.ok(material.name) && !scope.reachable.empty() &&
      strip.material == scope.reachable.front()) {
    step.error(material.name, scope.materials[strip.material].name +
                                  " is what the wafer is made of, and that stays; name a "
                                  "material of a layer, a mask or a film");
  }
  return {.operation = strip, .needs = {{material.name, strip.material}}};
}

}  // namespace

ModelDescription strip_description() {
  return {.name = "strip",
          .summary = "ashing or a selective wet etch: a material goes wholly, at once",
          .equation = "solid := solid - material",
          .symbols =
              "Gas reaches what is exposed and, from there, all of the same material that is "
              "joined to it. What nothing else holds falls off, unless keep_free is true.",
          .limits =
              "Nothing else is etched and nothing remains. A film of another material that is left "
              "standing free and is thinner than a grid spacing may be lost.",
          .source = "geometry",
          .parameters = parameters(),
          .read = read,
          .acts_at_once = true};
}

}  // namespace scarp
