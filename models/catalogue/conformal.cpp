#include "models/catalogue/conformal.h"

#include <array>

namespace scarp {

namespace {

const Parameter thickness{.name = "thickness",
                          .dimension = Dimension::length,
                          .limits = {.minimum = 0, .maximum = longest_length, .exclusive = true},
                          .meaning = "of the film, measured along the normal"};

const Parameter on{.name = "on",
                   .kind = Parameter::Kind::material_list,
                   .limits = {.fallback = "all"},
                   .meaning = "the film grows where one of these materials is exposed"};

std::span<const Parameter> parameters() {
  static const std::array rows{thickness,
                               Parameter{.name = "material",
                                         .kind = Parameter::Kind::material,
                                         .meaning = "what the film is made of"},
                               on};
  return rows;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  const ConformalFilm film{.thickness = read_value(step, thickness),
                           .on = step.material_list_or("all", on.name, scope.materials)};
  StepModel made{.deposits = step.material("material", scope.materials), .operation = film};
  for (const MaterialId each : film.on) made.needs.push_back({on.name, each});
  return made;
}

}  // namespace

ModelDescription conformal_description() {
  return {
      .name = "conformal",
      .summary = "a film of the same thickness everywhere, at once",
      .equation = "solid := all within thickness of the surface",
      .symbols =
          "The surface is that which gas from the source can reach, and only gas that is joined "
          "to the source becomes film: closed voids stay as they are. Convex edges are rounded, "
          "gaps narrower than twice the thickness are filled. With on the film starts from these "
          "materials alone, and grows as far on all ways through the gas.",
      .limits =
          "Geometry, for films whose growth is not of interest: exact to the grid in one step, "
          "whatever the thickness. A cavity behind a neck is coated until the film shuts the neck, "
          "up to half a grid spacing less where the middle of the neck lies between nodes, and "
          "throughout by films thinner than half a spacing. Where more than 2^26 nodes lie below "
          "overhangs, necks are not looked for, and the run warns. With on they are never looked "
          "for; the film ends on another material within 0.15 spacings, behind a corner within "
          "a third.",
      .source = "geometry: the Minkowski sum with a ball",
      .parameters = parameters(),
      .read = read,
      .acts_at_once = true};
}

}  // namespace scarp
