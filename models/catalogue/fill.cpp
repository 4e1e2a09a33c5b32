#include "models/catalogue/fill.h"

#include <array>
#include <string>

namespace scarp {

namespace {

const Parameter material{
    .name = "material", .kind = Parameter::Kind::material, .meaning = "what fills the gas"};
const Parameter height{.name = "height",
                       .dimension = Dimension::length,
                       .limits = {.minimum = -longest_length, .maximum = longest_length},
                       .needed = "this or above",
                       .meaning = "of the flat top; 0 is the surface of the wafer"};
const Parameter above{.name = "above",
                      .dimension = Dimension::length,
                      .limits = {.minimum = 0, .maximum = longest_length},
                      .needed = "this or height",
                      .meaning = "height of the flat top over the highest point"};
const Parameter narrower_than{
    .name = "narrower_than",
    .dimension = Dimension::length,
    .limits = {.minimum = 0, .maximum = longest_length, .exclusive = true},
    .needed = "none",
    .meaning = "only in openings that no disc of this diameter fits into, each height by itself"};
const Parameter on{.name = "on",
                   .kind = Parameter::Kind::material_list,
                   .limits = {.fallback = "all"},
                   .meaning = "only where one of these materials lies straight below"};

std::span<const Parameter> parameters() {
  static const std::array rows{material, height, above, narrower_than, on};
  return rows;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  Fill fill{.on = step.material_list_or("all", on.name, scope.materials)};
  if (step.has(narrower_than.name)) fill.narrower_than = read_value(step, narrower_than);
  const std::optional<MaterialId> filled = step.material(material.name, scope.materials);
  if (!step.has(height.name) && !step.has(above.name)) {
    const std::array<std::string_view, 2> names{height.name, above.name};
    step.missing(names, "height or above is missing; write for example above = \"0 nm\"");
  } else if (step.has(height.name) && step.has(above.name)) {
    step.error(above.name, "height and above exclude each other; leave one out");
  } else if (step.has(height.name)) {
    fill.height = read_value(step, height);
  } else {
    fill.above = read_value(step, above);
  }
  StepModel made{.deposits = filled, .operation = fill};
  for (const MaterialId each : fill.on) made.needs.push_back({on.name, each});
  return made;
}

}  // namespace

ModelDescription fill_description() {
  return {.name = "fill",
          .summary = "spin-on or bottom-up fill: gas is filled up to a plane, at once",
          .equation = "solid := solid + gas below a plane",
          .symbols =
              "Gas that is joined to the source is filled; closed voids stay as they are. With on, "
              "only columns of gas with one of these materials as their floor are filled.",
          .limits =
              "Geometry: flat on top, no shrinkage, no surface tension. Sides that are no walls, "
              "where an opening widens or a material ends, are known to half a grid spacing.",
          .source = "geometry",
          .parameters = parameters(),
          .read = read,
          .acts_at_once = true};
}

}  // namespace scarp
