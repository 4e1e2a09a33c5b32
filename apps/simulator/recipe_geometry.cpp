#include "apps/simulator/recipe_geometry.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "core/error.h"
#include "levelset/start/gds.h"
#include "mesh/files/mesh_file.h"

namespace scarp {

namespace {

constexpr Limits positive{.minimum = 0, .maximum = longest_length, .exclusive = true};
constexpr Limits any_position{
    .fallback = "0 nm", .minimum = -longest_length, .maximum = longest_length};

const Choices<int> axes{{"x", 0}, {"y", 1}};

constexpr double degree = 0.017453292519943295;
constexpr Limits taper_limits{.fallback = "0 deg", .minimum = -88 * degree, .maximum = 88 * degree};

/// What readers of shapes need besides their table.
struct GeometryContext {
  const Materials& materials;
  const Frame& frame;
};

std::array<double, 2> read_center(const RecipeTable& table) {
  const std::vector<double> center =
      table.quantities("center", Dimension::length, {2, 2}, any_position);
  return {center[0], center[1]};
}

constexpr Limits radius_limits{.fallback = "0 nm", .minimum = 0, .maximum = longest_length};
constexpr Limits count_limits{.fallback = "1", .minimum = 1, .maximum = 1e6};

/// One of a kind has no neighbour, but may say how far away it would be.
bool needs_pitch(const RecipeTable& table, const Repeat& repeat) {
  return table.has("pitch") || repeat.count[0] > 1 || repeat.count[1] > 1;
}

/// Copies side by side: repeat = 3, pitch = "2 um".
Repeat read_row(const RecipeTable& table, int along) {
  Repeat repeat;
  const auto across = static_cast<std::size_t>(1 - along);
  repeat.count[across] = static_cast<int>(table.integer("repeat", count_limits));
  if (needs_pitch(table, repeat)) repeat.pitch[across] = table.length("pitch", positive);
  return repeat;
}

/// Copies on a lattice: repeat = [3, 2], pitch = ["2 um", "1 um"].
Repeat read_lattice(const RecipeTable& table) {
  Repeat repeat;
  const std::vector<double> count =
      table.quantities("repeat", Dimension::number, {2, 2}, count_limits);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    if (count[axis] != std::floor(count[axis])) {
      table.error("repeat[" + std::to_string(axis) + "]", "is not a whole number");
    }
    repeat.count[axis] = static_cast<int>(count[axis]);
  }
  if (!needs_pitch(table, repeat)) return repeat;
  const std::vector<double> pitch = table.quantities("pitch", Dimension::length, {2, 2}, positive);
  repeat.pitch = {pitch[0], pitch[1]};
  return repeat;
}

Cut read_cut(const RecipeTable& table, const Materials& materials) {
  Cut cut;
  cut.depth = table.length("depth", positive);
  cut.taper = table.angle("taper", taper_limits);
  cut.depth_from = table.material_or("surface", "depth_from", materials);
  cut.bottom_radius = table.length("bottom_radius", radius_limits);
  cut.top_radius = table.length("top_radius", radius_limits);
  cut.through = table.material_list_or("all", "through", materials);
  return cut;
}

Shape read_wafer(const RecipeTable& table, const GeometryContext& context) {
  return WaferShape{.material = table.material("material", context.materials)};
}

Shape read_layer(const RecipeTable& table, const GeometryContext& context) {
  return LayerShape{.material = table.material("material", context.materials),
                    .thickness = table.length("thickness", positive)};
}

Shape read_stack(const RecipeTable& table, const GeometryContext& context) {
  const std::vector<MaterialId> of_layers = table.material_list("materials", context.materials);
  const std::vector<double> thickness =
      table.quantities("thicknesses", Dimension::length, {}, positive);
  StackShape stack{.layers = {}, .count = static_cast<int>(table.integer("count", count_limits))};
  if (of_layers.size() != thickness.size() && table.ok("materials") && table.ok("thicknesses")) {
    table.error("thicknesses", "has " + std::to_string(thickness.size()) + " entries for " +
                                   std::to_string(of_layers.size()) + " materials");
  }
  for (std::size_t k = 0; k < std::min(of_layers.size(), thickness.size()); ++k) {
    stack.layers.push_back({.material = of_layers[k], .thickness = thickness[k]});
  }
  return stack;
}

Shape read_trench(const RecipeTable& table, const GeometryContext& context) {
  const int along = table.choice<int>("along", axes, "y");
  return TrenchShape{.width = table.length("width", positive),
                     .centre = table.length("center", any_position),
                     .along = along,
                     .cut = read_cut(table, context.materials),
                     .repeat = read_row(table, along)};
}

Shape read_hole(const RecipeTable& table, const GeometryContext& context) {
  return HoleShape{.radius = table.length("radius", positive),
                   .centre = read_center(table),
                   .cut = read_cut(table, context.materials),
                   .repeat = read_lattice(table)};
}

Shape read_fin(const RecipeTable& table, const GeometryContext& context) {
  const int along = table.choice<int>("along", axes, "y");
  return FinShape{.material = table.material("material", context.materials),
                  .width = table.length("width", positive),
                  .height = table.length("height", positive),
                  .centre = table.length("center", any_position),
                  .along = along,
                  .taper = table.angle("taper", taper_limits),
                  .repeat = read_row(table, along)};
}

void refuse_distant(const RecipeTable& table, const std::array<Point2, 2>& extent,
                    std::span<const double> origin, const Sides& sides) {
  const auto range = [](double lower, double upper) {
    return rounded_number(lower) + " to " + rounded_number(upper) + " nm";
  };
  table.error("origin",
              fmt::format("leaves nothing of the layer in the domain: it reaches from {} "
                          "in x and {} in y of the layout, and the domain takes {} and {}",
                          range(extent[0][0], extent[1][0]), range(extent[0][1], extent[1][1]),
                          range(origin[0] + sides.lower[0], origin[0] + sides.upper[0]),
                          range(origin[1] + sides.lower[1], origin[1] + sides.upper[1])));
}

/// One layer of a layout; its origin becomes the middle of the domain.
Outline read_layout(const RecipeTable& table, const GeometryContext& context) {
  constexpr Limits numbers{.minimum = 0, .maximum = 65535};
  PolygonOutline outline{.loops = {}, .rule = PolygonOutline::Rule::any};
  const std::string file = table.file("file");
  GdsSelection selection{.cell = table.text("cell", ""),
                         .layer = static_cast<int>(table.integer("layer", numbers))};
  if (table.has("datatype")) {
    selection.datatype = static_cast<int>(table.integer("datatype", numbers));
  }
  const std::vector<double> origin =
      table.quantities("origin", Dimension::length, {2, 2}, any_position);
  if (!table.ok()) return outline;
  const Sides sides = context.frame.sides();
  // Where the domain itself is not right, all of it is looked at.
  if (context.frame.spacing > 0)
    selection.window = {{{origin[0] + sides.lower[0], origin[1] + sides.lower[1]},
                         {origin[0] + sides.upper[0], origin[1] + sides.upper[1]}}};
  try {
    const std::string content = table.content("file", file);
    Layout layout = read_gds(file, content, selection);
    for (const std::string& doubt : layout.doubts) table.warning("file", doubt);
    if (layout.loops.empty()) refuse_distant(table, layout.extent, origin, sides);
    outline.loops = std::move(layout.loops);
  } catch (const InputError& error) {
    table.error("file", error.what());
  }
  for (Loop& loop : outline.loops) {
    for (Point2& point : loop) point = {point[0] - origin[0], point[1] - origin[1]};
  }
  return outline;
}

Outline read_outline(const RecipeTable& table, const GeometryContext& context) {
  enum class Kind { slot, circle, rectangle, polygon, gds };
  const Choices<Kind> kinds{{"trench", Kind::slot},
                            {"hole", Kind::circle},
                            {"rectangle", Kind::rectangle},
                            {"polygon", Kind::polygon},
                            {"gds", Kind::gds}};
  const Kind kind = table.choice<Kind>("shape", kinds);
  if (!table.ok("shape")) {
    table.accept_rest();
    return SlotOutline{};
  }
  switch (kind) {
    case Kind::slot: {
      const int along = table.choice<int>("along", axes, "y");
      return SlotOutline{.width = table.length("width", positive),
                         .centre = table.length("center", any_position),
                         .along = along,
                         .repeat = read_row(table, along)};
    }
    case Kind::circle:
      return CircleOutline{.radius = table.length("radius", positive),
                           .centre = read_center(table),
                           .repeat = read_lattice(table)};
    case Kind::polygon:
      return PolygonOutline{.loops = table.polygons("points")};
    case Kind::gds:
      return read_layout(table, context);
    case Kind::rectangle:
      break;
  }
  const std::vector<double> size = table.quantities("size", Dimension::length, {2, 2}, positive);
  return RectangleOutline{.size = {size[0], size[1]},
                          .centre = read_center(table),
                          .corner_radius = table.length("corner_radius", radius_limits),
                          .repeat = read_lattice(table)};
}

MaskShape read_mask_shape(const RecipeTable& table, const GeometryContext& context) {
  MaskShape mask;
  mask.material = table.material("material", context.materials);
  mask.thickness = table.length("thickness", positive);
  mask.taper = table.angle("taper", taper_limits);
  const bool is_inverted = table.flag("invert", false);
  const bool opening = table.has("opening");
  if (opening == table.has("resist")) {
    table.error("",
                "a mask says either what is cut out, opening = { shape = ... }, or what stays, "
                "resist = { shape = ... }");
    table.accept_rest();
    mask.outline = SlotOutline{};
    return mask;
  }
  mask.outlines =
      opening != is_inverted ? MaskShape::Outlines::opening : MaskShape::Outlines::resist;
  mask.outline = read_outline(table.table(opening ? "opening" : "resist"), context);
  return mask;
}

Shape read_mask_in_geometry(const RecipeTable& table, const GeometryContext& context) {
  return read_mask_shape(table, context);
}

/// The mesh at its place; empty when the file cannot be read.
std::shared_ptr<const TriMesh> load_mesh(const RecipeTable& table, const std::string& file,
                                         double unit, const std::vector<double>& offset) {
  TriMesh mesh;
  try {
    const std::string content = table.content("file", file);
    MeshFile read = read_mesh_file(file, content);
    for (const auto& things : {read.left_out, read.data_left_out}) {
      if (!things.empty()) table.warning("file", left_out_text(things));
    }
    mesh = std::move(read.mesh);
  } catch (const InputError& error) {
    if (table.ok("file")) table.error("file", error.what());
  }
  for (Vec3f& r : mesh.vertices) {
    r = Vec3f(unit * Vec3d(r) + Vec3d{offset[0], offset[1], offset[2]});
  }
  return std::make_shared<const TriMesh>(std::move(mesh));
}

Shape read_mesh_shape(const RecipeTable& table, const GeometryContext& context) {
  const std::string file = table.file("file");
  const double unit = table.length(
      "unit", {.fallback = "1 nm", .minimum = 0, .maximum = 2 * longest_length, .exclusive = true});
  const std::vector<double> offset =
      table.quantities("offset", Dimension::length, {3, 3}, any_position);
  MeshShape shape{.mesh = load_mesh(table, file, unit, offset)};
  if (table.flag("cut", false)) return shape;
  shape.material = table.material("material", context.materials);
  return shape;
}

using ShapeReader = Shape (*)(const RecipeTable&, const GeometryContext&);
const Choices<ShapeReader> readers{
    {"wafer", read_wafer},           {"layer", read_layer},    {"stack", read_stack},
    {"trench", read_trench},         {"hole", read_hole},      {"fin", read_fin},
    {"mask", read_mask_in_geometry}, {"mesh", read_mesh_shape}};

}  // namespace

std::vector<Shape> read_geometry(std::span<const RecipeTable> tables, const Materials& materials,
                                 const Frame& frame) {
  const GeometryContext context{materials, frame};
  std::vector<Shape> shapes;
  for (const RecipeTable& table : tables) {
    const ShapeReader read = table.choice<ShapeReader>("shape", readers);
    if (!table.ok("shape")) {
      table.accept_rest();
      continue;
    }
    shapes.push_back(read(table, context));
  }
  return shapes;
}

MaskShape read_mask(const RecipeTable& table, const Materials& materials, const Frame& frame) {
  return read_mask_shape(table, {materials, frame});
}

}  // namespace scarp
