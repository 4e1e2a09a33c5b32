// The study that scarp started from: how far from the original the simplified surface is, what it
// costs to simplify, and what it saves in tracing. `paper` against the two references.
//
//   ./dev bench paper [MESH...] [--rays N] [--error E] [--json] [-o DIR]
//
// Without files, surfaces of about 70k and 175k vertices are generated: an array of tapered vias,
// and deep trenches. Sides are those of the bounding box; sticking is .1.

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/atomic_file.h"
#include "core/parallel.h"
#include "flux/solve.h"
#include "mesh/distance.h"
#include "mesh/quality.h"
#include "mesh/simplify.h"
#include "tests/bench/bench_main.h"
#include "tests/bench/surfaces.h"
#include "tests/bench/svg_plot.h"

namespace scarp::bench {
namespace {

namespace fs = std::filesystem;

constexpr double sticking = 0.1;
constexpr int repeats = 3;
constexpr double reductions[]{0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9};

/// Where the ratios are taken: the reductions of the published comparison.
constexpr double ratio_reductions[]{0.52, 0.78};

struct Method {
  const char* name;
  SimplifyMethod method;
};
constexpr Method methods[]{{"paper", SimplifyMethod::paper},
                           {"length", SimplifyMethod::length},
                           {"lindstrom-turk", SimplifyMethod::lindstrom_turk}};

struct Settings {
  std::vector<std::string> files;
  double rays = 1 << 20;
  double error = 0.03;
  std::string folder = "results/bench_paper";
  bool json = false;
};

/// One line of the table. Times in seconds, distances in the unit of the mesh.
struct Row {
  std::string method;
  double removed = 0;  ///< fraction of the vertices; 0 for the original
  std::size_t vertices = 0;
  std::size_t facets = 0;
  double simplify_seconds = 0;
  DistanceStatistics distance{};  ///< from the original's vertices
  double reverse_max = 0;
  Defects defects{};
  double mean_minimum_angle = 0;
  double trace_seconds = 0;  ///< for the given number of rays
  double error_seconds = 0;  ///< for the given error
};

// --- measurements --------------------------------------------------------------------------------

void trace(const TriMesh& mesh, const Sides& sides, const Settings& settings, Row& row) {
  const std::vector<Species> species{
      {.name = "neutral", .sticking = {static_cast<float>(sticking)}}};
  TriMesh bare{mesh.vertices, mesh.triangles, {}};
  if (settings.rays > 0) {
    FluxOptions by_rays;
    by_rays.engine = FluxOptions::Engine::forward;
    by_rays.sides = sides;
    by_rays.spacing = 1;
    by_rays.rays = static_cast<std::uint64_t>(settings.rays);
    row.trace_seconds = seconds_of([&] { solve_flux(bare, species, by_rays); });
  }
  if (settings.error > 0) {
    FluxOptions by_error;
    by_error.sides = sides;
    by_error.spacing = 1;
    by_error.target_error = settings.error;
    row.error_seconds = seconds_of([&] { solve_flux(bare, species, by_error); });
  }
}

/// What a method makes of a surface.
struct Simplified {
  TriMesh mesh;
  Row row;
};

Simplified measured(const Surface& surface, const Method& method, double removed) {
  SimplifyOptions options;
  options.method = method.method;
  options.sides = sides_of(surface.mesh);
  options.remove = removed;
  options.measure = false;
  SimplifyResult result;
  Row row{.method = method.name, .removed = removed, .simplify_seconds = 1e9};
  for (int i = 0; i < repeats; ++i) {
    row.simplify_seconds = std::min(row.simplify_seconds,
                                    seconds_of([&] { result = simplify(surface.mesh, options); }));
  }
  const SurfaceDistance distance = surface_distance(surface.mesh, result.mesh);
  row.vertices = result.mesh.vertices.size();
  row.facets = result.mesh.triangles.size();
  row.distance = distance.forward;
  row.reverse_max = distance.reverse.max;
  row.defects = find_defects(result.mesh, surface.mesh, options.sides);
  row.mean_minimum_angle = angle_statistics(result.mesh).mean_minimum;
  return {std::move(result.mesh), row};
}

/// With 1e8 rays a run takes an hour: what is done is told.
void tell(const Surface& surface, const Row& row) {
  fmt::print(stderr, "{}: {} at {:.0f} % removed, traced in {:.3g} s\n", surface.name, row.method,
             100 * row.removed, row.trace_seconds);
}

std::vector<Row> study(const Surface& surface, const Settings& settings) {
  const Sides sides = sides_of(surface.mesh);
  std::vector<Row> rows{{.method = "original",
                         .vertices = surface.mesh.vertices.size(),
                         .facets = surface.mesh.triangles.size(),
                         .mean_minimum_angle = angle_statistics(surface.mesh).mean_minimum}};
  trace(surface.mesh, sides, settings, rows.front());
  tell(surface, rows.front());
  for (const double removed : reductions) {
    for (const Method& method : methods) {
      Simplified simplified = measured(surface, method, removed);
      trace(simplified.mesh, sides, settings, simplified.row);
      rows.push_back(simplified.row);
      tell(surface, rows.back());
    }
  }
  return rows;
}

// --- results -------------------------------------------------------------------------------------

nlohmann::ordered_json ratios_of(const Surface& surface, const std::vector<Row>& rows) {
  nlohmann::ordered_json ratios;
  for (const double removed : ratio_reductions) {
    const Row paper = measured(surface, methods[0], removed).row;
    const Row length = measured(surface, methods[1], removed).row;
    const Row reference = measured(surface, methods[2], removed).row;
    const std::string at = fmt::format("_{:.0f}", 100 * removed);
    ratios["paper_mean_vs_length" + at] = paper.distance.mean / length.distance.mean;
    ratios["paper_max_vs_length" + at] = paper.distance.max / length.distance.max;
    ratios["paper_mean_vs_lindstrom_turk" + at] = paper.distance.mean / reference.distance.mean;
    ratios["paper_max_vs_lindstrom_turk" + at] = paper.distance.max / reference.distance.max;
    ratios["paper_time_vs_lindstrom_turk" + at] =
        paper.simplify_seconds / reference.simplify_seconds;
  }
  const Row& original = rows.front();
  for (const Row& row : rows) {
    if (row.method != "paper") continue;
    const std::string at = fmt::format("_{:.0f}", 100 * row.removed);
    if (row.trace_seconds > 0) {
      ratios["trace_speedup" + at] = original.trace_seconds / row.trace_seconds;
    }
    if (row.error_seconds > 0) {
      ratios["speedup_at_equal_error" + at] =
          original.error_seconds / (row.error_seconds + row.simplify_seconds);
    }
  }
  return ratios;
}

nlohmann::ordered_json json_of(const Row& row) {
  return {{"method", row.method},
          {"removed", row.removed},
          {"vertices", row.vertices},
          {"facets", row.facets},
          {"simplify_seconds", row.simplify_seconds},
          {"max", row.distance.max},
          {"mean", row.distance.mean},
          {"rms", row.distance.rms},
          {"p99", row.distance.p99},
          {"reverse_max", row.reverse_max},
          {"mean_minimum_angle", row.mean_minimum_angle},
          {"flipped", row.defects.flipped},
          {"non_manifold_edges", row.defects.non_manifold_edges},
          {"off_plane", row.defects.off_plane},
          {"lost_corners", row.defects.lost_corners},
          {"trace_seconds", row.trace_seconds},
          {"error_seconds", row.error_seconds}};
}

std::string table_of(const Surface& surface, const std::vector<Row>& rows,
                     const Settings& settings) {
  std::string out = fmt::format(
      "{}: {} vertices; tracing {:.0f} rays, and to an error of {:.3g}; {} threads\n"
      "{:>7} {:<15} {:>8} {:>8} {:>9} {:>9} {:>9} {:>9} {:>6} {:>6} {:>9} {:>9}\n",
      surface.name, surface.mesh.vertices.size(), settings.rays, settings.error, thread_count(),
      "removed", "method", "vertices", "facets", "mean", "max", "back", "simplify", "angle",
      "flips", "trace", "to error");
  for (const Row& row : rows) {
    out += fmt::format(
        "{:>6.0f}% {:<15} {:>8} {:>8} {:>9.5f} {:>9.4f} {:>9.4f} {:>8.3f}s {:>6.1f} {:>6} "
        "{:>8.3f}s {:>8.3f}s\n",
        100 * row.removed, row.method, row.vertices, row.facets, row.distance.mean,
        row.distance.max, row.reverse_max, row.simplify_seconds, row.mean_minimum_angle,
        row.defects.flipped, row.trace_seconds, row.error_seconds);
  }
  return out;
}

std::string csv_of(const std::vector<Row>& rows) {
  std::string out;
  for (const Row& row : rows) {
    std::string names;
    std::string values;
    const nlohmann::ordered_json object = json_of(row);
    for (const auto& [key, value] : object.items()) {
      names += (names.empty() ? "" : ",") + key;
      values += (values.empty() ? "" : ",") +
                (value.is_string() ? value.get<std::string>() : value.dump());
    }
    out += (out.empty() ? names + "\n" : "") + values + "\n";
  }
  return out;
}

std::string plots_of(const std::string& name, const std::vector<Row>& rows) {
  const auto plot = [&](const std::string& title, double (*value)(const Row&)) {
    Plot result{name + ": " + title, "vertices removed [%]", {}};
    for (const Method& method : methods) {
      Series series{method.name, {}};
      for (const Row& row : rows) {
        if (row.method == method.name) series.points.emplace_back(100 * row.removed, value(row));
      }
      result.series.push_back(series);
    }
    return result;
  };
  std::vector<Plot> plots{
      plot("mean distance", [](const Row& row) { return row.distance.mean; }),
      plot("greatest distance", [](const Row& row) { return row.distance.max; }),
      plot("simplification [s]", [](const Row& row) { return row.simplify_seconds; })};
  if (rows.front().trace_seconds > 0) {
    plots.push_back(plot("tracing [s]", [](const Row& row) { return row.trace_seconds; }));
  }
  if (rows.front().error_seconds > 0) {
    plots.push_back(
        plot("flux to the error [s]", [](const Row& row) { return row.error_seconds; }));
  }
  return svg_of(plots);
}

void run(const Settings& settings) {
  fs::create_directories(settings.folder);
  nlohmann::ordered_json result{{"ratios", nlohmann::ordered_json::object()},
                                {"surfaces", nlohmann::ordered_json::object()}};
  for (const Surface& surface : surfaces_of(settings.files)) {
    const std::vector<Row> rows = study(surface, settings);
    result["ratios"][surface.name] = ratios_of(surface, rows);
    for (const Row& row : rows) result["surfaces"][surface.name].push_back(json_of(row));
    const fs::path base = fs::path(settings.folder) / surface.name;
    write_file(base.string() + ".csv", csv_of(rows));
    write_file(base.string() + ".svg", plots_of(surface.name, rows));
    if (settings.json) continue;
    fmt::print("{}\n", table_of(surface, rows, settings));
    const nlohmann::ordered_json& ratios = result["ratios"][surface.name];
    for (const auto& [key, value] : ratios.items()) {
      fmt::print("  {:34} {:.3f}\n", key, value.get<double>());
    }
    fmt::print("  table and plots: {0}.csv, {0}.svg\n\n", base.string());
    std::cout.flush();
  }
  write_file(fs::path(settings.folder) / "paper.json", result.dump(2) + "\n");
  if (settings.json) std::cout << result.dump(2) << '\n';
}

}  // namespace
}  // namespace scarp::bench

int main(int argc, char** argv) {
  scarp::bench::Settings settings;
  const auto declare = [&](CLI::App& app) {
    app.add_option("mesh", settings.files, "Surfaces: .obj .ply .stl .vtp .obj.gz");
    app.add_option("--rays", settings.rays, "Rays for the tracing time (1048576); 0: not measured");
    app.add_option("--error", settings.error,
                   "Error for the time to an error (.03); 0: not measured");
    app.add_option("-o,--output", settings.folder, "Folder for tables and plots");
    app.add_flag("--json", settings.json, "One object on standard output");
  };
  return scarp::bench::bench_main(
      argc, argv, "paper against length and lindstrom-turk: distance, simplification, tracing",
      declare, [&] { scarp::bench::run(settings); });
}
