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
#include "core/recipe/number_table.h"
#include "core/recipe/quantity.h"
#include "core/trimmed.h"
#include "levelset/grid/welded.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/start/gds.h"
#include "levelset/start/layer_formula.h"
#include "mesh/files/mesh_file.h"

namespace scarp {

namespace {

constexpr Limits positive{.minimum = 0, .maximum = longest_length, .exclusive = true};
constexpr Limits any_position{
    .fallback = "0 nm", .minimum = -longest_length, .maximum = longest_length};

const Choices<int> axes{{"x", 0}, {"y", 1}};

constexpr double degree = 0.017453292519943295;
constexpr Limits taper_limits{.fallback = "0 deg", .minimum = -88 * degree, .maximum = 88 * degree};

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

Shape read_wafer(const RecipeTable& table, const GeometryScope& scope) {
  return WaferShape{.material = table.material("material", scope.materials)};
}

Shape read_layer(const RecipeTable& table, const GeometryScope& scope) {
  return LayerShape{.material = table.material("material", scope.materials),
                    .thickness = table.length("thickness", positive)};
}

Shape read_stack(const RecipeTable& table, const GeometryScope& scope) {
  const std::vector<MaterialId> of_layers = table.material_list("materials", scope.materials);
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

Shape read_trench(const RecipeTable& table, const GeometryScope& scope) {
  const int along = table.choice<int>("along", axes, "y");
  return TrenchShape{.width = table.length("width", positive),
                     .centre = table.length("center", any_position),
                     .along = along,
                     .cut = read_cut(table, scope.materials),
                     .repeat = read_row(table, along)};
}

Shape read_hole(const RecipeTable& table, const GeometryScope& scope) {
  return HoleShape{.radius = table.length("radius", positive),
                   .centre = read_center(table),
                   .cut = read_cut(table, scope.materials),
                   .repeat = read_lattice(table)};
}

Shape read_fin(const RecipeTable& table, const GeometryScope& scope) {
  const int along = table.choice<int>("along", axes, "y");
  return FinShape{.material = table.material("material", scope.materials),
                  .width = table.length("width", positive),
                  .height = table.length("height", positive),
                  .centre = table.length("center", any_position),
                  .along = along,
                  .taper = table.angle("taper", taper_limits),
                  .repeat = read_row(table, along)};
}

/// How an outline changes before it is drawn.
Sizing read_sizing(const RecipeTable& table) {
  Sizing sizing{.grow = table.length("grow", any_position)};
  sizing.is_round = table.choice<bool>("corners", {{"miter", false}, {"round", true}}, "miter");
  sizing.corner_radius = table.length("corner_radius", radius_limits);
  return sizing;
}

/// Which key a loss is due to: count(outline) is how much is lost.
template <class Count>
std::string sizing_key(const PolygonOutline& outline, const Count& count) {
  if (outline.sizing.corner_radius == 0) return "grow";
  PolygonOutline biased = outline;
  biased.sizing.corner_radius = 0;
  const bool is_lost_before = outline.sizing.grow != 0 && count(biased) >= count(outline);
  return is_lost_before ? "grow" : "corner_radius";
}

void warn_of_losses(const RecipeTable& table, const PolygonOutline& outline,
                    const GeometryScope& scope) {
  if (!table.ok() || !(scope.frame.spacing > 0) || outline.loops.empty() || scope.cut) return;
  const SizingLosses losses = sizing_losses(scope.frame, outline);
  const auto warn = [&](std::size_t SizingLosses::*lost, std::size_t all, const std::string& what) {
    if (losses.*lost == 0) return;
    const std::string key = sizing_key(outline, [&](const PolygonOutline& each) {
      return sizing_losses(scope.frame, each).*lost;
    });
    table.warning(key, fmt::format("{} of {} {} in the domain", losses.*lost, all, what));
  };
  warn(&SizingLosses::vanished, losses.shapes, "shapes vanish");
  warn(&SizingLosses::closed, losses.gaps, "gaps and holes close");
}

/// The part of the plane that a layout is read in.
std::array<Point2, 2> layout_window(const GeometryScope& scope, double reach) {
  if (scope.cut) return box_around(scope.frame, *scope.cut, reach);
  const Sides sides = scope.frame.sides();
  return {sides.lower, sides.upper};
}

/// That the box of a layout is as large as the domain.
void check_window(const RecipeTable& table, const std::array<Point2, 2>& window,
                  const Frame& frame) {
  const Sides sides = frame.sides();
  const Point2 size{window[1][0] - window[0][0], window[1][1] - window[0][1]};
  if (std::abs(size[0] - sides.width(0)) <= 1e-6 * frame.spacing &&
      std::abs(size[1] - sides.width(1)) <= 1e-6 * frame.spacing)
    return;
  const auto text = [](double length) { return format_quantity(length, Dimension::length); };
  table.error("window", fmt::format("is {} x {}, and the domain {} x {}; write domain.extent = "
                                    "[\"{}\", \"{}\"]",
                                    text(size[0]), text(size[1]), text(sides.width(0)),
                                    text(sides.width(1)), text(size[0]), text(size[1])));
}

/// The point of the layout that becomes the middle of the domain.
Point2 read_layout_origin(const RecipeTable& table, const GeometryScope& scope) {
  const std::array keys{"window", "center", "origin"};
  const auto* const given =
      std::ranges::find_if(keys, [&](const char* key) { return table.has(key); });
  const std::string_view chosen = given == keys.end() ? "origin" : *given;
  for (const std::string_view key : keys) {
    if (key == chosen || !table.has(key)) continue;
    table.error(key, fmt::format("{} says already what becomes the middle of the domain; leave "
                                 "one of them out",
                                 chosen));
  }
  Point2 origin{};
  for (const std::string key : {"center", "origin"}) {
    if (key != chosen && !table.has(key)) continue;
    const auto point = table.quantities(key, Dimension::length, {2, 2}, any_position);
    origin = {point[0], point[1]};
  }
  if (!table.has("window")) return origin;
  const auto window = table.corners("window");
  const bool is_known = scope.frame.spacing > 0 && !scope.cut && !scope.frame.is_section();
  if (is_known && table.ok("window")) check_window(table, window, scope.frame);
  return {0.5 * (window[0][0] + window[1][0]), 0.5 * (window[0][1] + window[1][1])};
}

/// The layers of a layout that an outline takes: one, or several in a formula.
struct ChosenLayers {
  std::vector<GdsLayer> layers;
  std::optional<LayerFormula> formula;
};

ChosenLayers read_layers(const RecipeTable& table) {
  constexpr Limits numbers{.minimum = 0, .maximum = 65535};
  ChosenLayers chosen;
  if (!table.has("layers")) {
    GdsLayer layer{.layer = static_cast<int>(table.integer("layer", numbers))};
    if (table.has("datatype"))
      layer.datatype = static_cast<int>(table.integer("datatype", numbers));
    chosen.layers.push_back(layer);
    return chosen;
  }
  for (const char* const key : {"layer", "datatype"}) {
    if (!table.has(key)) continue;
    table.error(key, "layers says already which layers are taken; leave one of them out");
    table.integer(key, numbers);
  }
  const std::string text = table.text("layers");
  if (!table.ok("layers")) return chosen;
  try {
    chosen.formula.emplace(text);
    chosen.layers = chosen.formula->layers();
  } catch (const InputError& error) {
    table.error("layers", error.what());
  }
  return chosen;
}

std::array<Point2, 2> around(std::span<const Layout> layouts, std::array<Point2, 2> box) {
  for (const Layout& layout : layouts) {
    for (const Loop& loop : layout.loops) {
      for (const Point2& point : loop) {
        for (std::size_t axis = 0; axis < 2; ++axis) {
          box[0][axis] = std::min(box[0][axis], point[axis]);
          box[1][axis] = std::max(box[1][axis], point[axis]);
        }
      }
    }
  }
  return box;
}

/// Layers of a layout in a window. Where what lies beyond the window comes back, several layers
/// have to be known there, too.
std::vector<Layout> load_layers(const std::string& file, const std::string& content,
                                GdsSelection selection, const ChosenLayers& chosen,
                                const Frame& frame) {
  std::vector<Layout> layouts = read_gds_layers(file, content, selection, chosen.layers);
  const bool is_periodic =
      std::ranges::find(frame.boundary, Boundary::periodic) != frame.boundary.end();
  if (!selection.window || layouts.size() < 2 || !is_periodic) return layouts;
  selection.window = around(layouts, *selection.window);
  return read_gds_layers(file, content, selection, chosen.layers);
}

/// Loops of a layout, shifted to their place in the domain.
PolygonOutline placed_outline(std::vector<Layout> layouts, const ChosenLayers& chosen,
                              const Point2& origin, const Frame& frame) {
  std::vector<std::vector<Loop>> of_layers;
  for (Layout& layout : layouts) {
    for (Loop& loop : layout.loops)
      for (Point2& point : loop) point = {point[0] - origin[0], point[1] - origin[1]};
    of_layers.push_back(std::move(layout.loops));
  }
  if (!chosen.formula)
    return {.loops = std::move(of_layers.front()), .rule = PolygonOutline::Rule::any};
  const RegionGrid grid = region_grid(frame);
  for (std::vector<Loop>& loops : of_layers) loops = grid.united(loops);
  return {.loops = chosen.formula->region(grid, of_layers), .rule = PolygonOutline::Rule::region};
}

void refuse_distant(const RecipeTable& table, std::span<const Layout> layouts, const Point2& origin,
                    const Sides& sides) {
  std::array<Point2, 2> extent = layouts.front().extent;
  for (const Layout& layout : layouts) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      extent[0][axis] = std::min(extent[0][axis], layout.extent[0][axis]);
      extent[1][axis] = std::max(extent[1][axis], layout.extent[1][axis]);
    }
  }
  const auto range = [](double lower, double upper) {
    return rounded_number(lower) + " to " + rounded_number(upper) + " nm";
  };
  table.error(table.has("window")   ? "window"
              : table.has("center") ? "center"
                                    : "origin",
              fmt::format("leaves nothing of the layer in the domain: it reaches from {} "
                          "in x and {} in y of the layout, and the domain takes {} and {}",
                          range(extent[0][0], extent[1][0]), range(extent[0][1], extent[1][1]),
                          range(origin[0] + sides.lower[0], origin[0] + sides.upper[0]),
                          range(origin[1] + sides.lower[1], origin[1] + sides.upper[1])));
}

/// Layers of a layout; its origin becomes the middle of the domain.
PolygonOutline read_layout(const RecipeTable& table, const GeometryScope& scope) {
  PolygonOutline none{.loops = {}, .rule = PolygonOutline::Rule::any};
  const Frame& frame = scope.frame;
  const std::string file = table.file("file");
  GdsSelection selection{.cell = table.text("cell", "")};
  const ChosenLayers chosen = read_layers(table);
  selection.is_in_formula = chosen.formula.has_value();
  const Point2 origin = read_layout_origin(table, scope);
  const Sizing sizing = read_sizing(table);
  if (!table.ok()) return none;
  // Where the domain itself is not right, all of it is looked at.
  if (frame.spacing > 0) {
    selection.window = layout_window(scope, sizing.reach());
    for (Point2& corner : *selection.window)
      corner = {corner[0] + origin[0], corner[1] + origin[1]};
  }
  try {
    const std::string content = table.content("file", file);
    std::vector<Layout> layouts = load_layers(file, content, selection, chosen, frame);
    std::vector<std::string> doubts;
    for (const Layout& layout : layouts)
      doubts.insert(doubts.end(), layout.doubts.begin(), layout.doubts.end());
    for (std::size_t n = 0; n < doubts.size(); ++n) {
      if (std::find(doubts.begin(), doubts.begin() + static_cast<std::ptrdiff_t>(n), doubts[n]) ==
          doubts.begin() + static_cast<std::ptrdiff_t>(n))
        table.warning("file", doubts[n]);
    }
    const bool is_empty =
        std::ranges::all_of(layouts, [](const Layout& layout) { return layout.loops.empty(); });
    if (is_empty && !scope.cut) refuse_distant(table, layouts, origin, frame.sides());
    if (is_empty || !(frame.spacing > 0)) return none;
    PolygonOutline outline = placed_outline(std::move(layouts), chosen, origin, frame);
    outline.sizing = sizing;
    if (chosen.formula && !scope.cut && outline.loops.empty())
      table.error("layers", "leaves nothing in the domain");
    return outline;
  } catch (const InputError& error) {
    table.error(chosen.formula ? "layers" : "file", error.what());
  }
  return none;
}

PolygonOutline read_polygon_outline(const RecipeTable& table) {
  PolygonOutline outline{.loops = table.polygons("points")};
  outline.sizing = read_sizing(table);
  return outline;
}

PolygonOutline checked(const RecipeTable& table, PolygonOutline outline,
                       const GeometryScope& scope) {
  // Of a section, nothing else looks at the whole of it.
  if (scope.cut && outline.rule == PolygonOutline::Rule::even_odd && table.ok("points")) {
    if (const auto fault = polygon_fault(outline.loops)) table.error("points", *fault);
  }
  if (table.ok() && !outline.sizing.is_none()) warn_of_losses(table, outline, scope);
  return outline;
}

Outline read_drawn_outline(const RecipeTable& table, const GeometryScope& scope) {
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
      return checked(table, read_polygon_outline(table), scope);
    case Kind::gds:
      return checked(table, read_layout(table, scope), scope);
    case Kind::rectangle:
      break;
  }
  const std::vector<double> size = table.quantities("size", Dimension::length, {2, 2}, positive);
  return RectangleOutline{.size = {size[0], size[1]},
                          .centre = read_center(table),
                          .corner_radius = table.length("corner_radius", radius_limits),
                          .repeat = read_lattice(table)};
}

constexpr const char* hole_in_section =
    "a hole is cut by domain.cut: in the section it is a slot that is infinite along y";

/// The same of a section, where the line meets fewer parts than it would without the sizing.
void warn_of_lost_parts(const RecipeTable& table, const Outline& outline, const PolygonOutline& met,
                        const GeometryScope& scope) {
  const auto* const sized = std::get_if<PolygonOutline>(&outline);
  if (sized == nullptr || sized->sizing.is_none()) return;
  PolygonOutline drawn = *sized;
  drawn.sizing = {};
  const std::size_t count = cut_outline(scope.frame, drawn, *scope.cut).loops.size();
  if (met.loops.size() >= count) return;
  const std::string key = sizing_key(*sized, [&](const PolygonOutline& each) {
    return count - std::min(count, cut_outline(scope.frame, each, *scope.cut).loops.size());
  });
  table.warning(key, fmt::format("of {} parts on the line of domain.cut {} vanish or join others",
                                 count, count - met.loops.size()));
}

/// As it is drawn, or of a section what the line meets of it.
Outline read_outline(const RecipeTable& table, const GeometryScope& scope) {
  Outline outline = read_drawn_outline(table, scope);
  if (!scope.cut || !table.ok() || !(scope.frame.spacing > 0)) return outline;
  PolygonOutline met = cut_outline(scope.frame, outline, *scope.cut);
  warn_of_lost_parts(table, outline, met, scope);
  if (met.loops.empty()) {
    table.warning("shape", "the line of domain.cut meets nothing of it");
  } else if (std::holds_alternative<CircleOutline>(outline)) {
    table.warning("shape", hole_in_section);
  }
  return met;
}

MaskShape read_mask_shape(const RecipeTable& table, const GeometryScope& scope) {
  MaskShape mask;
  mask.material = table.material("material", scope.materials);
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
  mask.outline = read_outline(table.table(opening ? "opening" : "resist"), scope);
  return mask;
}

Shape read_mask_in_geometry(const RecipeTable& table, const GeometryScope& scope) {
  return read_mask_shape(table, scope);
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

/// What is inside lines of a cross-section; nothing where they are cut through.
std::optional<ProfileShape> profile_of(const std::vector<Polyline>& lines) {
  ProfileShape profile;
  for (const Polyline& line : lines) {
    const bool is_closed = line.points.size() > 3 && line.points.front() == line.points.back();
    if (!is_closed && lines.size() > 1) return std::nullopt;
    profile.is_line = !is_closed;
    profile.loops.emplace_back(line.points.begin(), line.points.end() - (is_closed ? 1 : 0));
  }
  return profile;
}

/// Reads a contour: x and z of a point per line, along the surface.
ProfileShape read_contour(const RecipeTable& table) {
  const std::array columns{Column{.name = "x", .dimension = Dimension::length},
                           Column{.name = "z", .dimension = Dimension::length}};
  const std::string file = table.file("file");
  if (!table.ok("file")) return {};
  Polyline contour;
  try {
    for (const auto& row : read_csv(file, table.content("file", file), columns).values)
      contour.points.push_back({row[0], row[1]});
    if (contour.points.size() < 2) table.error("file", "has fewer than two points");
  } catch (const InputError& error) {
    table.error("file", error.what());
  }
  return table.ok("file") ? *profile_of({contour}) : ProfileShape{};
}

/// A line goes from one side of the domain to the other.
void reach_sides(const RecipeTable& table, ProfileShape& profile, const Frame& frame) {
  if (!profile.is_line || profile.loops.empty() || !(frame.spacing > 0)) return;
  Loop& line = profile.loops[0];
  if (line.front()[0] > line.back()[0]) std::ranges::reverse(line);
  const Sides sides = frame.sides();
  if (line.front()[0] > sides.lower[0] + frame.spacing ||
      line.back()[0] < sides.upper[0] - frame.spacing) {
    table.error("file",
                fmt::format("goes from x = {} to {} nm and is not closed; it has to reach "
                            "both sides of the domain, {} and {} nm",
                            rounded_number(line.front()[0]), rounded_number(line.back()[0]),
                            rounded_number(sides.lower[0]), rounded_number(sides.upper[0])));
    return;
  }
  // Straight on beyond the sides, where it is cut.
  line.insert(line.begin(),
              {sides.lower[0] - frame.spacing - std::abs(line.front()[0]), line.front()[1]});
  line.push_back({sides.upper[0] + frame.spacing + std::abs(line.back()[0]), line.back()[1]});
}

Shape read_profile(const RecipeTable& table, const GeometryScope& scope) {
  ProfileShape profile;
  if (table.has("file")) {
    if (table.has("points")) {
      table.error("file", "points says already what the profile is; leave one of them out");
      table.polygons("points");
    }
    profile = read_contour(table);
  } else {
    profile.loops = table.polygons("points");
  }
  if (!table.ok("file") || !table.ok("points")) profile.loops.clear();
  reach_sides(table, profile, scope.frame);
  if (table.flag("cut", false)) return profile;
  profile.material = table.material("material", scope.materials);
  return profile;
}

/// "y = 0 nm": the plane in which a mesh is cut for a section.
std::optional<CutPlane> read_plane(const RecipeTable& table, const GeometryScope& scope) {
  const std::string text = table.text("section");
  if (!table.ok("section")) return std::nullopt;
  if (!scope.frame.is_slice()) {
    table.error("section", "is the plane of a cross-section, mode = \"2d\"; leave it out");
  } else if (scope.cut) {
    table.error("section", "domain.cut says already where the mesh is cut; leave this out");
  }
  const std::size_t equals = text.find('=');
  const std::string_view axis = trimmed(std::string_view(text).substr(0, equals));
  if (equals == std::string::npos || (axis != "x" && axis != "y")) {
    table.error("section",
                fmt::format("\"{}\" is no plane; write \"y = 0 nm\" or \"x = 0 nm\"", text));
    return std::nullopt;
  }
  try {
    return CutPlane::across(
        axis == "x" ? 0 : 1,
        parse_quantity(trimmed(std::string_view(text).substr(equals + 1)), Dimension::length));
  } catch (const InputError& error) {
    table.error("section", error.what());
    return std::nullopt;
  }
}

/// What a plane meets of a mesh. Bodies may overlap.
ProfileShape cut_mesh(const RecipeTable& table, const TriMesh& mesh, const CutPlane& plane,
                      const Frame& frame) {
  const std::vector<Polyline> lines = cross_section(welded(mesh), plane);
  if (lines.empty()) table.warning("file", "the plane of the section meets nothing of it");
  std::optional<ProfileShape> profile = profile_of(lines);
  if (!profile) {
    table.error("file",
                "is open where the plane of the section cuts it; close the mesh, or let one patch "
                "reach from side to side");
    return {};
  }
  if (profile->is_line) {
    reach_sides(table, *profile, frame);
    return *profile;
  }
  // The gas lies to the left of the lines.
  for (Loop& loop : profile->loops) std::ranges::reverse(loop);
  profile->loops = region_grid(frame).combined(profile->loops, {}, RegionGrid::Combination::sum);
  return *profile;
}

Shape read_mesh_shape(const RecipeTable& table, const GeometryScope& scope) {
  const std::string file = table.file("file");
  const double unit = table.length(
      "unit", {.fallback = "1 nm", .minimum = 0, .maximum = 2 * longest_length, .exclusive = true});
  const std::vector<double> offset =
      table.quantities("offset", Dimension::length, {3, 3}, any_position);
  const auto mesh = load_mesh(table, file, unit, offset);
  std::optional<MaterialId> material;
  const bool is_flat = scope.frame.is_slice() && (scope.cut || table.has("section"));
  std::optional<CutPlane> plane;
  if (table.has("section") || (is_flat && !scope.cut)) plane = read_plane(table, scope);
  if (scope.cut) plane = CutPlane{.origin = scope.cut->middle, .along = scope.cut->along};
  if (!table.flag("cut", false)) material = table.material("material", scope.materials);
  if (!is_flat) return MeshShape{.mesh = mesh, .material = material};
  ProfileShape profile;
  if (table.ok() && plane) profile = cut_mesh(table, *mesh, *plane, scope.frame);
  profile.material = material;
  return profile;
}

using ShapeReader = Shape (*)(const RecipeTable&, const GeometryScope&);
const Choices<ShapeReader> readers{
    {"wafer", read_wafer},           {"layer", read_layer},     {"stack", read_stack},
    {"trench", read_trench},         {"hole", read_hole},       {"fin", read_fin},
    {"mask", read_mask_in_geometry}, {"mesh", read_mesh_shape}, {"profile", read_profile}};

/// The shape, or of a section what the line meets of it.
std::vector<Shape> in_section(const RecipeTable& table, const Shape& shape,
                              const GeometryScope& scope) {
  if (!scope.cut || !table.ok() || !(scope.frame.spacing > 0)) return {shape};
  std::vector<Shape> shapes = cut_shape(scope.frame, shape, *scope.cut);
  if (shapes.empty() && !std::holds_alternative<MaskShape>(shape)) {
    table.warning("shape", "the line of domain.cut meets nothing of it");
  } else if (std::holds_alternative<HoleShape>(shape)) {
    table.warning("shape", hole_in_section);
  }
  return shapes;
}

}  // namespace

StartGeometry read_geometry(std::span<const RecipeTable> tables, const GeometryScope& scope) {
  StartGeometry start;
  for (std::size_t n = 0; n < tables.size(); ++n) {
    const RecipeTable& table = tables[n];
    const ShapeReader read = table.choice<ShapeReader>("shape", readers);
    if (!table.ok("shape")) {
      table.accept_rest();
      continue;
    }
    const Shape shape = read(table, scope);
    const std::vector<Shape> shapes = in_section(table, shape, scope);
    start.shapes.insert(start.shapes.end(), shapes.begin(), shapes.end());
    start.tables.insert(start.tables.end(), shapes.size(), n);
  }
  return start;
}

MaskShape read_mask(const RecipeTable& table, const GeometryScope& scope) {
  return read_mask_shape(table, scope);
}

}  // namespace scarp
