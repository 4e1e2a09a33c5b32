// Simplification against its peers at equal numbers of vertices: distance to the original, shape of
// the facets, defects, time on all threads. What is written is read side by side in one process.
//
//   ./dev bench simplify [MESH...] [--removed FRACTION...] [--repeats N] [--flux | --scaling]
//                        [--json] [-o DIR]
//
// Without files, surfaces that runs of scarp leave (tests/bench/surfaces). Sides are those of the
// bounding box. What `curvature` costs on one thread where only the bound stops it, as in a run, is
// measured on them and on the last full surface of configs/trench_deposition.toml. --flux: instead,
// what 67 % fewer vertices save in the flux (sticking .1, to the same error). --scaling: instead,
// cost and memory per vertex from 20 thousand to 5 million vertices.

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <iostream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "core/parallel.h"
#include "core/system/atomic_file.h"
#include "mesh/simplify/simplify.h"
#include "tests/bench/bench_main.h"
#include "tests/bench/cpu_time.h"
#include "tests/bench/peers.h"
#include "tests/bench/simplify_flux.h"
#include "tests/bench/simplify_row.h"
#include "tests/bench/simplify_scaling.h"
#include "tests/bench/surfaces.h"

namespace scarp::bench {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Where the ratios are taken: the published reductions. Without a suffix, the one that was
/// published for a surface of about this size.
constexpr double ratio_reductions[]{0.52, 0.78};
constexpr std::size_t large_surface = 120000;

/// For good angles at the distances of Lindstrom and Turk.
constexpr double shaped_weight = 3e-5;

/// From small distances to good shapes, for the front between the two.
constexpr double front_weights[]{3e-8,   1e-7,   3e-7, 1e-6, 7e-6, 1e-5,
                                 1.2e-5, 1.5e-5, 2e-5, 5e-5, 1e-4};

/// The default of runs.
constexpr double bound_of_runs = 0.1;

constexpr double flux_reduction = 0.67;
constexpr double flux_error = 0.01;

struct Settings {
  std::vector<std::string> files;
  std::string folder = "results/bench_simplify";
  int repeats = 3;
  std::vector<double> reductions{0.2, 0.4, 0.52, 0.6, 0.7, 0.78, 0.9};
  bool flux = false;
  bool scaling = false;
  bool json = false;
};

Method own(const std::string& name, SimplifyMethod method,
           std::optional<double> shape_weight = {}) {
  return {
      name, [=](const TriMesh& mesh, std::size_t vertices) {
        const SimplifyOptions options{.method = method,
                                      .sides = sides_of(mesh),
                                      .vertices = vertices,
                                      .shape_weight = shape_weight,
                                      .measure = false};
        const auto result = std::make_shared<TriMesh>();
        return Job{[=, &mesh] { *result = simplify(mesh, options).mesh; }, [=] { return *result; }};
      }};
}

/// Scarp's own methods, and those of the peers that are installed; the others are told.
std::vector<Method> all_methods() {
  std::vector<Method> methods{own("curvature", SimplifyMethod::curvature),
                              own("curvature-shaped", SimplifyMethod::curvature, shaped_weight),
                              own("lindstrom-turk", SimplifyMethod::lindstrom_turk),
                              own("paper", SimplifyMethod::paper),
                              own("length", SimplifyMethod::length)};
  for (const Peer& peer : {cgal_peer(), meshoptimizer_peer(), openmesh_peer(), vtk_peer()}) {
    methods.insert(methods.end(), peer.methods.begin(), peer.methods.end());
    if (peer.methods.empty()) fmt::print(stderr, "left out, not installed: {}\n", peer.package);
  }
  return methods;
}

/// What the names of the methods of the front begin with.
constexpr std::string_view front_name = "curvature ";

/// `curvature` with the shapes weighed more and more.
std::vector<Method> front() {
  std::vector<Method> methods;
  for (const double weight : front_weights) {
    methods.push_back(
        own(fmt::format("{}{:.1e}", front_name, weight), SimplifyMethod::curvature, weight));
  }
  return methods;
}

std::size_t vertices_left(const TriMesh& mesh, double removed) {
  return static_cast<std::size_t>(
      std::ceil((1 - removed) * static_cast<double>(mesh.vertices.size())));
}

bool has_ratios(double removed) {
  return std::count(std::begin(ratio_reductions), std::end(ratio_reductions), removed) > 0;
}

/// All methods at one reduction, their repeats in turn; the least time counts.
std::vector<Row> compare(const TriMesh& mesh, const std::vector<Method>& methods, double removed,
                         int repeats) {
  std::vector<Row> rows(methods.size());
  for (int repeat = 0; repeat < repeats; ++repeat) {
    for (std::size_t i = 0; i < methods.size(); ++i) {
      const Job job = methods[i].prepare(mesh, vertices_left(mesh, removed));
      const double seconds = seconds_of(job.run);
      rows[i].seconds = std::min(rows[i].seconds, seconds);
      if (repeat > 0) continue;
      rows[i].method = methods[i].name;
      rows[i].removed = removed;
      rows[i].measure(job.result(), mesh);
    }
  }
  return rows;
}

/// The best of the front of `curvature` against another method: the least mean distance with angles
/// no worse, and the best angles with a mean distance that is no greater.
void add_front(const std::vector<Row>& rows, const Row& peer, const std::string& suffix,
               Json& ratios) {
  const Row* nearest = nullptr;
  const Row* best_shaped = nullptr;
  for (const Row& row : rows) {
    if (!row.method.starts_with("curvature")) continue;
    const bool near = row.distance.forward.mean <= peer.distance.forward.mean;
    const bool shaped = row.angles.mean_minimum >= peer.angles.mean_minimum;
    if (shaped && (!nearest || row.distance.forward.mean < nearest->distance.forward.mean)) {
      nearest = &row;
    }
    if (near && (!best_shaped || row.angles.mean_minimum > best_shaped->angles.mean_minimum)) {
      best_shaped = &row;
    }
  }
  if (nearest) {
    ratios["front_mean_vs_cgal" + suffix] =
        nearest->distance.forward.mean / peer.distance.forward.mean;
    ratios["front_max_vs_cgal" + suffix] =
        nearest->distance.forward.max / peer.distance.forward.max;
  }
  if (best_shaped) {
    ratios["front_angle_gain" + suffix] =
        best_shaped->angles.mean_minimum - peer.angles.mean_minimum;
  }
}

Json ratios_of(const std::vector<Row>& rows, const std::string& suffix) {
  std::map<std::string, const Row*> by_name;
  for (const Row& row : rows) by_name[row.method] = &row;
  Json ratios;
  const auto add = [&](const char* name, const char* a, const char* b,
                       double (*value)(const Row&)) {
    if (by_name.count(a) == 0 || by_name.count(b) == 0) return;
    ratios[name + suffix] = value(*by_name[a]) / value(*by_name[b]);
  };
  const auto seconds = [](const Row& row) { return row.seconds; };
  const auto mean = [](const Row& row) { return row.distance.forward.mean; };
  const auto max = [](const Row& row) { return row.distance.forward.max; };
  add("lindstrom_turk_speedup_vs_cgal", "cgal-lt", "lindstrom-turk", seconds);
  add("lindstrom_turk_mean_vs_cgal", "lindstrom-turk", "cgal-lt", mean);
  add("curvature_speedup_vs_cgal", "cgal-lt", "curvature", seconds);
  add("curvature_mean_vs_cgal", "curvature", "cgal-lt", mean);
  add("curvature_max_vs_cgal", "curvature", "cgal-lt", max);
  add("curvature_shaped_mean_vs_cgal", "curvature-shaped", "cgal-lt", mean);
  if (by_name.count("cgal-lt") != 0) {
    const double cgal = by_name["cgal-lt"]->angles.mean_minimum;
    ratios["curvature_angle_gain" + suffix] = by_name["curvature"]->angles.mean_minimum - cgal;
    ratios["curvature_shaped_angle_gain" + suffix] =
        by_name["curvature-shaped"]->angles.mean_minimum - cgal;
    add_front(rows, *by_name["cgal-lt"], suffix, ratios);
  }
  add("curvature_mean_vs_lindstrom_turk", "curvature", "lindstrom-turk", mean);
  add("curvature_max_vs_lindstrom_turk", "curvature", "lindstrom-turk", max);
  add("paper_mean_vs_length", "paper", "length", mean);
  add("paper_max_vs_length", "paper", "length", max);
  add("paper_time_vs_lindstrom_turk", "paper", "lindstrom-turk", seconds);
  return ratios;
}

void print(const Json& ratios) {
  for (const auto& [key, value] : ratios.items()) {
    fmt::print("  {:40} {:.3f}\n", key, value.get<double>());
  }
  fmt::print("\n");
  std::cout.flush();
}

/// Rows of all reductions; adds the ratios.
std::vector<Row> study(const Surface& surface, const std::vector<Method>& methods,
                       const Settings& settings, Json& ratios) {
  const TriMesh& mesh = surface.mesh;
  const double published = ratio_reductions[mesh.vertices.size() > large_surface ? 0 : 1];
  std::vector<Row> rows;
  for (const double removed : settings.reductions) {
    const int repeats = has_ratios(removed) ? settings.repeats : 1;
    std::vector<Row> compared = compare(mesh, methods, removed, repeats);
    if (has_ratios(removed)) {
      const std::vector<Row> more = compare(mesh, front(), removed, 1);
      compared.insert(compared.end(), more.begin(), more.end());
    }
    rows.insert(rows.end(), compared.begin(), compared.end());
    if (removed == published) ratios.update(ratios_of(compared, ""));
    if (has_ratios(removed)) {
      ratios.update(ratios_of(compared, fmt::format("_{:.0f}", 100 * removed)));
    }
  }
  return rows;
}

/// For the plots, which are over all reductions.
std::vector<Row> without_front(std::vector<Row> rows) {
  std::erase_if(rows, [](const Row& row) { return row.method.starts_with(front_name); });
  return rows;
}

std::string table_of(const Surface& surface, const std::vector<Row>& rows) {
  std::string out = fmt::format("{}: {} vertices; {} threads\n", surface.name,
                                surface.mesh.vertices.size(), thread_count());
  out += Row::headings();
  for (const Row& row : rows) out += row.line();
  return out;
}

/// CPU time of `curvature` per vertex removed within the bound of runs, everything counted, on one
/// thread [us]; the least of the repeats.
double cpu_us_per_removed(const TriMesh& mesh, int repeats) {
  const ThreadLimit one(1);
  const SimplifyOptions options{
      .sides = sides_of(mesh), .spacing = 1, .max_error = bound_of_runs, .measure = false};
  double least = std::numeric_limits<double>::infinity();
  for (int repeat = 0; repeat < repeats; ++repeat) {
    std::size_t left = 0;
    const double seconds =
        cpu_seconds_of([&] { left = simplify(mesh, options).mesh.vertices.size(); });
    least = std::min(least, 1e6 * seconds / static_cast<double>(mesh.vertices.size() - left));
  }
  return least;
}

void add_cost(const Surface& surface, const Settings& settings, Json& result) {
  constexpr const char* name = "curvature_cpu_us_per_removed";
  const double cost = cpu_us_per_removed(surface.mesh, settings.repeats);
  result["ratios"][surface.name][name] = cost;
  if (!settings.json) fmt::print("{}: {} {:.2f}\n\n", surface.name, name, cost);
}

Json compare_surfaces(const Settings& settings) {
  Json result{{"ratios", Json::object()}, {"surfaces", Json::object()}};
  const std::vector<Method> methods = all_methods();
  const std::vector<Surface> surfaces = surfaces_of(settings.files);
  for (const Surface& surface : surfaces) {
    Json ratios = Json::object();
    const std::vector<Row> rows = study(surface, methods, settings, ratios);
    result["ratios"][surface.name] = ratios;
    for (const Row& row : rows) result["surfaces"][surface.name].push_back(row.json());
    const std::string table = table_of(surface, rows);
    const fs::path base = fs::path(settings.folder) / surface.name;
    write_file(base.string() + ".svg", plots_of(surface.name, without_front(rows)));
    write_file(base.string() + ".txt", table);
    if (settings.json) continue;
    fmt::print("{}  table and plots: {}.txt, .svg\n", table, base.string());
    print(ratios);
  }
  for (const Surface& surface : surfaces) add_cost(surface, settings, result);
  add_cost(trench_deposition(), settings, result);
  return result;
}

Json study_flux(const Settings& settings) {
  Json result{{"ratios", Json::object()}};
  for (const Surface& surface : surfaces_of(settings.files)) {
    const FluxComparison flux =
        compare_flux(surface.mesh, flux_reduction, flux_error, settings.repeats);
    Json& ratios = result["ratios"][surface.name];
    ratios["flux_speedup"] = flux.speedup();
    ratios["flux_speedup_with_simplification"] = flux.speedup_with_simplification();
    ratios["flux_difference_vs_error"] = flux.difference_vs_error();
    if (settings.json) continue;
    fmt::print(
        "{}: flux to an error of {}: {:.2f} s, at {:.0f} % removed {:.2f} s after {:.2f} s\n",
        surface.name, flux_error, flux.original_seconds, 100 * flux.removed,
        flux.simplified_seconds, flux.simplify_seconds);
    print(ratios);
  }
  return result;
}

Json study_scaling(const Settings& settings) {
  Json result{{"ratios", Json::object()}, {"costs", Json::object()}};
  const std::vector<TriMesh> surfaces = growing_surfaces();
  // What the threads need for themselves is there from now on.
  cost_of(surfaces.front(), SimplifyMethod::curvature, 1);
  for (const auto& [name, method] : {std::pair{"", SimplifyMethod::curvature},
                                     {"lindstrom_turk_", SimplifyMethod::lindstrom_turk},
                                     {"paper_", SimplifyMethod::paper}}) {
    std::vector<Cost> costs;
    for (const TriMesh& mesh : surfaces) {
      costs.push_back(cost_of(mesh, method, mesh.vertices.size() < 1000000 ? settings.repeats : 1));
      const Cost& cost = costs.back();
      result["costs"][fmt::format("{}{}", name, cost.vertices)] = {
          {"cpu_us_per_removed_vertex", cost.cpu_per_removed},
          {"us_per_removed_vertex", cost.per_removed},
          {"bytes_per_vertex", cost.bytes_per_vertex}};
      if (settings.json) continue;
      fmt::print("{:16} {:>8} vertices {:7.3f} us of CPU, {:7.3f} us each, {:6.0f} bytes\n", name,
                 cost.vertices, cost.cpu_per_removed, cost.per_removed, cost.bytes_per_vertex);
      std::cout.flush();
    }
    result["ratios"][fmt::format("{}cost_spread", name)] = spread(costs);
    result["ratios"][fmt::format("{}bytes_per_vertex", name)] = costs.back().bytes_per_vertex;
  }
  if (!settings.json) print(result["ratios"]);
  return result;
}

void run(const Settings& settings) {
  fs::create_directories(settings.folder);
  const Json result = settings.scaling ? study_scaling(settings)
                      : settings.flux  ? study_flux(settings)
                                       : compare_surfaces(settings);
  const char* name = settings.scaling ? "scaling" : settings.flux ? "flux" : "simplify";
  write_file(fs::path(settings.folder) / (std::string(name) + ".json"), result.dump(2) + "\n");
  if (settings.json) std::cout << result.dump(2) << '\n';
}

}  // namespace
}  // namespace scarp::bench

int main(int argc, char** argv) {
  scarp::bench::Settings settings;
  const auto declare = [&](CLI::App& app) {
    app.add_option("mesh", settings.files, "Surfaces: .obj .ply .stl .vtp .obj.gz");
    app.add_option("--repeats", settings.repeats, "How often each is timed (3)")
        ->check(CLI::PositiveNumber);
    app.add_option("--removed", settings.reductions, "Fractions of the vertices that go, ascending")
        ->check(CLI::Range(0.0, 0.99));
    app.add_option("-o,--output", settings.folder, "Folder for the plots and the .json file");
    app.add_flag("--flux", settings.flux, "Instead: the time of the flux with and without");
    app.add_flag("--scaling", settings.scaling, "Instead: cost and memory per vertex");
    app.add_flag("--json", settings.json, "One object on standard output");
  };
  return scarp::bench::bench_main(argc, argv,
                                  "simplification against its peers: distance, shape, time",
                                  declare, [&] { scarp::bench::run(settings); });
}
