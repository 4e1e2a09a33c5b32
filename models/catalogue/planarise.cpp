#include "models/catalogue/planarise.h"

#include <array>
#include <string>

namespace scarp {

namespace {

const Parameter height{.name = "height",
                       .dimension = Dimension::length,
                       .limits = {.minimum = -longest_length, .maximum = longest_length},
                       .needed = "one of three",
                       .meaning = "of the plane; 0 is the surface of the wafer"};
const Parameter removal{.name = "removal",
                        .dimension = Dimension::length,
                        .limits = {.minimum = 0, .maximum = longest_length, .exclusive = true},
                        .needed = "one of three",
                        .meaning = "from the highest point down to the plane"};
const Parameter stop_material{
    .name = "stop_material",
    .kind = Parameter::Kind::material,
    .needed = "one of three",
    .meaning = "the plane lies at the highest point of this material, which stays"};

std::span<const Parameter> parameters() {
  static const std::array rows{height, removal, stop_material};
  return rows;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  std::vector<std::string_view> given;
  std::vector<std::string_view> names;
  for (const Parameter& parameter : parameters()) {
    names.push_back(parameter.name);
    if (step.has(parameter.name)) given.push_back(parameter.name);
  }
  if (given.empty()) {
    step.missing(names,
                 "height, removal or stop_material is missing; write for example removal = \"50 "
                 "nm\"");
    return {};
  }
  if (given.size() > 1) {
    step.error(given[1], std::string(given[0]).append(" and ").append(given[1]) +
                             " exclude each other; leave one out");
    return {};
  }
  Planarise plane;
  if (given[0] == height.name) plane.height = read_value(step, height);
  if (given[0] == removal.name) plane.removal = read_value(step, removal);
  if (given[0] != stop_material.name) return {.operation = plane};
  const MaterialId stop = step.material(stop_material.name, scope.materials);
  plane.stop_material = stop;
  return {.operation = plane, .needs = {{stop_material.name, stop}}};
}

}  // namespace

ModelDescription planarise_description() {
  return {.name = "planarise",
          .summary = "polishing: all that lies above a plane goes, at once",
          .equation = "solid := solid below z = h",
          .symbols =
              "h is height, or the highest point less removal, or the highest point of "
              "stop_material. Nothing is ever added: a plane above everything changes nothing. "
              "Closed voids that the plane cuts are open then.",
          .limits =
              "A cut, not a process: no dishing, no erosion, no difference between materials, no "
              "time unless the step has a duration.",
          .source = "geometry",
          .parameters = parameters(),
          .read = read,
          .acts_at_once = true};
}

}  // namespace scarp
