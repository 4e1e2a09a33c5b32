// How often scarp compare is wrong: recipes against themselves, and changes that it has to find.
//
//   ./dev bench verdicts [CASE...] [--comparisons 200] [--seeds 3] [--json]
//
// A comparison has two groups of runs, all of which have their own seeds. Each is judged with the
// tolerances that are the default and with tolerances of 0, under which any difference has to be
// told from chance. Of a recipe against itself 0.27 % may fail by chance, either way, however large
// the noise. Changes are compared with the recipe as it is: with tolerances of 0 they have to fail,
// with the default ones to be significant. The full mesh must not fail with the default ones.
//
// Exit code 2: more failed than chance makes in one of a thousand benchmarks.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/report/comparison.h"
#include "apps/run/run.h"
#include "apps/simulator/recipe.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/student.h"
#include "core/system/temporary_folder.h"
#include "tests/bench/bench_main.h"

namespace scarp::bench {
namespace {

namespace fs = std::filesystem;

using Overrides = std::vector<std::string>;
using Json = nlohmann::ordered_json;

struct Settings {
  std::vector<std::string> cases{};
  int comparisons = 200;
  int seeds = 3;
  bool json = false;
};

struct Change {
  std::string name;
  Overrides overrides;
};

struct Case {
  std::string name;
  std::string recipe;
  Overrides settings{};
  std::vector<Change> changes{};
};

const std::vector<Case> all_cases{
    {"film",
     "verdict_film.toml",
     {},
     {{"sticking + 2 %", {"step[0].sticking=0.306"}},
      {"rate + 2 %", {"step[0].growth_rate=\"1.02 um/min\""}},
      {"width + .3 spacings", {"geometry[1].width=\"515 nm\""}}}},
    {"film_noisy", "verdict_film.toml", {"flux.rays=200"}},
    {"etch",
     "verdict_etch.toml",
     {},
     {{"sticking + 2 %", {"step[0].sticking=0.51"}},
      {"rate + 2 %", {"step[0].etch_rate=\"2.04 nm/s\""}},
      {"diameter + .3 spacings", {"geometry[1].radius=\"127.5 nm\""}},
      {"full mesh", {"simplify.enabled=false"}}}},
    {"etch_noisy", "verdict_etch.toml", {"flux.engine=\"forward\"", "flux.rays=300"}},
    {"ridge",
     "verdict_ridge.toml",
     {},
     {{"sticking + 2 %", {"step[0].sticking=0.714"}},
      {"rate + 2 %", {"step[0].etch_rate=\"2.04 nm/s\""}},
      {"width + .3 spacings", {"geometry[1].width=\"166 nm\""}},
      {"full mesh", {"simplify.enabled=false"}}}},
    {"ridge_noisy",
     "verdict_ridge.toml",
     {"flux.engine=\"forward\"", "flux.rays=300", "simplify.enabled=false"}},
};

constexpr Tolerances no_tolerances{.length_cells = 0,
                                   .length_part = 0,
                                   .film_cells = 0,
                                   .film_part = 0,
                                   .volume_cells = 0,
                                   .volume_part = 0,
                                   .mean_distance = 0,
                                   .p99_distance = 0};

/// How comparisons of one kind ended.
struct Count {
  int comparisons = 0;
  int failed = 0;         ///< with the default tolerances
  int noisy = 0;          ///< passed, but something is beyond its tolerance
  int failed_within = 0;  ///< with tolerances of 0
  int significant = 0;
};

bool has_noise(const Comparison& comparison) {
  return std::ranges::any_of(
      comparison.values, [](const ComparedValue& each) { return each.verdict == Verdict::noise; });
}

/// Makes runs, each with a seed that no other one has.
class Runner {
 public:
  Runner(const Case& of, int seeds) : case_(of), seeds_(seeds) {}

  Count compare_all(int comparisons, const Overrides& change) {
    Count count;
    for (; count.comparisons < comparisons; ++count.comparisons) {
      const TemporaryFolder folder;
      const RunGroup first = group(folder, "first", {});
      const RunGroup other = group(folder, "second", change);
      const Comparison usual = compare(first, other, {});
      count.failed += usual.passed() ? 0 : 1;
      count.noisy += usual.passed() && has_noise(usual) ? 1 : 0;
      count.significant += usual.is_significant() ? 1 : 0;
      count.failed_within += compare(first, other, no_tolerances).passed() ? 0 : 1;
    }
    return count;
  }

 private:
  RunGroup group(const fs::path& folder, const std::string& name, const Overrides& changes) {
    RunGroup group{.name = name, .runs = {}};
    for (int n = 0; n < seeds_; ++n) {
      Overrides overrides = case_.settings;
      overrides.insert(overrides.end(), changes.begin(), changes.end());
      overrides.push_back(fmt::format("flux.seed={}", ++seed_));
      const Recipe recipe = read_recipe(
          recipe_in(fs::path(SCARP_SOURCE_DIR) / "tests/bench/runs" / case_.recipe, overrides));
      const fs::path where = folder / fmt::format("{}_{}", name, n);
      run(recipe, where, {});
      group.runs.push_back(read_run(where));
    }
    return group;
  }

  const Case& case_;
  int seeds_;
  int seed_ = 0;
};

/// How many of so many may fail by chance, but for one benchmark in a thousand.
int allowed(int comparisons) {
  const double chance = three_standard_errors_chance();
  double more = 1;
  double term = std::pow(1 - chance, comparisons);
  for (int n = 0;; ++n) {
    more -= term;
    if (more < 1e-3) return n;
    term *= chance / (1 - chance) * (comparisons - n) / (n + 1);
  }
}

Json json_of(const Count& count) {
  return {{"comparisons", count.comparisons},
          {"failed", count.failed},
          {"noise", count.noisy},
          {"failed_without_tolerances", count.failed_within},
          {"significant", count.significant}};
}

Json measure(const Case& of, const Settings& settings) {
  Runner runner(of, settings.seeds);
  Json result{{"itself", json_of(runner.compare_all(settings.comparisons, {}))}};
  for (const Change& each : of.changes) {
    result[each.name] =
        json_of(runner.compare_all(std::max(1, settings.comparisons / 10), each.overrides));
  }
  return result;
}

void print(const Json& results) {
  fmt::print(
      "| case | change | comparisons | fail | noise | fail with tolerances of 0 | significant |\n");
  fmt::print("| --- | --- | --- | --- | --- | --- | --- |\n");
  for (const auto& [name, changes] : results.items()) {
    for (const auto& [change, count] : changes.items())
      fmt::print("| {} | {} | {} | {} | {} | {} | {} |\n", name, change,
                 count["comparisons"].get<int>(), count["failed"].get<int>(),
                 count["noise"].get<int>(), count["failed_without_tolerances"].get<int>(),
                 count["significant"].get<int>());
  }
}

void run_cases(const Settings& settings) {
  const ThreadLimit one_thread(1);
  Json results;
  std::string wrong;
  for (const Case& each : all_cases) {
    const bool is_wanted = settings.cases.empty() ||
                           std::ranges::find(settings.cases, each.name) != settings.cases.end();
    if (!is_wanted) continue;
    results[each.name] = measure(each, settings);
    const Json& itself = results[each.name]["itself"];
    for (const char* way : {"failed", "failed_without_tolerances"})
      if (itself[way].get<int>() > allowed(settings.comparisons))
        wrong += fmt::format(" {} ({})", each.name, way);
  }
  if (settings.json) {
    Json ratios;
    for (const auto& [name, changes] : results.items())
      ratios[name]["failed"] = changes["itself"]["failed_without_tolerances"].get<double>() /
                               changes["itself"]["comparisons"].get<double>();
    std::cout << Json{{"ratios", ratios}, {"absolute", results}}.dump(2) << '\n';
  } else {
    print(results);
  }
  if (!wrong.empty()) throw NumericalError("more fail than chance allows:" + wrong);
}

}  // namespace
}  // namespace scarp::bench

int main(int argc, char** argv) {
  scarp::bench::Settings settings;
  const auto declare = [&](CLI::App& app) {
    scarp::bench::add_cases(app, scarp::bench::all_cases, settings.cases);
    app.add_option("--comparisons", settings.comparisons,
                   "Of each case with itself; of changes a tenth");
    app.add_option("--seeds", settings.seeds, "Runs of each group");
    app.add_flag("--json", settings.json, "One object on standard output");
  };
  return scarp::bench::bench_main(argc, argv, "how often verdicts of scarp compare are wrong",
                                  declare, [&] { scarp::bench::run_cases(settings); });
}
