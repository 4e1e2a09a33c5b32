// Whether simplification pays: whole recipes with and without it, to equal error, by one program,
// on one thread.
//
//   ./dev bench pays [CASE...] [--again] [--references] [--json]
//
// The error of a run is the mean distance, both ways, between its surface at the end and that of a
// reference: half the spacing, a quarter of the target error of the flux, on the full mesh and on
// the part of the domain that symmetry leaves. A case runs with its own target, three seeds in turn
// with and without simplification, so that both meet the same neighbours. Where time steps fall on
// the grid is chance as well: each seed has time steps a little longer or shorter. If their errors
// differ by more than two standard errors, the worse one runs again with half its target, at most
// three times. A halving that goes too far would flatter the other one: what has a smaller error
// then counts as what lies between its last two targets, by powers of the error. If it stays worse,
// the case fails: it has no speed-up, and the exit code is 2.
//
// Time is CPU time of the process in survey() and advance(), which are all stages of a time step:
// other programs lengthen it little, and files and metrology are not in it. Within a call the
// stages share it by their wall times.
//
// References are kept in results/bench_pays by the hash of their recipe: they stand for the exact
// surface, whichever program found it. Where a model changes, --references finds them anew. Results
// are kept by the hashes of program and recipes: an interrupted benchmark repeats one case at the
// most, and nothing stale is used.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/simulator/recipe.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/system/atomic_file.h"
#include "core/system/hash.h"
#include "core/system/read_file.h"
#include "mesh/files/mesh_file.h"
#include "tests/bench/bench_main.h"
#include "tests/bench/equal_error.h"
#include "tests/bench/whole_run.h"

namespace scarp::bench {
namespace {

namespace fs = std::filesystem;

using Overrides = std::vector<std::string>;
using Json = nlohmann::ordered_json;

constexpr int seed_count = 3;
constexpr std::array<double, seed_count> time_steps_of_seeds{1, 0.95, 1.05};

struct Settings {
  std::vector<std::string> cases{};
  bool again = false;
  bool references = false;
  bool json = false;
};

struct Case {
  std::string name;
  std::string recipe;
  Overrides settings{};
  Overrides reference{};  ///< besides those of all references
};

/// A section in two dimensions as a slice.
Overrides slice(const std::string& extent, const std::string& spacing) {
  return {"domain.mode=\"3d\"", "domain.boundary=[\"reflective\", \"reflective\"]",
          "domain.extent=" + extent, "domain.spacing=\"" + spacing + "\""};
}

const std::vector<Case> all_cases{
    {"trench", "configs/trench_deposition.toml"},
    {"trench10",
     "configs/trench_deposition.toml",
     {"domain.extent=[\"10 um\", \"2 um\"]", "geometry[1].width=\"2 um\"",
      "geometry[1].depth=\"20 um\"", "step[0].duration=\"40 s\"", "output.every=\"0 s\""}},
    {"array", "tests/bench/runs/trench_array.toml"},
    {"sf6", "configs/sf6_o2_hole.toml", {"domain.symmetry=\"none\"", "output.every=\"0 s\""}},
    {"bosch3d", "configs/bosch_trench.toml", slice("[\"5 um\", \"0.5 um\"]", "50 nm")},
    {"milling3d", "configs/ion_milling.toml", slice("[\"0.8 um\", \"0.1 um\"]", "20 nm")},
    // A part of the trench: on all of it a run takes seven CPU minutes, and three to four times
    // that with half the target. Both engines solve the same equation, so the reference gathers.
    {"forward",
     "configs/trench_deposition.toml",
     {"domain.extent=[\"10 um\", \"1 um\"]", "flux.engine=\"forward\""},
     {"flux.engine=\"auto\""}},
};

Recipe recipe_of(const Case& of, const Overrides& changes) {
  Overrides overrides = of.settings;
  overrides.insert(overrides.end(), changes.begin(), changes.end());
  return read_recipe(recipe_in(fs::path(SCARP_SOURCE_DIR) / of.recipe, overrides));
}

// --- what is kept --------------------------------------------------------------------------------

std::string hash_of(std::string_view text) {
  Hash hash;
  hash.add(text);
  return hash.hex();
}

fs::path folder() { return fs::path(SCARP_SOURCE_DIR) / "results/bench_pays"; }

Recipe reference_recipe(const Case& of) {
  const Recipe own = recipe_of(of, {});
  Overrides finer = of.reference;
  finer.push_back(fmt::format("domain.spacing=\"{} nm\"", own.domain.frame.spacing / 2));
  finer.push_back(fmt::format("flux.target_error={}", own.flux.options.target_error / 4));
  finer.insert(finer.end(), {"domain.symmetry=\"auto\"", "simplify.enabled=false"});
  return recipe_of(of, finer);
}

TriMesh reference_of(const Case& of, bool anew) {
  const Recipe recipe = reference_recipe(of);
  const fs::path file = folder() / fmt::format("reference_{}.ply", hash_of(recipe.resolved));
  if (anew || !fs::exists(file)) {
    fmt::print(stderr, "{}: computing the reference, once: {}\n", of.name, file.string());
    write_mesh(file, run_to_end(recipe).surface);
  }
  return read_mesh(file);
}

/// Where the result of a case is kept: of this program, another one finds its own.
fs::path result_file(const Case& of) {
  static const std::string program = hash_of(read_file("/proc/self/exe"));
  const std::string recipes = recipe_of(of, {}).resolved + reference_recipe(of).resolved;
  return folder() / fmt::format("{}_{}.json", of.name, hash_of(program + recipes));
}

// --- measurements --------------------------------------------------------------------------------

/// One way to run a case: means over the seeds. Units: CPU s, spacings.
struct Measured {
  std::string name;
  Overrides changes{};
  double target = 0;          ///< flux.target_error
  bool interpolated = false;  ///< between two targets
  MeanValue error{};
  double seconds = 0;
  double facets = 0;
  double rays = 0;
  double time_steps = 0;
  StageTimer stages{};
  std::vector<double> errors{};  ///< by seed

  void add(const WholeRun& run, double error_of_run) {
    errors.push_back(error_of_run);
    error = mean_of(errors);
    seconds += run.cpu_seconds / seed_count;
    facets += run.facets / seed_count;
    rays += run.rays / seed_count;
    time_steps += static_cast<double>(run.time_steps) / seed_count;
    for (const auto& [stage, cpu] : run.stages.stages()) stages.add(stage, cpu / seed_count);
  }
};

/// What a target between two would take: each stage by a power of the error.
Measured between(const Measured& before, const Measured& after, double weight) {
  const auto mean = [&](double a, double b) {
    return a > 0 && b > 0 ? std::pow(a, 1 - weight) * std::pow(b, weight) : b;
  };
  Measured result{.name = after.name,
                  .changes = after.changes,
                  .target = mean(before.target, after.target),
                  .interpolated = true,
                  .error = {mean(before.error.mean, after.error.mean),
                            std::max(before.error.std_error, after.error.std_error)},
                  .facets = mean(before.facets, after.facets),
                  .rays = mean(before.rays, after.rays),
                  .time_steps = mean(before.time_steps, after.time_steps)};
  for (const auto& [stage, cpu] : after.stages.stages()) {
    result.stages.add(stage, mean(before.stages.seconds(stage), cpu));
    result.seconds += result.stages.seconds(stage);
  }
  return result;
}

void tell(const Case& of, const Measured& measured, int seed, const WholeRun& run) {
  fmt::print(stderr, "{}: {}, target {}, seed {}: {:.2f} s, {:.4f} spacings off\n", of.name,
             measured.name, measured.target, seed, run.cpu_seconds, measured.errors.back());
}

void run_seed(const Case& of, int seed, const TriMesh& reference, Measured& measured) {
  Overrides changes = measured.changes;
  changes.push_back(fmt::format("flux.target_error={}", measured.target));
  changes.push_back(fmt::format("flux.seed={}", seed));
  const double cfl =
      time_steps_of_seeds[static_cast<std::size_t>(seed) - 1] * recipe_of(of, {}).advection.cfl;
  changes.push_back(fmt::format("advection.cfl={}", cfl));
  const Recipe recipe = recipe_of(of, changes);
  const WholeRun run = run_to_end(recipe);
  measured.add(run, distance_between(run.surface, reference, recipe.domain.frame.spacing));
  tell(of, measured, seed, run);
}

Json json_of(const Measured& measured) {
  Json stages;
  for (const auto& [stage, seconds] : measured.stages.stages()) stages[stage] = seconds;
  return {{"time_s", measured.seconds},
          {"error", measured.error.mean},
          {"std_error", measured.error.std_error},
          {"facets", measured.facets},
          {"target_error", measured.target},
          {"interpolated", measured.interpolated},
          {"time_steps", measured.time_steps},
          {"rays", measured.rays},
          {"stages", stages}};
}

Json measure(const Case& of, const TriMesh& reference) {
  const double target = recipe_of(of, {}).flux.options.target_error;
  Measured full{.name = "full mesh", .changes = {"simplify.enabled=false"}, .target = target};
  Measured simplified{.name = "simplified", .target = target};
  for (int seed = 1; seed <= seed_count; ++seed) {
    run_seed(of, seed, reference, full);
    run_seed(of, seed, reference, simplified);
  }
  const bool is_equal =
      bring_to_equal_error(full, simplified, [&](Measured& worse, double new_target) {
        worse = {.name = worse.name, .changes = worse.changes, .target = new_target};
        for (int seed = 1; seed <= seed_count; ++seed) run_seed(of, seed, reference, worse);
      });
  Json speedup;  // null where the errors are not equal
  if (is_equal) speedup = full.seconds / simplified.seconds;
  return {{"speedup", speedup}, {"full", json_of(full)}, {"simplified", json_of(simplified)}};
}

Json result_of(const Case& of, const Settings& settings) {
  const fs::path file = result_file(of);
  const bool again = settings.again || settings.references;
  if (!again && fs::exists(file)) return Json::parse(read_file(file));
  Json result = measure(of, reference_of(of, settings.references));
  write_file(file, result.dump(2) + "\n");
  return result;
}

// --- results -------------------------------------------------------------------------------------

constexpr const char* stage_names[]{"surface", "simplify", "flux", "map", "advect"};

std::string row_of(const std::string& name, const Json& measured, const std::string& speedup) {
  std::string row =
      fmt::format("| {} | {:.2f} s | {:.4f} ± {:.4f} | {:.0f} | {}{:.3g} | {:.0f} |", name,
                  measured["time_s"].get<double>(), measured["error"].get<double>(),
                  measured["std_error"].get<double>(), measured["facets"].get<double>(),
                  measured["interpolated"].get<bool>() ? "≈ " : "",
                  measured["target_error"].get<double>(), measured["time_steps"].get<double>());
  for (const char* stage : stage_names)
    row += fmt::format(" {:.2f} |", measured["stages"].value(stage, 0.0));
  return row + fmt::format(" {} |\n", speedup);
}

/// As docs/speed.md has it.
std::string table_of(const Json& results) {
  std::string table = "| case | CPU time | error, spacings | facets | target | time steps |";
  for (const char* stage : stage_names) table += fmt::format(" {} |", stage);
  table += " full / simplified |\n| --- | ---";
  for (std::size_t column = 0; column < 5 + std::size(stage_names); ++column) table += " | ---";
  table += " |\n";
  for (const auto& [name, result] : results.items()) {
    const Json& speedup = result["speedup"];
    table += row_of(fmt::format("`{}`, full", name), result["full"], "");
    table +=
        row_of("simplified", result["simplified"],
               speedup.is_null() ? "errors differ" : fmt::format("{:.2f}", speedup.get<double>()));
  }
  return table;
}

void print(const Json& results, bool json) {
  if (!json) return fmt::print("{}", table_of(results));
  Json ratios;
  for (const auto& [name, result] : results.items()) ratios[name]["speedup"] = result["speedup"];
  std::cout << Json{{"ratios", ratios}, {"absolute", results}}.dump(2) << '\n';
}

void run(const Settings& settings) {
  const ThreadLimit one_thread(1);
  fs::create_directories(folder());
  Json results;
  std::string failed;
  for (const Case& each : all_cases) {
    const bool is_wanted = settings.cases.empty() ||
                           std::ranges::find(settings.cases, each.name) != settings.cases.end();
    if (!is_wanted) continue;
    results[each.name] = result_of(each, settings);
    if (results[each.name]["speedup"].is_null()) failed += " " + each.name;
  }
  print(results, settings.json);
  if (!failed.empty()) throw InputError("the errors differ after three halvings:" + failed);
}

}  // namespace
}  // namespace scarp::bench

int main(int argc, char** argv) {
  scarp::bench::Settings settings;
  const auto declare = [&](CLI::App& app) {
    scarp::bench::add_cases(app, scarp::bench::all_cases, settings.cases);
    app.add_flag("--again", settings.again, "Measure cases again; references are kept");
    app.add_flag("--references", settings.references, "Find references anew as well");
    app.add_flag("--json", settings.json, "One object on standard output");
  };
  return scarp::bench::bench_main(argc, argv, "whole recipes with and without simplification",
                                  declare, [&] { scarp::bench::run(settings); });
}
