#include "apps/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <numeric>

#include "apps/report/comparison_case.h"
#include "apps/report/render.h"
#include "apps/report/scene.h"
#include "apps/run/markup.h"
#include "apps/run/run_record.h"
#include "apps/run/svg.h"
#include "apps/simulator/flux_target.h"
#include "apps/simulator/recipe.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/csv_table.h"
#include "core/system/read_file.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// What a run left in its folder.
struct RunFiles {
  fs::path folder;
  RunRecord record;
  CsvTable metrics;
  CsvTable metrology;
  ordered_json summary;  ///< empty of a run that is not complete
  std::string recipe;
  SavedWafer wafer;  ///< the newest

  bool is_complete() const { return !summary.empty(); }
  std::string title() const {
    return is_complete() ? summary.value("title", "") : shown(folder.filename());
  }
};

RunFiles read_files(const fs::path& folder) {
  RunRecord record = read_run(folder);
  SavedWafer wafer = read_wafer(record.outputs.back().state);
  return {.folder = folder,
          .record = std::move(record),
          .metrics = CsvTable(folder / "metrics.csv"),
          .metrology = CsvTable(folder / "metrology.csv"),
          .summary = read_summary(folder),
          .recipe = read_file(folder / "recipe.toml"),
          .wafer = std::move(wafer)};
}

std::string number_text(double value) { return fmt::format("{:.5g}", value); }

// --- head ----------------------------------------------------------------------------------------

/// What the numbers of the page are worth; runs of earlier versions do not say.
std::string flux_error_of(const RunFiles& run) {
  const ordered_json flux = run.summary.value("flux", ordered_json::object());
  const double largest = flux.value("largest_error", 0.0);
  if (largest == 0) return "";
  const WantedError wanted{.in_position = flux.value("in_position", false)};
  const auto target = flux.value("target", ordered_json());
  std::string text = fmt::format("Error of the {} (noise and size of elements): at most {}",
                                 wanted.in_position ? "position" : "flux", wanted.text(largest));
  if (target.is_number()) text += ", the target " + wanted.text(target.get<double>());
  const double missed = flux.value("time_steps_missed", 0.0);
  if (missed == 0) return "<p>" + text + ".</p>\n";
  return fmt::format(
      "<p class=\"unsure\">{}, missed in {:.0f} of {:.0f} time steps: some of what this page shows "
      "may be noise.</p>\n",
      text, missed, run.summary.value("time_steps", 0.0));
}

std::string head_of(const RunFiles& run) {
  std::string html = "<h1>" + escaped(run.title()) + "</h1>\n";
  if (!run.is_complete()) {
    return html +
           "<p class=\"unsure\">This run is not complete. The page shows what it has written so "
           "far; scarp run --resume continues it.</p>\n";
  }
  const auto number = [&](const char* key) { return run.summary.value(key, 0.0); };
  html += fmt::format(
      "<p>{:.6g} s of process in {:.0f} time steps, {:.0f} outputs; {:.3g} s on {} {}, {:.0f} MB."
      "</p>\n",
      number("process_time_s"), number("time_steps"), number("outputs"), number("wall_s"),
      number("threads"), number("threads") == 1 ? "thread" : "threads", number("peak_memory_mb"));
  return html + flux_error_of(run);
}

// --- the surface in space ------------------------------------------------------------------------

/// What each output is the end of, or within: every step has an output at its end.
std::vector<std::string> moments_of(const RunFiles& run) {
  std::vector<std::string> moments;
  const ordered_json steps = run.summary.value("steps", ordered_json::array());
  std::size_t step = 0;
  for (const RunOutput& output : run.record.outputs) {
    const auto end = [&] { return steps[step].value("end_s", 0.0); };
    if (moments.empty()) {
      moments.emplace_back("start");
      continue;
    }
    while (step < steps.size() && end() < output.time) ++step;
    if (step == steps.size()) {
      moments.emplace_back();
    } else {
      const bool is_end = end() == output.time;
      moments.push_back((is_end ? "after " : "in ") + steps[step].value("name", ""));
      if (is_end) ++step;
    }
  }
  return moments;
}

Scene scene_of(const RunFiles& run) {
  const Sides sides = run.wafer.layers.frame.sides();
  Scene scene{.material_names = material_names_of(run.record, run.wafer), .panes = {{.name = ""}}};
  const std::vector<std::string> moments = moments_of(run);
  ScenePane& pane = scene.panes.front();
  for (std::size_t n = 0; n < run.record.outputs.size(); ++n) {
    const RunOutput& output = run.record.outputs[n];
    const FieldMesh found = read_field_mesh(output, sides);
    pane.outputs.push_back(
        {.time = output.time, .moment = moments[n], .surface = pack(found.mesh, found.fields)});
  }
  pane.output_count = pane.outputs.size();
  std::vector<std::size_t> all(pane.outputs.size());
  std::iota(all.begin(), all.end(), 0);
  add_volumes(scene, std::array{&run.record}, std::span(&all, 1));
  thin_out(scene, most_scene_bytes);
  return scene;
}

std::string surface_section(const RunFiles& run) {
  const std::string heading = "<h2>Surface</h2>\n";
  const Frame& frame = run.wafer.layers.frame;
  if (frame.is_around_axis()) return heading + wafer_picture(run.wafer);
  if (frame.is_section())
    return heading +
           fmt::format("<p>A cross-section (mode = \"{}\") has no depth: it is below.</p>\n",
                       mode_name(frame));
  return heading + scene_html(scene_of(run), "surface", wafer_picture(run.wafer));
}

// --- cross-sections ------------------------------------------------------------------------------

/// profiles.svg and section_K.svg, as far as they are there.
std::string sections_section(const RunFiles& run) {
  std::string html;
  const auto add = [&](const fs::path& file, const std::string& meaning) {
    if (!fs::exists(file)) return false;
    html += embedded_picture("image/svg+xml", read_file(file), meaning);
    return true;
  };
  add(run.folder / "profiles.svg", "Cross-section in the middle of the domain");
  for (int n = 1; add(run.folder / fmt::format("section_{}.svg", n),
                      fmt::format("Cross-section along line {} of output.sections", n));
       ++n) {
  }
  return html.empty() ? "" : "<h2>Cross-sections</h2>\n" + html;
}

// --- metrology -----------------------------------------------------------------------------------

/// Columns of metrology.csv that share a plot, by how their names end.
struct MetrologyPlot {
  const char* title;
  const char* unit;
  std::vector<std::string> endings;
};

const std::vector<MetrologyPlot>& metrology_plots() {
  static const std::vector<MetrologyPlot> plots{
      {"Depths", "nm", {"etched_depth_nm", "depth_nm", "mask_loss_nm"}},
      {"Widths", "nm", {"top_cd_nm", "middle_cd_nm", "bottom_cd_nm", "neck_cd_nm", "bow_nm"}},
      {"Walls", "degrees", {"sidewall_angle_deg"}},
      {"Films", "nm", {"_top_nm", "_wall_nm", "_bottom_nm"}},
      {"Coverage of films", "part of the top", {"_step_coverage", "_wall_coverage"}}};
  return plots;
}

bool is_of(const std::string& column, const MetrologyPlot& plot) {
  return std::ranges::any_of(plot.endings, [&](const std::string& ending) {
    return ending.starts_with('_') ? column.ends_with(ending) : column == ending;
  });
}

/// "top_cd_nm" as text.
std::string words_of(std::string column) {
  for (const std::string_view unit : {"_nm", "_deg"})
    if (column.ends_with(unit)) column.resize(column.size() - unit.size());
  std::ranges::replace(column, '_', ' ');
  return column;
}

/// Rows of one opening in one plane.
struct Opening {
  std::string name;
  std::vector<std::size_t> rows;
};

std::vector<Opening> openings_of(const CsvTable& metrology) {
  std::vector<Opening> openings;
  for (std::size_t row = 0; row < metrology.row_count(); ++row) {
    std::string name = metrology.text(row, "kind") + ' ' + metrology.text(row, "opening");
    // The middle of a hole moves a little from output to output.
    if (metrology.text(row, "kind") == "hole")
      name += fmt::format(", across {}", metrology.text(row, "plane").substr(0, 1));
    const auto known = std::ranges::find(openings, name, &Opening::name);
    if (known == openings.end()) {
      openings.push_back({.name = name, .rows = {row}});
    } else {
      known->rows.push_back(row);
    }
  }
  return openings;
}

/// A column over time; nothing where fewer than two outputs have it, or all have 0.
std::optional<Curve> curve_of(const CsvTable& table, std::span<const std::size_t> rows,
                              const std::string& column) {
  Curve curve{.name = words_of(column), .lines = {{}}};
  for (const std::size_t row : rows) {
    const auto value = table.number(row, column);
    if (value) curve.lines[0].push_back({table.number(row, "time_s").value_or(0), *value});
  }
  const auto is_zero = [](const auto& point) { return point[1] == 0; };
  const bool says_nothing =
      curve.lines[0].size() < 2 || std::ranges::all_of(curve.lines[0], is_zero);
  return says_nothing ? std::nullopt : std::optional(curve);
}

std::string opening_plots(const CsvTable& metrology, const Opening& opening) {
  std::string html;
  for (const MetrologyPlot& each : metrology_plots()) {
    Plot plot{.title = fmt::format("{} of {}", each.title, opening.name),
              .x_label = "t [s]",
              .y_label = fmt::format("[{}]", each.unit),
              .curves = {}};
    for (const std::string& column : metrology.columns()) {
      if (!is_of(column, each)) continue;
      if (auto curve = curve_of(metrology, opening.rows, column)) {
        curve->colour = plot.curves.size();
        plot.curves.push_back(*std::move(curve));
      }
    }
    if (!plot.curves.empty()) html += plot_svg(plot);
  }
  return html;
}

/// What the openings have at the last output, a column each.
std::string last_metrology(const CsvTable& metrology, std::span<const Opening> openings) {
  const std::vector<std::string> places{"output", "time_s", "opening", "kind",
                                        "plane",  "x_nm",   "y_nm",    "sections"};
  std::vector<std::string> head{"at the last output"};
  for (const Opening& opening : openings) head.push_back(opening.name);
  std::vector<std::vector<TableCell>> rows;
  for (const std::string& column : metrology.columns()) {
    if (std::ranges::find(places, column) != places.end()) continue;
    std::vector<TableCell> row{{column}};
    bool is_empty = true;
    for (const Opening& opening : openings) {
      row.push_back({metrology.text(opening.rows.back(), column)});
      is_empty = is_empty && row.back().text.empty();
    }
    if (!is_empty) rows.push_back(std::move(row));
  }
  return html_table(head, rows);
}

std::string metrology_section(const RunFiles& run) {
  const std::vector<Opening> openings = openings_of(run.metrology);
  if (openings.empty()) return "";
  std::string plots;
  for (const Opening& opening : openings) plots += opening_plots(run.metrology, opening);
  return "<h2>Metrology</h2>\n<div class=\"plots\">\n" + plots +
         "</div>\n<details><summary>All values</summary>\n" +
         last_metrology(run.metrology, openings) + "</details>\n";
}

// --- time steps ----------------------------------------------------------------------------------

/// Rows of a long run that are seen in a plot.
std::vector<std::size_t> plotted_rows(const CsvTable& table) {
  constexpr std::size_t most = 2000;
  const std::size_t every = table.row_count() / most + 1;
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < table.row_count(); row += every) rows.push_back(row);
  return rows;
}

struct StepColumn {
  const char* column;
  const char* name;
};

std::string steps_plot(const RunFiles& run, const std::string& title, const std::string& unit,
                       std::span<const StepColumn> columns) {
  const std::vector<std::size_t> rows = plotted_rows(run.metrics);
  Plot plot{.title = title, .x_label = "t [s]", .y_label = unit, .curves = {}};
  for (const auto& [column, name] : columns) {
    auto curve = curve_of(run.metrics, rows, column);
    if (!curve) continue;
    curve->name = name;
    curve->colour = plot.curves.size();
    plot.curves.push_back(*std::move(curve));
  }
  return plot.curves.empty() ? "" : plot_svg(plot);
}

constexpr std::array facet_columns{StepColumn{"facets_full", "extracted"},
                                   StepColumn{"facets", "simplified, where the flux is solved"}};
constexpr std::array error_columns{StepColumn{"flux_error", "flux error"}};
constexpr std::array stage_columns{StepColumn{"t_surface_s", "surface"},
                                   StepColumn{"t_simplify_s", "simplify"},
                                   StepColumn{"t_flux_s", "flux"}, StepColumn{"t_map_s", "map"},
                                   StepColumn{"t_advect_s", "advect"}};

std::string stages_bar(const RunFiles& run) {
  std::vector<BarPart> parts;
  for (const auto& [column, name] : stage_columns) {
    double sum = 0;
    for (std::size_t row = 0; row < run.metrics.row_count(); ++row)
      sum += run.metrics.number(row, column).value_or(0);
    parts.push_back({.name = name, .value = sum});
  }
  return bar_svg("Where the time went", "s", parts);
}

std::string steps_section(const RunFiles& run) {
  if (run.metrics.row_count() == 0) return "";
  return "<h2>Time steps</h2>\n<div class=\"plots\">\n" +
         steps_plot(run, "Facets", "facets", facet_columns) +
         steps_plot(run,
                    "Error of the flux (noise and size of elements), on patches of 4 x 4 spacings",
                    "relative", error_columns) +
         stages_bar(run) + steps_plot(run, "Wall time of each time step", "s", stage_columns) +
         "</div>\n";
}

// --- origin --------------------------------------------------------------------------------------

std::string origin_section(const RunFiles& run) {
  std::vector<std::vector<TableCell>> rows;
  const auto add = [&](const std::string& name, const std::string& value) {
    if (!value.empty()) rows.push_back({{name}, {value}});
  };
  add("grid spacing", number_text(run.wafer.layers.frame.spacing) + " nm");
  add("state_hash", run.summary.value("state_hash", ""));
  add("machine", run.summary.value("machine", ""));
  const ordered_json versions = run.summary.value("versions", ordered_json::object());
  for (const auto& [name, version] : versions.items())
    if (version.is_string()) add(name, version.get<std::string>());
  return "<h2>Recipe and versions</h2>\n" + html_table(std::vector<std::string>{"", ""}, rows) +
         "<details><summary>Recipe with every default</summary>\n<pre>" + escaped(run.recipe) +
         "</pre></details>\n";
}

}  // namespace

std::string run_page(const fs::path& folder) {
  const RunFiles run = read_files(folder);
  try {
    return html_page(run.title(), head_of(run) + surface_section(run) + sections_section(run) +
                                      metrology_section(run) + steps_section(run) +
                                      origin_section(run));
  } catch (const ordered_json::exception&) {
    refuse_summary(folder / "summary.json");
  }
}

std::string comparison_page(const fs::path& folder) {
  const fs::path file = folder / "compare.json";
  std::vector<ComparisonCase> cases;
  std::string title;
  try {
    const auto json = ordered_json::parse(read_file(file));
    title = json.at("title");
    for (const auto& each : json.at("cases")) cases.push_back(read_case(each, folder));
  } catch (const ordered_json::exception&) {
    throw InputError(
        fmt::format("{}: is damaged: it does not say what is compared; remove it, and make it with "
                    "scarp compare",
                    shown(file)));
  }
  if (cases.empty()) throw InputError(shown(file) + ": has no case; make it with scarp compare");
  std::vector<Comparison> comparisons;
  for (const ComparisonCase& each : cases) comparisons.push_back(compare(each));
  return comparison_page(cases, comparisons, title);
}

}  // namespace scarp
