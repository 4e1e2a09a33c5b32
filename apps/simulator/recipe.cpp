#include "apps/simulator/recipe.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "apps/simulator/recipe_geometry.h"
#include "apps/simulator/recipe_names.h"
#include "apps/simulator/recipe_steps.h"
#include "apps/simulator/recipe_warnings.h"
#include "apps/simulator/state.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/recipe_table.h"
#include "core/system/hash.h"
#include "core/system/memory_amount.h"
#include "core/system/peak_memory.h"
#include "levelset/motion/advect.h"
#include "levelset/operations/placed_shapes.h"
#include "models/open_wafer.h"

namespace scarp {

namespace {

constexpr double most_outputs = 10000;
constexpr std::size_t most_cd_heights = 100;
constexpr std::size_t most_sections = 100;
constexpr double most_cells = 1e6;  // along an axis
constexpr Limits lengths{.minimum = 0, .maximum = longest_length, .exclusive = true};
// A grid finer than an atom is a mistake, and its cells could not be counted.
constexpr Limits spacings{.minimum = 1e-3, .maximum = longest_length};

const Choices<Boundary> boundaries{{"reflective", Boundary::reflective},
                                   {"periodic", Boundary::periodic}};

// What the band takes for every cell of the surface at least: its nodes in single precision, in the
// layer, the speeds and the buffers of a time step. Units: bytes.
constexpr double memory_per_cell = 256;

void require_memory(const RecipeTable& table, std::string_view key, std::string_view what,
                    double cells) {
  const double needed = memory_per_cell * cells;
  const double there = 1024 * 1024 * available_memory_mb();
  if (needed < there) return;
  table.error(key, fmt::format("{} need {:.3g} GB or more, this machine has {:.3g} GB; use a "
                               "coarser spacing or a smaller geometry",
                               what, 1e-9 * needed, 1e-9 * there));
}

// The line through a layout along which a section lies.
struct DrawnLine {
  LineCut cut;
  double length = 0;
};

std::optional<DrawnLine> read_line(const RecipeTable& table, bool is_section) {
  const std::string_view key = "cut";
  if (!table.has(key)) return std::nullopt;
  const std::string text = table.text(key);
  if (!table.ok(key)) return std::nullopt;
  if (!is_section) {
    table.error(key, "is a line for mode = \"2d\"; leave it out to simulate the whole layout");
    return std::nullopt;
  }
  try {
    const auto [from, to] = parse_line(text);
    const double dx = to[0] - from[0];
    const double dy = to[1] - from[1];
    const double length = std::sqrt(dx * dx + dy * dy);
    return DrawnLine{.cut = {.middle = {0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])},
                             .along = {dx / length, dy / length}},
                     .length = length};
  } catch (const InputError& error) {
    table.error(key, error.what());
    return std::nullopt;
  }
}

// A number of cells from an extent; at least two, or a mirror plane would meet its neighbour.
int read_cells(const RecipeTable& table, double extent, double spacing, std::size_t axis) {
  const auto text = [](double length) { return format_quantity(length, Dimension::length); };
  const double cells = extent / spacing;
  const double whole = std::round(cells);
  const std::string key = fmt::format("extent[{}]", axis);
  if (cells > most_cells * (1 + 1e-6)) {
    table.error(
        key, fmt::format("{} is {:.3g} spacings of {}; the most is {:.0f}: an extent of {}, "
                         "or a spacing of {:.3g} nm",
                         text(extent), cells, text(spacing), most_cells, text(most_cells * spacing),
                         extent / most_cells));
    return 2;
  }
  if (std::abs(cells - whole) > 1e-6 * whole || whole < 2) {
    table.error(key, fmt::format("{} is {:.6g} spacings; it has to be a whole number of them, at "
                                 "least 2, for example {}",
                                 text(extent), cells, text(std::max(whole, 2.0) * spacing)));
    return 2;
  }
  return static_cast<int>(whole);
}

// The extent of a section along a line: as long as the line, in whole spacings, or as its own key
// has it.
std::vector<double> read_line_extent(const RecipeTable& table, const DrawnLine& line,
                                     double spacing) {
  const auto text = [](double length) { return format_quantity(length, Dimension::length); };
  if (table.has("extent")) {
    std::vector<double> extent =
        table.quantities("extent", Dimension::length,
                         {.minimum = 1, .maximum = 1, .why = " with mode = \"2d\""}, lengths);
    if (table.ok("extent") && table.ok("spacing") &&
        std::abs(extent[0] - line.length) > 0.5 * spacing * (1 + 1e-6))
      table.error("extent[0]",
                  fmt::format("{} is not the length of the line, {}; leave extent out, or write "
                              "extent = [\"{}\"]",
                              text(extent[0]), text(line.length), text(line.length)));
    return extent;
  }
  if (!table.ok("spacing")) return {line.length};
  const double cells = std::max(std::round(line.length / spacing), 2.0);
  const double length = cells * spacing;
  if (std::abs(length - line.length) > 0.01 * spacing)
    table.warning("cut",
                  fmt::format("the line is {} long, {:.6g} spacings; the section is {} long, "
                              "with the same middle",
                              text(line.length), line.length / spacing, text(length)));
  return {length};
}

Frame read_frame(const RecipeTable& table, std::optional<LineCut>& cut) {
  enum class Mode { solid, section, round };
  const Choices<Mode> modes{
      {"3d", Mode::solid}, {"2d", Mode::section}, {"axisymmetric", Mode::round}};
  Frame frame;
  frame.spacing = table.length("spacing", spacings);
  const Mode mode = table.choice<Mode>("mode", modes, "3d");
  frame.two_dimensional = mode != Mode::solid;
  frame.axisymmetric = mode == Mode::round;
  const std::size_t axis_count = frame.two_dimensional ? 1 : 2;
  const ListSize axes{.minimum = axis_count,
                      .maximum = axis_count,
                      .why = frame.axisymmetric      ? " with mode = \"axisymmetric\""
                             : frame.two_dimensional ? " with mode = \"2d\""
                                                     : " with mode = \"3d\""};
  const std::optional<DrawnLine> line = read_line(table, mode == Mode::section);
  if (line) cut = line->cut;
  const std::vector<double> extent =
      line ? read_line_extent(table, *line, frame.spacing)
           : table.quantities("extent", Dimension::length, axes, lengths);
  const std::vector<Boundary> boundary =
      table.choices<Boundary>("boundary", boundaries, axes, "reflective");
  frame.cells = {2, 1};
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    frame.boundary[axis] = boundary[axis];
    if (table.ok("extent") && table.ok("spacing")) {
      frame.cells[axis] = read_cells(table, extent[axis], frame.spacing, axis);
    }
  }
  if (frame.is_around_axis() && frame.cells[0] % 2 != 0 && table.ok("extent")) {
    table.error("extent[0]", fmt::format("is {} spacings, and the axis is in the middle of it; it "
                                         "has to be an even number of them, for example {}",
                                         frame.cells[0],
                                         format_quantity((frame.cells[0] + 1) * frame.spacing,
                                                         Dimension::length)));
    ++frame.cells[0];
  }
  if (frame.is_around_axis() && frame.boundary[0] == Boundary::periodic)
    table.error("boundary", "what goes around an axis has one side, which is \"reflective\"");
  require_memory(table, "extent", fmt::format("{} x {} cells", frame.cells[0], frame.cells[1]),
                 static_cast<double>(frame.cells[0]) * frame.cells[1]);
  return frame;
}

Domain read_domain(const RecipeTable& table) {
  std::optional<LineCut> cut;
  const Frame frame = read_frame(table, cut);
  const bool asks = table.choice<bool>("symmetry", {{"none", false}, {"auto", true}}, "none");
  return {.frame = frame, .uses_symmetry = asks || frame.is_around_axis(), .cut = cut};
}

Simplification read_simplify(const RecipeTable& table, const Frame& frame) {
  const Choices<SimplifyMethod> methods{{"curvature", SimplifyMethod::curvature},
                                        {"paper", SimplifyMethod::paper},
                                        {"lindstrom-turk", SimplifyMethod::lindstrom_turk},
                                        {"length", SimplifyMethod::length}};
  const std::optional<bool> enabled = table.flag_or("auto", "enabled", !frame.two_dimensional);
  if (enabled == true && frame.two_dimensional) {
    table.error("enabled", "the mesh of a cross-section is not simplified; leave this out");
  }
  const double h = frame.spacing;
  SimplifyOptions options;
  options.method = table.choice<SimplifyMethod>("method", methods, "curvature");
  options.sides = frame.sides();
  options.spacing = h;
  options.l0 = table.length_or_multiple("l0", h, {.fallback = "0.6", .minimum = 0});
  options.step_length = table.length_or_multiple("step_length", h, {.fallback = "2", .minimum = 0});
  // The flux on a facet is one number, and varies on flat walls, too: with 8 spacings the profile
  // of configs/trench_deposition has an error of .22 spacings below the mouth, with 3 of .12.
  const std::string l_max = format_number(std::max(3.0, *options.l0 / h));
  options.l_max = table.length_or_multiple("l_max", h, {.fallback = l_max, .minimum = 0});
  options.max_error = table.length_or_multiple(
      "max_error", h, {.fallback = "0.1", .minimum = 0, .exclusive = true});
  options.curvature_threshold =
      table.number("curvature_threshold", {.fallback = "0", .minimum = 0}) / h;
  options.shape_weight = table.number("shape_weight", {.fallback = "4e-6", .minimum = 0});
  const double remove = table.fraction("remove", "1");
  if (remove < 1) options.remove = remove;
  options.measure = false;  // max_error proves the distance
  if (enabled == false || frame.two_dimensional) return {};
  return {.options = options, .where_it_pays = !enabled};
}

// Units: bytes.
std::uint64_t read_memory(const RecipeTable& table, std::string_view key,
                          std::string_view fallback) {
  const std::string text = table.text(key, fallback);
  const auto bytes = parse_memory(text);
  if (!bytes)
    table.error(key, fmt::format("\"{}\" is not an amount of memory of 1 MB or more; write for "
                                 "example \"512 MB\" or \"2 GB\"",
                                 text));
  return bytes.value_or(0);
}

FluxOptions read_flux(const RecipeTable& table, const Frame& frame) {
  const Choices<FluxOptions::Engine> engines{{"auto", FluxOptions::Engine::automatic},
                                             {"forward", FluxOptions::Engine::forward},
                                             {"gather", FluxOptions::Engine::gather}};
  FluxOptions options;
  options.sides = frame.sides();
  options.two_dimensional = frame.is_slice();
  options.axisymmetric = frame.is_around_axis();
  options.spacing = frame.spacing;
  options.engine = table.choice<FluxOptions::Engine>("engine", engines, "auto");
  if (!table.has("position_error")) {
    options.target_error =
        table.number("target_error", {.fallback = "0.01", .minimum = 1e-6, .maximum = 1});
  }
  if (table.has("rays")) {
    options.rays =
        static_cast<std::uint64_t>(table.integer("rays", {.minimum = 1, .maximum = most_rays}));
  }
  options.max_rays = static_cast<std::uint64_t>(
      table.integer("max_rays", {.fallback = "1000000000", .minimum = 1, .maximum = most_rays}));
  options.memory_limit = read_memory(table, "memory_limit", "1 GB");
  options.seed = static_cast<std::uint64_t>(
      table.integer("seed", {.fallback = "1", .minimum = 0, .maximum = 9e15}));
  return options;
}

// Units: nm; 0 if the error of the flux is the target.
double read_position_error(const RecipeTable& table, const Frame& frame) {
  const std::string_view key = "position_error";
  if (!table.has(key)) return 0;
  for (const std::string other : {"target_error", "rays"}) {
    if (table.has(other))
      table.error(other, "position_error and " + other + " exclude each other; leave one out");
  }
  return table.length_or_multiple(key, frame.spacing, {.minimum = 1e-6, .maximum = 1});
}

// Units: nm.
double read_kept_distance(const RecipeTable& table, const Frame& frame) {
  return table.length_or_multiple("keep_mesh_within", frame.spacing,
                                  {.fallback = "0.05", .minimum = 0, .maximum = 0.5});
}

// Units: nm.
double read_carried_distance(const RecipeTable& table, const Frame& frame) {
  return table.length_or_multiple("carry_within", frame.spacing,
                                  {.fallback = "0.01", .minimum = 0, .maximum = 1});
}

CoverageOptions read_coverages(const RecipeTable& table) {
  return {.tolerance = table.number("coverage_tolerance",
                                    {.fallback = "0.0001", .minimum = 1e-6, .maximum = 1}),
          .most_iterations = static_cast<int>(table.integer(
              "coverage_iterations", {.fallback = "200", .minimum = 1, .maximum = 1e6}))};
}

FluxPlan read_flux_plan(const RecipeTable& table, const Frame& frame) {
  return {
      .options = read_flux(table, frame),
      .position_error = read_position_error(table, frame),
      .warn_above = table.time("warn_above", {.fallback = "24 h", .minimum = 0, .exclusive = true}),
      .keep_mesh_within = read_kept_distance(table, frame),
      .carry_within = read_carried_distance(table, frame),
      .coverages = read_coverages(table)};
}

Advection read_advection(const RecipeTable& table) {
  const Choices<Scheme> schemes{
      {"first_order", Scheme::first_order}, {"eno2", Scheme::eno2}, {"weno5", Scheme::weno5}};
  return {.scheme = table.choice<Scheme>("scheme", schemes, "eno2"),
          .cfl = table.number("cfl", {.fallback = "0.4", .minimum = 0.01, .maximum = max_cfl})};
}

// That the grid of a state is the one that the recipe describes.
void refuse_other_grid(const RecipeTable& domain, const Frame& wanted, const Frame& found) {
  const auto differs = [&](const std::string& key, bool is_same, const std::string& there) {
    if (!is_same)
      domain.error(key, fmt::format("differs from the state that start names, which has {}; a "
                                    "state cannot be moved or resampled",
                                    there));
    return !is_same;
  };
  const auto length = [](double value) { return format_quantity(value, Dimension::length); };
  const bool other_mode = differs(
      "mode",
      wanted.two_dimensional == found.two_dimensional && wanted.axisymmetric == found.axisymmetric,
      '"' + mode_name(found) + '"');
  const bool other_spacing =
      differs("spacing", wanted.spacing == found.spacing, length(found.spacing));
  if (other_mode) return;
  for (std::size_t axis = 0; axis < (wanted.two_dimensional ? 1 : 2); ++axis) {
    const bool periodic = found.boundary[axis] == Boundary::periodic;
    differs(fmt::format("boundary[{}]", axis), wanted.boundary[axis] == found.boundary[axis],
            periodic ? "\"periodic\"" : "\"reflective\"");
    if (!other_spacing)
      differs(fmt::format("extent[{}]", axis), wanted.cells[axis] == found.cells[axis],
              length(found.cells[axis] * found.spacing));
  }
}

std::optional<StartState> read_start(const RecipeTable& root, const Frame& frame,
                                     const Materials& materials, const LoadStart& load) {
  const std::filesystem::path state = root.file("start");
  if (!load) root.error("start", "a state cannot be read here");
  if (!root.ok("start")) return std::nullopt;
  StartState start;
  try {
    start = load(state, materials);
  } catch (const InputError& error) {
    root.error("start", error.what());
    return std::nullopt;
  }
  if (root.ok("domain")) refuse_other_grid(root.table("domain"), frame, start.state->layers.frame);
  return start;
}

// Each output is a handful of files: an interval of another unit by mistake would fill the disk.
double read_output_interval(const RecipeTable& table, std::span<const ProcessStep> steps) {
  const double every = table.time("every", {.fallback = "0 s", .minimum = 0});
  double duration = 0;
  for (const ProcessStep& step : steps) duration += step.duration;
  if (every > 0 && duration / every > most_outputs) {
    table.error("every",
                fmt::format("{} gives {:.2g} outputs in {}; the most is {:g}: write {} or more",
                            format_quantity(every, Dimension::time), duration / every,
                            format_quantity(duration, Dimension::time), most_outputs,
                            format_quantity(duration / most_outputs, Dimension::time)));
  }
  return every;
}

std::vector<SectionLine> read_sections(const RecipeTable& table, const Frame& frame,
                                       bool is_domain_known) {
  std::vector<SectionLine> lines;
  if (!table.has("sections")) return lines;
  const std::vector<std::string> texts =
      table.texts("sections", {.minimum = 0, .maximum = most_sections});
  // Nothing can be said about lines in an unknown domain.
  for (std::size_t n = 0; n < texts.size() && is_domain_known; ++n) {
    try {
      lines.push_back(parse_section(texts[n], frame));
    } catch (const InputError& error) {
      table.error(fmt::format("sections[{}]", n), error.what());
    }
  }
  return lines;
}

// By default the masks are those of the start geometry and of the steps.
MetrologyOptions read_metrology(const RecipeTable& table, std::span<const Shape> start,
                                std::span<const ProcessStep> steps, const Materials& materials,
                                std::span<const MaterialId> occurring) {
  std::vector<std::string> masks;
  const auto add = [&](const MaskShape& mask) {
    const std::string name = '"' + materials[mask.material].name + '"';
    if (std::ranges::find(masks, name) == masks.end()) masks.push_back(name);
  };
  for (const Shape& shape : start)
    if (const auto* const mask = std::get_if<MaskShape>(&shape); mask && !mask->is_ridge)
      add(*mask);
  for (const ProcessStep& step : steps)
    if (const auto* const mask = step.operation ? std::get_if<MaskFilm>(&*step.operation) : nullptr)
      add(mask->shape);
  MetrologyOptions options{.masks =
                               table.material_list("masks", materials, {.minimum = 0},
                                                   fmt::format("[{}]", fmt::join(masks, ", ")))};
  for (const MaterialId mask : options.masks) {
    if (occurring.empty() || std::ranges::find(occurring, mask) != occurring.end()) continue;
    table.error("masks",
                fmt::format("{} is neither on the wafer nor deposited", materials[mask].name));
  }
  const auto read_heights = [&](std::string_view key, std::vector<double>& heights) {
    if (!table.has(key)) return;
    heights = table.quantities(key, Dimension::length, {.minimum = 0, .maximum = most_cd_heights},
                               {.minimum = -longest_length, .maximum = longest_length});
  };
  read_heights("cd_at", options.cd_heights);
  read_heights("angle_at", options.angle_heights);
  return options;
}

// What the line of a section makes of a shape may have other keys than its table.
void note_problem(const RecipeTable& table, const ShapeProblem& problem) {
  const bool is_of_hole = problem.key == "width" && table.has("radius");
  const bool is_of_fin = problem.key == "resist.shape" && !table.has("resist");
  const bool is_of_file = problem.key == "points" && table.has("file");
  table.error(is_of_hole   ? "radius"
              : is_of_fin  ? "width"
              : is_of_file ? "file"
                           : problem.key,
              problem.message);
}

// That the shapes make a geometry, by themselves or on what a state has, and that the machine can
// hold it.
void check_geometry(const RecipeTable& root, std::span<const RecipeTable> tables,
                    const Frame& frame, const StartGeometry& start) {
  const std::span<const Shape> shapes = start.shapes;
  const std::vector<ShapeProblem> problems =
      start.state ? check_shapes_on(frame, shapes, ground_of(start.state->state->layers))
                  : check_shapes(frame, shapes);
  for (const ShapeProblem& problem : problems) {
    if (tables.empty()) {
      root.error("geometry", problem.message);
    } else if (shapes.empty()) {
      tables[0].error(problem.key, problem.message);
    } else {
      note_problem(tables[start.tables[problem.shape]], problem);
    }
  }
  const double cell = frame.spacing * frame.spacing;
  for (std::size_t n = 0; n < shapes.size(); ++n) {
    const double cells = wall_area(frame, shapes[n]) / cell;
    require_memory(tables[start.tables[n]], "", fmt::format("walls of {:.3g} grid cells", cells),
                   cells);
  }
}

StartGeometry read_start_geometry(const RecipeFile& file, const Domain& domain,
                                  const Materials& materials, const LoadStart& load_start) {
  const RecipeTable root = file.root();
  const Frame& frame = domain.frame;
  std::optional<StartState> state;
  if (root.has("start")) {
    state = read_start(root, frame, materials, load_start);
    if (!root.has("geometry")) return {.shapes = {}, .tables = {}, .state = std::move(state)};
  }
  const std::vector<RecipeTable> tables = root.tables("geometry");
  StartGeometry start = read_geometry(tables, {materials, frame, domain.cut});
  start.state = std::move(state);
  if (file.ok()) check_geometry(root, tables, frame, start);
  return start;
}

Outputs read_outputs(const RecipeTable& root, std::span<const ProcessStep> steps,
                     const Frame& frame) {
  const RecipeTable table = root.table("output");
  return {.every = read_output_interval(table, steps),
          .checkpoint_every = table.time("checkpoint_every", {.fallback = "0 s", .minimum = 0}),
          .checkpoint_wall_time =
              table.time("checkpoint_wall_time", {.fallback = "10 min", .minimum = 0}),
          .sections = read_sections(table, frame, root.ok("domain"))};
}

}  // namespace

std::string mode_name(const Frame& frame) {
  if (frame.axisymmetric) return "axisymmetric";
  return frame.two_dimensional ? "2d" : "3d";
}

Recipe read_recipe(const RecipeSource& source, const LoadStart& load_start) {
  const RecipeFile file(source);
  const RecipeTable root = file.root();
  Recipe recipe;
  recipe.title = read_name(root, "title", shown(std::filesystem::path(source.name).stem()));
  recipe.domain = read_domain(root.table("domain"));
  const Frame& frame = recipe.domain.frame;
  read_materials(root.table("materials"), recipe.materials);
  recipe.start = read_start_geometry(file, recipe.domain, recipe.materials, load_start);
  recipe.simplification = read_simplify(root.table("simplify"), frame);
  recipe.flux = read_flux_plan(root.table("flux"), frame);
  recipe.advection = read_advection(root.table("advection"));
  read_steps(root, recipe);
  recipe.outputs = read_outputs(root, recipe.steps, frame);
  recipe.metrology = read_metrology(root.table("metrology"), recipe.start.shapes, recipe.steps,
                                    recipe.materials, recipe.occurring);
  file.finish();
  judge_coarseness(root, recipe);
  file.finish();
  recipe.warnings = file.warnings();
  recipe.resolved = file.resolved();
  return recipe;
}

double time_steps(const ProcessStep& step, double duration, double longest_move,
                  std::size_t material_count) {
  if (!step.model) return 1;
  return open_wafer_time_steps(*step.model, step.factors, material_count, duration, longest_move);
}

std::string Recipe::hash() const {
  Hash total;
  total.add(resolved);
  if (start.state) total.add(start.state->hash);
  return total.hex();
}

}  // namespace scarp
