// Whole recipes to a profile, against the plain loop: particles from the source for every move of
// the full mesh.
//
//   ./dev bench run [CASE...] [--features | --knees FILE.svg | --scaling] [--seeds N]
//                   [--equal-error] [--threads N] [--json]
//
// A case is a recipe as its user has it, the same as the plain loop, and a reference at half the
// spacing with a quarter of the target error and moves a quarter as long, on the full mesh. The
// profile error of both is the mean distance, both ways, between the surface at the end and that of
// the reference. With --features each feature is switched off in turn. With --seeds times and
// errors are means over seeds, errors with the standard error of the mean. With --equal-error a
// plain loop that is further off runs again with half the moves' length, up to three times, until
// it is not. With --knees every number that trades error for work takes values around its default:
// error against work, means of four seeds, as a table and as a plot. With --scaling the spacing of
// one case is halved three times, to half of its own. Seconds are those of all stages of time
// steps: nothing else should run.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/run/restart.h"
#include "apps/run/run.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/system/atomic_file.h"
#include "core/system/peak_memory.h"
#include "core/system/temporary_folder.h"
#include "levelset/surface/extract_surface.h"
#include "tests/apps/columns.h"
#include "tests/bench/bench_main.h"
#include "tests/bench/equal_error.h"
#include "tests/bench/svg_plot.h"
#include "tests/bench/whole_run.h"

namespace scarp::bench {
namespace {

namespace fs = std::filesystem;

using Overrides = std::vector<std::string>;

struct Settings {
  std::vector<std::string> cases{};
  bool features = false;
  bool scaling = false;
  bool equal_error = false;
  int seeds = 1;
  std::string knees{};  ///< file of the plot; empty: none
  int threads = 0;
  bool json = false;
};

struct Case {
  std::string name;
  std::string recipe;
  Overrides settings{};
  Overrides reference{};  ///< with half the spacing, a quarter of the target error and of a move
  Overrides plain{};      ///< of the plain loop, in place of its own
};

/// Forward, all particles are traced anew for every change of the coverages, which takes hours.
const Overrides gathered{"flux.engine=\"gather\""};

/// As few particles as are ever sent, and coverages that fit them about as well as those tell.
const Overrides imprecise{"flux.target_error=0.1", "flux.coverage_tolerance=0.02",
                          "flux.coverage_iterations=5"};

const std::vector<Case> all_cases{
    {"trench",
     "configs/trench_deposition.toml",
     {"domain.extent=[\"10 um\", \"2 um\"]", "output.every=\"0 s\""},
     {"domain.spacing=\"50 nm\"", "flux.target_error=0.0025", "advection.cfl=0.2"}},
    {"trench10",
     "configs/trench_deposition.toml",
     {"domain.extent=[\"10 um\", \"2 um\"]", "geometry[1].width=\"2 um\"",
      "geometry[1].depth=\"20 um\"", "step[0].duration=\"40 s\"", "output.every=\"0 s\""},
     {"domain.spacing=\"50 nm\"", "flux.target_error=0.0025", "advection.cfl=0.2"}},
    {"hole",
     "configs/hole_directional_etch.toml",
     {"domain.symmetry=\"auto\"", "output.every=\"0 s\""},
     {"domain.spacing=\"5 nm\"", "advection.cfl=0.2"}},
    {"bosch",
     "configs/bosch_trench.toml",
     {"domain.spacing=\"50 nm\"", "domain.symmetry=\"auto\"", "output.every=\"0 s\""},
     {"domain.spacing=\"25 nm\"", "flux.target_error=0.005", "advection.cfl=0.2"}},
    {"sf6",
     "configs/sf6_o2_hole.toml",
     {"domain.symmetry=\"auto\"", "output.every=\"0 s\""},
     {"domain.spacing=\"15 nm\"", "flux.target_error=0.005", "advection.cfl=0.2"},
     imprecise},
    {"ald",
     "tests/bench/runs/ald_hole.toml",
     {},
     {"domain.spacing=\"5 nm\"", "flux.target_error=0.0025", "advection.cfl=0.2"},
     gathered},
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
  const Recipe recipe = read_recipe(recipe_in(fs::path(SCARP_SOURCE_DIR) / of.recipe, overrides));
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

struct Row {
  std::string name;
  Finished run;
  MeanValue error{};  ///< spacings
};

void print(const Row& row) {
  fmt::print("  {:34} {:8.1f} s {:6} time steps {:9.2g} rays {:8.3f}{} spacings off\n", row.name,
             row.run.seconds, row.run.time_steps, row.run.rays, row.error.mean,
             row.error.std_error > 0 ? fmt::format(" +- {:.3f}", row.error.std_error) : "");
  std::fflush(stdout);
}

/// Time and memory by spacing, coarse first: the peak of the process is then that of the last run.
nlohmann::ordered_json scaling_of(const Case& of, bool quiet) {
  const double spacing = read_recipe(recipe_in(fs::path(SCARP_SOURCE_DIR) / of.recipe, of.settings))
                             .domain.frame.spacing;
  double last_seconds = 0;
  double last_mb = 0;
  double most_time = 0;
  double most_memory = 0;
  const double idle_mb = peak_memory_mb();
  for (const double times : {4.0, 2.0, 1.0, 0.5}) {
    const Finished run =
        finished_run(of, {fmt::format("domain.spacing=\"{} nm\"", times * spacing)});
    const double mb = peak_memory_mb() - idle_mb;
    if (!quiet) {
      fmt::print("  {:8.4g} nm {:8.2f} s {:5} time steps {:9.2g} rays {:8.1f} MB", times * spacing,
                 run.seconds, run.time_steps, run.rays, mb);
      if (last_seconds > 0) {
        fmt::print("  {:6.2f} times the time, {:5.2f} the memory", run.seconds / last_seconds,
                   mb / last_mb);
      }
      fmt::print("\n");
      std::fflush(stdout);
    }
    if (last_seconds > 0) {
      most_time = std::max(most_time, run.seconds / last_seconds);
      most_memory = std::max(most_memory, mb / last_mb);
    }
    last_seconds = run.seconds;
    last_mb = mb;
  }
  return {{"time_per_halving", most_time}, {"memory_per_halving", most_memory}};
}

/// A number that trades error for work, with values around its default.
struct Knob {
  std::string path;
  std::vector<double> values;
  bool is_relative = false;  ///< times what the recipe has
};

const std::vector<Knob> knobs{{"flux.target_error", {0.25, 0.5, 1, 2, 4}, true},
                              {"flux.carry_within", {0, 0.005, 0.01, 0.02, 0.05, 0.1}},
                              {"flux.keep_mesh_within", {0, 0.0125, 0.025, 0.05, 0.1, 0.2}},
                              {"advection.cfl", {0.1, 0.2, 0.4, 0.57}},
                              {"simplify.l0", {0.3, 0.6, 1.2, 2.4}},
                              {"simplify.l_max", {1.5, 3, 6, 12}}};

/// Error against work for every knob; prints each point.
Plot knees_of(const Case& of, const TriMesh& reference) {
  constexpr int seeds = 4;
  const Recipe recipe = read_recipe(recipe_in(fs::path(SCARP_SOURCE_DIR) / of.recipe, of.settings));
  const auto mean_of = [&](const Overrides& changes) {
    std::pair<double, double> mean;
    for (int seed = 1; seed <= seeds; ++seed) {
      Overrides with_seed = changes;
      with_seed.push_back(fmt::format("flux.seed={}", seed));
      const Finished run = finished_run(of, with_seed);
      mean.first += run.seconds / seeds;
      mean.second += distance_between(run.surface, reference, recipe.domain.frame.spacing) / seeds;
    }
    return mean;
  };
  const auto [seconds, error] = mean_of({});
  fmt::print("  {:24} {:>8} {:8.2f} times the work {:8.3f} spacings off\n", "as it is", "", 1.0,
             error);
  Plot plot{
      .title = of.name + ": spacings off", .x_label = "time by that of the defaults", .series = {}};
  for (const Knob& knob : knobs) {
    Series series{.name = knob.path, .points = {}};
    for (const double value : knob.values) {
      const double set = knob.is_relative ? value * recipe.flux.options.target_error : value;
      const auto [work, off] = mean_of({fmt::format("{}={}", knob.path, set)});
      fmt::print("  {:24} {:8.4g} {:8.2f} times the work {:8.3f} spacings off\n", knob.path, set,
                 work / seconds, off);
      std::fflush(stdout);
      series.points.emplace_back(work / seconds, off);
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

TriMesh reference_of(const Case& of) {
  Overrides on_full_mesh = of.reference;
  on_full_mesh.emplace_back("simplify.enabled=false");
  return finished_run(of, on_full_mesh).surface;
}

nlohmann::ordered_json measure(const Case& of, const Settings& settings) {
  const double spacing = read_recipe(recipe_in(fs::path(SCARP_SOURCE_DIR) / of.recipe, of.settings))
                             .domain.frame.spacing;
  const TriMesh reference = reference_of(of);
  const auto run_with = [&](const std::string& name, const Overrides& changes) {
    Row row{.name = name, .run = {}};
    std::vector<double> errors;
    for (int seed = 1; seed <= settings.seeds; ++seed) {
      Overrides of_seed = changes;
      of_seed.push_back(fmt::format("flux.seed={}", seed));
      const Finished run = finished_run(of, of_seed);
      errors.push_back(distance_between(run.surface, reference, spacing));
      row.run.seconds += run.seconds / settings.seeds;
      row.run.rays += run.rays / settings.seeds;
      row.run.time_steps = run.time_steps;
    }
    row.error = mean_of(errors);
    if (!settings.json) print(row);
    return row;
  };
  if (!settings.json) fmt::print("{}\n", of.name);
  const Row ours = run_with("as it is", {});
  if (settings.features)
    for (const std::string& off : plain) run_with(off, {off});
  Overrides plain_of_case = plain;
  plain_of_case.insert(plain_of_case.end(), of.plain.begin(), of.plain.end());
  const Row loop = run_with("plain loop", plain_of_case);
  nlohmann::ordered_json result{{"speedup", loop.run.seconds / ours.run.seconds},
                                {"profile_error", ours.error.mean},
                                {"plain_error", loop.error.mean}};
  if (settings.equal_error) {
    Row equal = loop;
    double cfl =
        read_recipe(recipe_in(fs::path(SCARP_SOURCE_DIR) / of.recipe, of.settings)).advection.cfl;
    for (int halving = 0; halving < 3 && equal.error.mean > ours.error.mean; ++halving) {
      cfl /= 2;
      Overrides shorter = plain_of_case;
      shorter.push_back(fmt::format("advection.cfl={}", cfl));
      equal = run_with(fmt::format("plain loop, advection.cfl = {}", cfl), shorter);
    }
    result["speedup_to_equal_error"] = equal.run.seconds / ours.run.seconds;
    result["equal_error"] = equal.error.mean;
  }
  if (!settings.json) {
    for (const auto& [name, value] : result.items())
      if (name.starts_with("speedup")) fmt::print("  {} {:.1f}\n", name, value.get<double>());
  }
  return result;
}

void run(const Settings& settings) {
  if (settings.scaling && settings.cases.size() != 1)
    throw InputError("--scaling takes one case: the peak of memory is that of the process");
  const ThreadLimit limit(settings.threads);
  nlohmann::ordered_json ratios;
  std::vector<Plot> plots;
  for (const Case& each : all_cases) {
    const bool is_wanted = settings.cases.empty() ||
                           std::ranges::find(settings.cases, each.name) != settings.cases.end();
    if (!is_wanted) continue;
    if (settings.knees.empty() && !settings.scaling) {
      ratios[each.name] = measure(each, settings);
      continue;
    }
    if (!settings.json) fmt::print("{}\n", each.name);
    if (settings.scaling) {
      ratios[each.name] = scaling_of(each, settings.json);
    } else {
      plots.push_back(knees_of(each, reference_of(each)));
    }
  }
  if (!plots.empty()) write_file(settings.knees, svg_of(plots));
  if (settings.json) std::cout << nlohmann::ordered_json{{"ratios", ratios}}.dump(2) << '\n';
}

}  // namespace
}  // namespace scarp::bench

int main(int argc, char** argv) {
  scarp::bench::Settings settings;
  const auto declare = [&](CLI::App& app) {
    scarp::bench::add_cases(app, scarp::bench::all_cases, settings.cases);
    app.add_flag("--features", settings.features, "Switch each feature off in turn, too");
    app.add_option("--threads", settings.threads, "0: all cores")->check(CLI::NonNegativeNumber);
    app.add_flag("--json", settings.json, "One object on standard output");
    app.add_option("--knees", settings.knees,
                   "Plot error against work for each number that trades one for the other (.svg)")
        ->excludes("--features", "--json");
    app.add_option("--seeds", settings.seeds, "Means over so many seeds")
        ->check(CLI::PositiveNumber);
    app.add_flag("--equal-error", settings.equal_error,
                 "Shorten the moves of a plain loop that is further off until it is not");
    app.add_flag("--scaling", settings.scaling, "Halve the spacing three times instead")
        ->excludes("--features", "--knees");
  };
  return scarp::bench::bench_main(argc, argv, "whole recipes against the plain loop", declare,
                                  [&] { scarp::bench::run(settings); });
}
