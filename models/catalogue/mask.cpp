#include "models/catalogue/mask.h"

#include <array>
#include <numbers>

namespace scarp {

namespace {

constexpr double steepest = 88 * std::numbers::pi / 180;

const Parameter material{
    .name = "material", .kind = Parameter::Kind::material, .meaning = "what the mask is made of"};
const Parameter thickness{.name = "thickness",
                          .dimension = Dimension::length,
                          .limits = {.minimum = 0, .maximum = longest_length, .exclusive = true},
                          .meaning = "above the highest point, or of the film"};
const Parameter planar{.name = "planar",
                       .kind = Parameter::Kind::flag,
                       .limits = {.fallback = "true"},
                       .meaning =
                           "true: flat on top, fills what lies below; false: a film of the "
                           "same thickness everywhere"};
const Parameter taper{
    .name = "taper",
    .dimension = Dimension::angle,
    .limits = {.fallback = "0 deg", .minimum = -steepest, .maximum = steepest},
    .meaning =
        "of the walls to the vertical; positive narrows an opening downwards and resist "
        "upwards; planar masks only"};
const Parameter opening{.name = "opening",
                        .kind = Parameter::Kind::outline,
                        .needed = "this or resist",
                        .meaning = "outline of the part that is cut out"};
const Parameter resist{.name = "resist",
                       .kind = Parameter::Kind::outline,
                       .needed = "this or opening",
                       .meaning = "outline of the part that stays"};
const Parameter invert{.name = "invert",
                       .kind = Parameter::Kind::flag,
                       .limits = {.fallback = "false"},
                       .meaning = "true swaps what is cut out and what stays"};

std::span<const Parameter> parameters() {
  static const std::array rows{material, thickness, planar, taper, opening, resist, invert};
  return rows;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  MaskFilm mask;
  mask.planar = read_flag(step, planar);
  mask.shape = scope.read_mask(step);
  if (!mask.planar && mask.shape.taper != 0)
    step.error(taper.name, "a mask of one thickness everywhere has upright walls; leave this out");
  return {.deposits = mask.shape.material, .operation = mask};
}

}  // namespace

ModelDescription mask_description() {
  return {
      .name = "mask",
      .summary = "lithography: a resist or a hard mask with an outline, at once",
      .equation = "solid := solid + mask within its outline",
      .symbols =
          "Shapes, polygons and layers of a layout are outlines as in [[geometry]] mask. The "
          "mask fills gas that is joined to the source; closed voids stay as they are. A planar "
          "mask reaches up to thickness above the highest point and down to whatever lies "
          "below.",
      .limits =
          "Geometry: no optics, no development, no reflow. A film over steps (planar = false) "
          "has upright walls, and its outline cuts it where it stands.",
      .source = "geometry",
      .parameters = parameters(),
      .read = read,
      .acts_at_once = true};
}

}  // namespace scarp
