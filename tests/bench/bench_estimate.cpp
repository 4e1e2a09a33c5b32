// What scarp check says that a recipe will take, against what it takes.
//
//   ./dev bench estimate [RECIPE...] [--json] [--threads N]
//
// Without recipes all of configs/. Each is estimated and run once, with its results in a folder
// that is removed. Seconds are wall time: nothing else should run.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/estimate/estimate.h"
#include "apps/run/results.h"
#include "apps/run/run.h"
#include "apps/simulator/symmetry.h"
#include "core/parallel.h"
#include "core/system/temporary_folder.h"
#include "tests/apps/columns.h"
#include "tests/bench/bench_main.h"

namespace scarp::bench {
namespace {

namespace fs = std::filesystem;

struct Settings {
  std::vector<std::string> recipes{};
  int threads = 0;
  bool json = false;
};

/// What was expected, and what was found.
struct Pair {
  double expected = 0;
  double found = 0;

  double ratio() const { return expected / found; }
};

struct Row {
  std::string recipe;
  Pair time_steps{};
  Pair rays{};
  Pair seconds{};
};

Row measure(const fs::path& file) {
  const Recipe recipe = read_recipe(recipe_in(file));
  const CostEstimate expected =
      estimate_cost(on_part(recipe, mirror_planes(recipe)), {}, write_trial_output);
  const TemporaryFolder folder;
  const auto start = std::chrono::steady_clock::now();
  scarp::run(recipe, folder, {});
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  const auto columns = columns_of(folder / "metrics.csv");
  double rays = 0;
  for (const std::string& each : columns.at("rays")) rays += std::stod(each);
  return {.recipe = file.stem().string(),
          .time_steps = {expected.time_steps, static_cast<double>(columns.at("rays").size())},
          .rays = {expected.rays_per_time_step * expected.time_steps, rays},
          .seconds = {expected.seconds, wall.count()}};
}

std::vector<fs::path> all_configs() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(SCARP_SOURCE_DIR "/configs"))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

void run(const Settings& settings) {
  const ThreadLimit limit(settings.threads);
  std::vector<fs::path> files(settings.recipes.begin(), settings.recipes.end());
  if (files.empty()) files = all_configs();
  nlohmann::ordered_json ratios;
  if (!settings.json) {
    fmt::print(
        "Expected and found, {} threads\n\n{:22} {:>6} {:>6} {:>9} {:>9} {:>7} {:>7} {:>6}\n",
        thread_count(), "recipe", "steps", "", "rays", "", "s", "", "ratio");
  }
  for (const fs::path& file : files) {
    const Row row = measure(file);
    ratios[row.recipe] = {{"time_steps", row.time_steps.ratio()}, {"seconds", row.seconds.ratio()}};
    if (row.rays.found > 0) ratios[row.recipe]["rays"] = row.rays.ratio();
    if (settings.json) continue;
    fmt::print("{:22} {:6.0f} {:6.0f} {:9.2g} {:9.2g} {:7.2g} {:7.2g} {:6.2f}\n", row.recipe,
               row.time_steps.expected, row.time_steps.found, row.rays.expected, row.rays.found,
               row.seconds.expected, row.seconds.found, row.seconds.ratio());
    std::fflush(stdout);
  }
  if (settings.json) std::cout << nlohmann::ordered_json{{"ratios", ratios}}.dump(2) << '\n';
}

}  // namespace
}  // namespace scarp::bench

int main(int argc, char** argv) {
  scarp::bench::Settings settings;
  const auto declare = [&](CLI::App& app) {
    app.add_option("recipes", settings.recipes, "Recipes; all of configs/ without any")
        ->check(CLI::ExistingFile);
    app.add_option("--threads", settings.threads, "0: all cores")->check(CLI::NonNegativeNumber);
    app.add_flag("--json", settings.json, "One object on standard output");
  };
  return scarp::bench::bench_main(argc, argv, "what scarp check expects against a run", declare,
                                  [&] { scarp::bench::run(settings); });
}
