// Simplification against its peers at equal numbers of vertices: distance to the original, shape of
// the facets, time on all threads. What is written is read side by side in one process.
//
//   ./dev bench simplify [MESH...] [--json] [--repeats N] [-o DIR]
//
// Without files, surfaces of about 70k and 175k vertices are generated: an array of tapered vias,
// and deep trenches. Sides are those of the bounding box.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/parallel.h"
#include "mesh/distance.h"
#include "mesh/quality.h"
#include "mesh/simplify.h"
#include "tests/bench/cgal_peer.h"
#include "tests/bench/surfaces.h"
#include "tests/bench/svg_plot.h"

namespace scarp::bench {
namespace {

namespace fs = std::filesystem;

constexpr double reductions[]{0.2, 0.4, 0.52, 0.6, 0.7, 0.78, 0.9};

/// Where the ratios are taken: the published reductions. Without a suffix, the one that was
/// published for a surface of about this size.
constexpr double ratio_reductions[]{0.52, 0.78};
constexpr std::size_t large_surface = 120000;

/// For good angles at the distances of Lindstrom and Turk.
constexpr double shaped_weight = 3e-4;

struct Settings {
  std::vector<std::string> files;
  std::string folder = "results/bench_simplify";
  int repeats = 3;
  bool json = false;
};

/// Removes a fraction of the vertices; `prepare` is not timed.
struct Method {
  std::string name;
  std::function<std::function<TriMesh()>(const TriMesh&, double removed)> prepare;
};

/// One line of the table. Distances in the unit of the mesh, from the original's vertices.
struct Row {
  std::string method;
  double removed = 0;
  std::size_t vertices = 0;
  double seconds = 1e9;
  SurfaceDistance distance{};
  AngleStatistics angles{};
  Defects defects{};
};

std::size_t vertices_left(const TriMesh& mesh, double removed) {
  return static_cast<std::size_t>(
      std::ceil((1 - removed) * static_cast<double>(mesh.vertices.size())));
}

Method own(const std::string& name, SimplifyMethod method,
           std::optional<double> shape_weight = {}) {
  return {name, [=](const TriMesh& mesh, double removed) {
            SimplifyOptions options{.method = method,
                                    .sides = sides_of(mesh),
                                    .vertices = vertices_left(mesh, removed),
                                    .shape_weight = shape_weight,
                                    .measure = false};
            return [&mesh, options] { return simplify(mesh, options).mesh; };
          }};
}

std::vector<Method> all_methods() {
  std::vector<Method> methods{own("curvature", SimplifyMethod::curvature),
                              own("curvature-shaped", SimplifyMethod::curvature, shaped_weight),
                              own("lindstrom-turk", SimplifyMethod::lindstrom_turk),
                              own("paper", SimplifyMethod::paper),
                              own("length", SimplifyMethod::length)};
#ifdef SCARP_HAS_CGAL
  methods.push_back({"cgal", [](const TriMesh& mesh, double removed) {
                       auto peer = std::make_shared<CgalPeer>(mesh);
                       const std::size_t vertices = vertices_left(mesh, removed);
                       return [peer, vertices] {
                         peer->lindstrom_turk(vertices);
                         return peer->result();
                       };
                     }});
#endif
  return methods;
}

/// All methods at one reduction, their repeats in turn; the least time counts.
std::vector<Row> compare(const Surface& surface, double removed, int repeats) {
  const std::vector<Method> methods = all_methods();
  std::vector<Row> rows;
  std::vector<TriMesh> results(methods.size());
  for (const Method& method : methods) rows.push_back({.method = method.name, .removed = removed});
  for (int repeat = 0; repeat < repeats; ++repeat) {
    for (std::size_t i = 0; i < methods.size(); ++i) {
      const std::function<TriMesh()> work = methods[i].prepare(surface.mesh, removed);
      rows[i].seconds = std::min(rows[i].seconds, seconds_of([&] { results[i] = work(); }));
    }
  }
  for (std::size_t i = 0; i < methods.size(); ++i) {
    rows[i].vertices = results[i].vertices.size();
    rows[i].distance = surface_distance(surface.mesh, results[i]);
    rows[i].angles = angle_statistics(results[i]);
    rows[i].defects = find_defects(results[i], surface.mesh, sides_of(surface.mesh));
  }
  return rows;
}

nlohmann::ordered_json ratios_of(const std::vector<Row>& rows, const std::string& suffix) {
  std::map<std::string, const Row*> by_name;
  for (const Row& row : rows) by_name[row.method] = &row;
  nlohmann::ordered_json ratios;
  const auto add = [&](const char* name, const char* a, const char* b,
                       double (*value)(const Row&)) {
    if (by_name.count(a) == 0 || by_name.count(b) == 0) return;
    ratios[name + suffix] = value(*by_name[a]) / value(*by_name[b]);
  };
  const auto seconds = [](const Row& row) { return row.seconds; };
  const auto mean = [](const Row& row) { return row.distance.forward.mean; };
  const auto max = [](const Row& row) { return row.distance.forward.max; };
  add("lindstrom_turk_speedup_vs_cgal", "cgal", "lindstrom-turk", seconds);
  add("lindstrom_turk_mean_vs_cgal", "lindstrom-turk", "cgal", mean);
  add("curvature_speedup_vs_cgal", "cgal", "curvature", seconds);
  add("curvature_mean_vs_cgal", "curvature", "cgal", mean);
  add("curvature_max_vs_cgal", "curvature", "cgal", max);
  add("curvature_shaped_mean_vs_cgal", "curvature-shaped", "cgal", mean);
  if (by_name.count("cgal") != 0) {
    const double cgal = by_name["cgal"]->angles.mean_minimum;
    ratios["curvature_angle_gain" + suffix] = by_name["curvature"]->angles.mean_minimum - cgal;
    ratios["curvature_shaped_angle_gain" + suffix] =
        by_name["curvature-shaped"]->angles.mean_minimum - cgal;
  }
  add("curvature_mean_vs_lindstrom_turk", "curvature", "lindstrom-turk", mean);
  add("curvature_max_vs_lindstrom_turk", "curvature", "lindstrom-turk", max);
  add("paper_mean_vs_length", "paper", "length", mean);
  add("paper_max_vs_length", "paper", "length", max);
  add("paper_time_vs_lindstrom_turk", "paper", "lindstrom-turk", seconds);
  return ratios;
}

nlohmann::ordered_json json_of(const Row& row) {
  return {{"method", row.method},
          {"removed", row.removed},
          {"vertices", row.vertices},
          {"seconds", row.seconds},
          {"mean", row.distance.forward.mean},
          {"max", row.distance.forward.max},
          {"rms", row.distance.forward.rms},
          {"p99", row.distance.forward.p99},
          {"reverse_mean", row.distance.reverse.mean},
          {"reverse_max", row.distance.reverse.max},
          {"mean_minimum_angle", row.angles.mean_minimum},
          {"angles_below_20", row.angles.below_20},
          {"angles_below_5", row.angles.below_5},
          {"flipped", row.defects.flipped},
          {"non_manifold_edges", row.defects.non_manifold_edges},
          {"off_plane", row.defects.off_plane},
          {"lost_corners", row.defects.lost_corners}};
}

std::string table_of(const Surface& surface, const std::vector<Row>& rows) {
  std::string out = fmt::format(
      "{}: {} vertices; {} threads\n"
      "{:>7} {:<16} {:>8} {:>9} {:>9} {:>9} {:>9} {:>6} {:>6} {:>6} {:>5} {:>5} {:>8}\n",
      surface.name, surface.mesh.vertices.size(), thread_count(), "removed", "method", "vertices",
      "mean", "max", "p99", "back", "angle", "<20", "flips", "off", "lost", "time");
  for (const Row& row : rows) {
    out += fmt::format(
        "{:>6.0f}% {:<16} {:>8} {:>9.5f} {:>9.4f} {:>9.4f} {:>9.4f} {:>6.2f} {:>5.1f}% {:>6} {:>5} "
        "{:>5} {:>7.3f}s\n",
        100 * row.removed, row.method, row.vertices, row.distance.forward.mean,
        row.distance.forward.max, row.distance.forward.p99, row.distance.reverse.max,
        row.angles.mean_minimum, 100 * row.angles.below_20, row.defects.flipped,
        row.defects.off_plane, row.defects.lost_corners, row.seconds);
  }
  return out;
}

std::string plots_of(const std::string& name, const std::vector<Row>& rows) {
  const auto plot = [&](const std::string& title, double (*value)(const Row&)) {
    Plot result{name + ": " + title, "vertices removed [%]", {}};
    for (const Method& method : all_methods()) {
      Series series{method.name, {}};
      for (const Row& row : rows) {
        if (row.method == method.name) series.points.emplace_back(100 * row.removed, value(row));
      }
      result.series.push_back(series);
    }
    return result;
  };
  return svg_of(
      {plot("mean distance", [](const Row& row) { return row.distance.forward.mean; }),
       plot("greatest distance", [](const Row& row) { return row.distance.forward.max; }),
       plot("mean smallest angle", [](const Row& row) { return row.angles.mean_minimum; }),
       plot("time [s]", [](const Row& row) { return row.seconds; })});
}

void run(const Settings& settings) {
  fs::create_directories(settings.folder);
  nlohmann::ordered_json result{{"ratios", nlohmann::ordered_json::object()},
                                {"surfaces", nlohmann::ordered_json::object()}};
  for (const Surface& surface : surfaces_of(settings.files)) {
    std::vector<Row> rows;
    nlohmann::ordered_json ratios = nlohmann::ordered_json::object();
    const double published = ratio_reductions[surface.mesh.vertices.size() > large_surface ? 0 : 1];
    for (const double removed : reductions) {
      const std::vector<Row> compared = compare(surface, removed, settings.repeats);
      rows.insert(rows.end(), compared.begin(), compared.end());
      if (removed == published) ratios.update(ratios_of(compared, ""));
      if (std::count(std::begin(ratio_reductions), std::end(ratio_reductions), removed) > 0) {
        ratios.update(ratios_of(compared, fmt::format("_{:.0f}", 100 * removed)));
      }
    }
    result["ratios"][surface.name] = ratios;
    for (const Row& row : rows) result["surfaces"][surface.name].push_back(json_of(row));
    const fs::path base = fs::path(settings.folder) / surface.name;
    write_file(base.string() + ".svg", plots_of(surface.name, rows));
    if (settings.json) continue;
    fmt::print("{}\n", table_of(surface, rows));
    for (const auto& [key, value] : ratios.items()) {
      fmt::print("  {:40} {:.3f}\n", key, value.get<double>());
    }
    fmt::print("  plots: {}.svg\n\n", base.string());
    std::cout.flush();
  }
  write_file(fs::path(settings.folder) / "simplify.json", result.dump(2) + "\n");
  if (settings.json) std::cout << result.dump(2) << '\n';
}

}  // namespace
}  // namespace scarp::bench

int main(int argc, char** argv) {
  scarp::bench::Settings settings;
  CLI::App app{"simplification against its peers: distance, shape, time"};
  app.add_option("mesh", settings.files, "Surfaces: .obj .ply .stl .vtp .obj.gz");
  app.add_option("--repeats", settings.repeats, "How often each is timed (3)")
      ->check(CLI::PositiveNumber);
  app.add_option("-o,--output", settings.folder, "Folder for the plots and simplify.json");
  app.add_flag("--json", settings.json, "One object on standard output");
  CLI11_PARSE(app, argc, argv);
  try {
    scarp::bench::run(settings);
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_simplify: {}\n", error.what());
    return 2;
  }
  return 0;
}
