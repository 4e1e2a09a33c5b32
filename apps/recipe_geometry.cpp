#include "apps/recipe_geometry.h"

#include <array>
#include <string>
#include <utility>

namespace scarp {

namespace {

constexpr Limits positive{.minimum = 0, .exclusive = true};
constexpr Limits any_position{.fallback = "0 nm"};

const Choices<int> axes{{"x", 0}, {"y", 1}};

constexpr double degree = 0.017453292519943295;
constexpr Limits taper_limits{.fallback = "0 deg", .minimum = -88 * degree, .maximum = 88 * degree};

std::array<double, 2> read_center(const RecipeTable& table) {
  const std::vector<double> center =
      table.quantities("center", Dimension::length, {2, 2}, any_position);
  return {center[0], center[1]};
}

Cut read_cut(const RecipeTable& table, const Materials& materials) {
  Cut cut;
  cut.depth = table.length("depth", positive);
  cut.taper = table.angle("taper", taper_limits);
  if (table.has("depth_from")) cut.depth_from = table.material("depth_from", materials);
  if (table.has("through")) cut.through = table.material_list("through", materials);
  return cut;
}

Shape read_wafer(const RecipeTable& table, const Materials& materials) {
  return WaferShape{.material = table.material("material", materials)};
}

Shape read_layer(const RecipeTable& table, const Materials& materials) {
  return LayerShape{.material = table.material("material", materials),
                    .thickness = table.length("thickness", positive)};
}

Shape read_trench(const RecipeTable& table, const Materials& materials) {
  return TrenchShape{.width = table.length("width", positive),
                     .centre = table.length("center", any_position),
                     .along = table.choice<int>("along", axes, "y"),
                     .cut = read_cut(table, materials)};
}

Shape read_hole(const RecipeTable& table, const Materials& materials) {
  return HoleShape{.radius = table.length("radius", positive),
                   .centre = read_center(table),
                   .cut = read_cut(table, materials)};
}

Shape read_fin(const RecipeTable& table, const Materials& materials) {
  return FinShape{.material = table.material("material", materials),
                  .width = table.length("width", positive),
                  .height = table.length("height", positive),
                  .centre = table.length("center", any_position),
                  .along = table.choice<int>("along", axes, "y"),
                  .taper = table.angle("taper", taper_limits)};
}

Outline read_outline(const RecipeTable& table) {
  enum class Kind { slot, circle, rectangle };
  const Choices<Kind> kinds{
      {"trench", Kind::slot}, {"hole", Kind::circle}, {"rectangle", Kind::rectangle}};
  switch (table.choice<Kind>("shape", kinds)) {
    case Kind::slot:
      return SlotOutline{.width = table.length("width", positive),
                         .centre = table.length("center", any_position),
                         .along = table.choice<int>("along", axes, "y")};
    case Kind::circle:
      return CircleOutline{.radius = table.length("radius", positive),
                           .centre = read_center(table)};
    case Kind::rectangle:
      break;
  }
  const std::vector<double> size = table.quantities("size", Dimension::length, {2, 2}, positive);
  return RectangleOutline{.size = {size[0], size[1]}, .centre = read_center(table)};
}

Shape read_mask(const RecipeTable& table, const Materials& materials) {
  MaskShape mask;
  mask.material = table.material("material", materials);
  mask.thickness = table.length("thickness", positive);
  mask.taper = table.angle("taper", taper_limits);
  const bool opening = table.has("opening");
  if (opening == table.has("resist")) {
    table.error("",
                "a mask says either what is cut out, opening = { shape = ... }, or what stays, "
                "resist = { shape = ... }");
    table.accept_rest();
    mask.outline = SlotOutline{};
    return mask;
  }
  mask.outlines = opening ? MaskShape::Outlines::opening : MaskShape::Outlines::resist;
  mask.outline = read_outline(table.table(opening ? "opening" : "resist"));
  return mask;
}

using ShapeReader = Shape (*)(const RecipeTable&, const Materials&);
const Choices<ShapeReader> readers{{"wafer", read_wafer},   {"layer", read_layer},
                                   {"trench", read_trench}, {"hole", read_hole},
                                   {"fin", read_fin},       {"mask", read_mask}};

}  // namespace

std::vector<Shape> read_geometry(std::span<const RecipeTable> tables, const Materials& materials) {
  std::vector<Shape> shapes;
  for (const RecipeTable& table : tables) {
    const ShapeReader read = table.choice<ShapeReader>("shape", readers);
    if (!table.ok("shape")) {
      table.accept_rest();
      continue;
    }
    shapes.push_back(read(table, materials));
  }
  return shapes;
}

}  // namespace scarp
