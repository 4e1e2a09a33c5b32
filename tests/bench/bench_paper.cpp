// The study that scarp started from (Lenz et al., Fig. 3 to 5): how far from the original the
// simplified surface is, what it costs to simplify, and what it saves in tracing.
//
//   ./dev bench paper [MESH...] [--rays N] [--repeats N] [--json] [-o DIR]
//
// Without files, surfaces that runs of scarp leave (tests/bench/surfaces). Sides are those of the
// bounding box. `length` is the homogeneous reference. Distances are in the unit of the mesh.
// All on one thread, in CPU time, the least of the repeats; every repeat traces all meshes in turn.
//
// Tracing takes a fixed number of particles from a cosine source and follows them until they stick
// (probability .1) or leave; facets re-emit by the cosine law. What is timed is the scene and its
// flights: emission and reflection happen between the clocks. Particles are traced on each mesh
// rather than replayed from a list, because flights recorded on one surface begin beside another.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "core/parallel.h"
#include "core/system/atomic_file.h"
#include "mesh/distance.h"
#include "mesh/sides.h"
#include "mesh/simplify/simplify.h"
#include "tests/bench/bench_main.h"
#include "tests/bench/cpu_time.h"
#include "tests/bench/surfaces.h"
#include "tests/bench/svg_plot.h"
#include "tests/bench/trace_time.h"
#include "tests/mesh/quality.h"

namespace scarp::bench {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int percents[]{20, 30, 40, 52, 60, 67, 78, 90};

struct Method {
  const char* name;
  SimplifyMethod method;
};
constexpr Method methods[]{{"paper", SimplifyMethod::paper},
                           {"length", SimplifyMethod::length},
                           {"lindstrom-turk", SimplifyMethod::lindstrom_turk},
                           {"curvature", SimplifyMethod::curvature}};

struct Settings {
  std::vector<std::string> files;
  std::uint64_t rays = 1 << 20;
  int repeats = 3;
  std::string folder = "results/bench_paper";
  bool json = false;
};

/// One line of the table. CPU seconds; distances in the unit of the mesh.
struct Row {
  std::string method;
  int percent = 0;  ///< of the vertices that are removed; 0 for the original
  std::size_t vertices = 0;
  std::size_t facets = 0;
  double simplify_seconds = 0;
  DistanceStatistics distance{};  ///< from the original's vertices
  double reverse_max = 0;
  Defects defects{};
  double mean_minimum_angle = 0;
  TraceTime trace{};
};

/// What a method makes of a surface.
struct Simplified {
  TriMesh mesh;
  Row row;
};

// --- measurements --------------------------------------------------------------------------------

Simplified simplified(const TriMesh& original, const Method& method, int percent, int repeats) {
  SimplifyOptions options;
  options.method = method.method;
  options.sides = sides_of(original);
  options.remove = 0.01 * percent;
  options.measure = false;
  SimplifyResult result;
  Row row{.method = method.name, .percent = percent, .simplify_seconds = 1e9};
  for (int i = 0; i < repeats; ++i) {
    row.simplify_seconds = std::min(row.simplify_seconds,
                                    cpu_seconds_of([&] { result = simplify(original, options); }));
  }
  const SurfaceDistance distance = surface_distance(original, result.mesh);
  row.vertices = result.mesh.vertices.size();
  row.facets = result.mesh.triangles.size();
  row.distance = distance.forward;
  row.reverse_max = distance.reverse.max;
  row.defects = find_defects(result.mesh, original, options.sides);
  row.mean_minimum_angle = angle_statistics(result.mesh).mean_minimum;
  return {std::move(result.mesh), row};
}

void trace(const TriMesh& mesh, const Sides& sides, std::uint64_t rays, Row& row) {
  TraceTime time = trace_time(mesh, sides, rays);
  if (row.trace.segments > 0) time.take_lesser(row.trace);
  row.trace = std::move(time);
}

std::vector<Row> study(const Surface& surface, const Settings& settings) {
  const TriMesh& original = surface.mesh;
  const Sides sides = sides_of(original);
  Row as_it_is{.method = "original",
               .vertices = original.vertices.size(),
               .facets = original.triangles.size(),
               .mean_minimum_angle = angle_statistics(original).mean_minimum};
  std::vector<Simplified> meshes;
  for (const int percent : percents) {
    fmt::print(stderr, "{}: {} % removed\n", surface.name, percent);
    for (const Method& method : methods)
      meshes.push_back(simplified(original, method, percent, settings.repeats));
  }
  for (int repeat = 0; repeat < settings.repeats; ++repeat) {
    fmt::print(stderr, "{}: tracing, repeat {}\n", surface.name, repeat + 1);
    trace(original, sides, settings.rays, as_it_is);
    for (Simplified& each : meshes) trace(each.mesh, sides, settings.rays, each.row);
  }
  std::vector<Row> rows{as_it_is};
  for (const Simplified& each : meshes) rows.push_back(each.row);
  return rows;
}

// --- results -------------------------------------------------------------------------------------

const Row& row_of(const std::vector<Row>& rows, const std::string& method, int percent) {
  return *std::ranges::find_if(
      rows, [&](const Row& row) { return row.method == method && row.percent == percent; });
}

double trace_speedup(const std::vector<Row>& rows, const Row& row) {
  return rows.front().trace.total() / row.trace.total();
}

/// By how many per cent the speed-up falls at the most where more vertices are removed.
double largest_fall(const std::vector<Row>& rows, const std::string& method) {
  double before = 1;
  double largest = 0;
  for (const int percent : percents) {
    const double speedup = trace_speedup(rows, row_of(rows, method, percent));
    largest = std::max(largest, 100 * (1 - speedup / before));
    before = speedup;
  }
  return largest;
}

Json ratios_of(const std::vector<Row>& rows) {
  Json ratios;
  for (const int percent : percents) {
    const auto row = [&](const char* method) { return row_of(rows, method, percent); };
    const Row paper = row("paper");
    const Row homogeneous = row("length");
    const Row reference = row("lindstrom-turk");
    const Row own = row("curvature");
    const std::string at = fmt::format("_{}", percent);
    ratios["paper_mean_vs_length" + at] = paper.distance.mean / homogeneous.distance.mean;
    ratios["paper_max_vs_length" + at] = paper.distance.max / homogeneous.distance.max;
    ratios["paper_mean_vs_lindstrom_turk" + at] = paper.distance.mean / reference.distance.mean;
    ratios["paper_max_vs_lindstrom_turk" + at] = paper.distance.max / reference.distance.max;
    ratios["curvature_mean_vs_paper" + at] = own.distance.mean / paper.distance.mean;
    ratios["curvature_max_vs_paper" + at] = own.distance.max / paper.distance.max;
    ratios["paper_time_vs_lindstrom_turk" + at] =
        paper.simplify_seconds / reference.simplify_seconds;
    ratios["paper_time_vs_length" + at] = paper.simplify_seconds / homogeneous.simplify_seconds;
    ratios["trace_speedup" + at] = trace_speedup(rows, own);
    ratios["paper_trace_speedup" + at] = trace_speedup(rows, paper);
  }
  ratios["trace_largest_fall_percent"] = largest_fall(rows, "curvature");
  return ratios;
}

Json json_of(const Row& row) {
  return {{"method", row.method},
          {"removed", 0.01 * row.percent},
          {"vertices", row.vertices},
          {"facets", row.facets},
          {"simplify_cpu_seconds", row.simplify_seconds},
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
          {"trace_cpu_seconds", row.trace.total()},
          {"trace_segments", row.trace.segments}};
}

std::string table_of(const Surface& surface, const std::vector<Row>& rows,
                     const Settings& settings) {
  std::string out = fmt::format(
      "{}: {} vertices; tracing {} particles\n"
      "{:>7} {:<15} {:>8} {:>8} {:>9} {:>9} {:>9} {:>9} {:>6} {:>6} {:>9} {:>8}\n",
      surface.name, surface.mesh.vertices.size(), settings.rays, "removed", "method", "vertices",
      "facets", "mean", "max", "back", "simplify", "angle", "flips", "trace", "speed-up");
  for (const Row& row : rows) {
    out += fmt::format(
        "{:>6}% {:<15} {:>8} {:>8} {:>9.5f} {:>9.4f} {:>9.4f} {:>8.3f}s {:>6.1f} {:>6} {:>8.3f}s "
        "{:>8.3f}\n",
        row.percent, row.method, row.vertices, row.facets, row.distance.mean, row.distance.max,
        row.reverse_max, row.simplify_seconds, row.mean_minimum_angle, row.defects.flipped,
        row.trace.total(), trace_speedup(rows, row));
  }
  return out + fmt::format("largest fall of the speed-up of curvature from row to row: {:.1f} %\n",
                           largest_fall(rows, "curvature"));
}

/// Ratios as docs/paper.md has them.
std::string markdown_of(const std::vector<Row>& rows) {
  std::string out =
      "| removed | mean distance, `paper` / `length` | greatest | mean, `curvature` / `length` | "
      "time, `paper` / `length` | `paper` / `lindstrom-turk` | tracing, full / `paper` | full / "
      "`curvature` |\n| --- | --- | --- | --- | --- | --- | --- | --- |\n";
  for (const int percent : percents) {
    const Row& paper = row_of(rows, "paper", percent);
    const Row& homogeneous = row_of(rows, "length", percent);
    const Row& own = row_of(rows, "curvature", percent);
    const Row& reference = row_of(rows, "lindstrom-turk", percent);
    const double ratios[]{paper.distance.mean / homogeneous.distance.mean,
                          paper.distance.max / homogeneous.distance.max,
                          own.distance.mean / homogeneous.distance.mean,
                          paper.simplify_seconds / homogeneous.simplify_seconds,
                          paper.simplify_seconds / reference.simplify_seconds,
                          trace_speedup(rows, paper),
                          trace_speedup(rows, own)};
    out += fmt::format("| {} % |", percent);
    for (const double ratio : ratios) out += fmt::format(" {:.2f} |", ratio);
    out += "\n";
  }
  return out;
}

std::string csv_of(const std::vector<Row>& rows) {
  std::string out;
  for (const Row& row : rows) {
    std::string names;
    std::string values;
    const Json object = json_of(row);
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
      for (const Row& row : rows)
        if (row.method == method.name) series.points.emplace_back(row.percent, value(row));
      result.series.push_back(series);
    }
    return result;
  };
  return svg_of(
      {plot("mean distance [unit of the mesh]", [](const Row& row) { return row.distance.mean; }),
       plot("greatest distance [unit of the mesh]",
            [](const Row& row) { return row.distance.max; }),
       plot("simplification [CPU s]", [](const Row& row) { return row.simplify_seconds; }),
       plot("tracing [CPU s]", [](const Row& row) { return row.trace.total(); })});
}

void run(const Settings& settings) {
  const ThreadLimit one_thread(1);
  fs::create_directories(settings.folder);
  Json result{{"ratios", Json::object()}, {"surfaces", Json::object()}};
  for (const Surface& surface : surfaces_of(settings.files)) {
    const std::vector<Row> rows = study(surface, settings);
    result["ratios"][surface.name] = ratios_of(rows);
    for (const Row& row : rows) result["surfaces"][surface.name].push_back(json_of(row));
    const fs::path base = fs::path(settings.folder) / surface.name;
    write_file(base.string() + ".csv", csv_of(rows));
    write_file(base.string() + ".svg", plots_of(surface.name, rows));
    if (settings.json) continue;
    fmt::print("{0}\n{1}\ntable and plots: {2}.csv, {2}.svg\n\n", table_of(surface, rows, settings),
               markdown_of(rows), base.string());
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
    app.add_option("--rays", settings.rays, "Particles that are traced (1048576)")
        ->check(CLI::PositiveNumber);
    app.add_option("--repeats", settings.repeats, "How often each is timed (3)")
        ->check(CLI::PositiveNumber);
    app.add_option("-o,--output", settings.folder, "Folder for tables and plots");
    app.add_flag("--json", settings.json, "One object on standard output");
  };
  return scarp::bench::bench_main(argc, argv,
                                  "the published study: distance, simplification, tracing", declare,
                                  [&] { scarp::bench::run(settings); });
}
