// Whole recipes to a profile, against the plain loop: particles from the source for every move of
// the full mesh.
//
//   ./dev bench run [CASE...] [--features] [--json] [--threads N]
//
// A case is a recipe as its user has it, the same as the plain loop, and a reference at half the
// spacing and a quarter of the target error. The profile error of both is the mean distance, both
// ways, between the surface at the end and that of the reference. With --features each feature is
// switched off in turn. Seconds are those of all stages of time steps: nothing else should run.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/restart.h"
#include "apps/run.h"
#include "core/parallel.h"
#include "core/temporary_folder.h"
#include "levelset/extract_surface.h"
#include "mesh/distance.h"
#include "tests/apps/columns.h"
#include "tests/bench/bench_main.h"

namespace scarp::bench {
namespace {

namespace fs = std::filesystem;

using Overrides = std::vector<std::string>;

struct Settings {
  std::vector<std::string> cases{};
  bool features = false;
  int threads = 0;
  bool json = false;
};

struct Case {
  std::string name;
  std::string recipe;
  Overrides settings{};
  Overrides reference{};  ///< with half the spacing and a quarter of the target error
};

const std::vector<Case> all_cases{
    {"trench",
     "configs/trench_deposition.toml",
     {"domain.extent=[\"10 um\", \"2 um\"]", "output.every=\"0 s\""},
     {"domain.spacing=\"50 nm\"", "flux.target_error=0.0025"}},
    {"hole",
     "configs/hole_directional_etch.toml",
     {"domain.symmetry=\"auto\"", "output.every=\"0 s\""},
     {"domain.spacing=\"5 nm\""}},
    {"bosch",
     "configs/bosch_trench.toml",
     {"domain.spacing=\"50 nm\"", "domain.symmetry=\"auto\"", "output.every=\"0 s\""},
     {"domain.spacing=\"25 nm\"", "flux.target_error=0.005"}},
    {"sf6",
     "configs/sf6_o2_hole.toml",
     {"domain.symmetry=\"auto\"", "output.every=\"0 s\""},
     {"domain.spacing=\"15 nm\"", "flux.target_error=0.005"}},
    {"ald",
     "tests/bench/runs/ald_hole.toml",
     {},
     {"domain.spacing=\"5 nm\"", "flux.target_error=0.0025"}},
};

const Overrides plain{"flux.engine=\"forward\"", "flux.carry_within=0", "flux.keep_mesh_within=0",
                      "simplify.enabled=false", "domain.symmetry=\"none\""};

/// A run to its end.
struct Finished {
  double seconds = 0;
  std::size_t time_steps = 0;
  double rays = 0;
  TriMesh surface;
};

Finished finished_run(const Case& of, const Overrides& changes) {
  Overrides overrides = of.settings;
  overrides.insert(overrides.end(), changes.begin(), changes.end());
  const Recipe recipe = read_recipe(fs::path(SCARP_SOURCE_DIR) / of.recipe, overrides);
  const TemporaryFolder folder;
  scarp::run(recipe, folder, {});
  const SavedWafer wafer = read_wafer(newest_state(folder));
  Finished result{.surface = extract_surface(wafer.layers, open_gas(wafer.layers))};
  const auto columns = columns_of(folder / "metrics.csv");
  result.time_steps = columns.at("time_s").size();
  for (const std::string& each : columns.at("rays")) result.rays += std::stod(each);
  for (const auto& [name, values] : columns) {
    if (!name.starts_with("t_")) continue;
    for (const std::string& each : values) result.seconds += std::stod(each);
  }
  return result;
}

double distance_between(const TriMesh& a, const TriMesh& b, double spacing) {
  const SurfaceDistance distance = surface_distance(a, b, spacing);
  return (distance.forward.mean + distance.reverse.mean) / (2 * spacing);
}

struct Row {
  std::string name;
  Finished run;
  double error = 0;  ///< spacings
};

void print(const Row& row) {
  fmt::print("  {:34} {:8.1f} s {:6} time steps {:9.2g} rays {:8.3f} spacings off\n", row.name,
             row.run.seconds, row.run.time_steps, row.run.rays, row.error);
  std::fflush(stdout);
}

nlohmann::ordered_json measure(const Case& of, const Settings& settings) {
  const double spacing =
      read_recipe(fs::path(SCARP_SOURCE_DIR) / of.recipe, of.settings).frame.spacing;
  const TriMesh reference = finished_run(of, of.reference).surface;
  const auto run_with = [&](const std::string& name, const Overrides& changes) {
    Row row{name, finished_run(of, changes)};
    row.error = distance_between(row.run.surface, reference, spacing);
    if (!settings.json) print(row);
    return row;
  };
  if (!settings.json) fmt::print("{}\n", of.name);
  const Row ours = run_with("as it is", {});
  if (settings.features)
    for (const std::string& off : plain) run_with(off, {off});
  const Row loop = run_with("plain loop", plain);
  const double speedup = loop.run.seconds / ours.run.seconds;
  if (!settings.json) fmt::print("  speedup {:.1f}\n", speedup);
  return {{"speedup", speedup}, {"profile_error", ours.error}, {"plain_error", loop.error}};
}

void run(const Settings& settings) {
  const ThreadLimit limit(settings.threads);
  nlohmann::ordered_json ratios;
  for (const Case& each : all_cases) {
    const bool is_wanted = settings.cases.empty() ||
                           std::ranges::find(settings.cases, each.name) != settings.cases.end();
    if (is_wanted) ratios[each.name] = measure(each, settings);
  }
  if (settings.json) std::cout << nlohmann::ordered_json{{"ratios", ratios}}.dump(2) << '\n';
}

}  // namespace
}  // namespace scarp::bench

int main(int argc, char** argv) {
  scarp::bench::Settings settings;
  const auto declare = [&](CLI::App& app) {
    std::vector<std::string> names;
    for (const auto& each : scarp::bench::all_cases) names.push_back(each.name);
    app.add_option("cases", settings.cases, "Cases; all without any")->check(CLI::IsMember(names));
    app.add_flag("--features", settings.features, "Switch each feature off in turn, too");
    app.add_option("--threads", settings.threads, "0: all cores")->check(CLI::NonNegativeNumber);
    app.add_flag("--json", settings.json, "One object on standard output");
  };
  return scarp::bench::bench_main(argc, argv, "whole recipes against the plain loop", declare,
                                  [&] { scarp::bench::run(settings); });
}
