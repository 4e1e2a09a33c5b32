#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/report/baseline.h"
#include "apps/report/comparison_files.h"
#include "apps/report/report.h"
#include "apps/run/own_files.h"
#include "apps/run/restart.h"
#include "apps/scarp/attended_run.h"
#include "apps/scarp/commands.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/system/atomic_file.h"
#include "core/system/folder_lock.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

std::vector<fs::path> recipes_in(const fs::path& suite) {
  std::vector<fs::path> recipes;
  if (fs::is_directory(suite)) {
    for (const auto& entry : fs::directory_iterator(suite))
      if (entry.path().extension() == ".toml") recipes.push_back(entry.path());
  }
  if (recipes.empty())
    throw InputError(fmt::format("{}: is no folder with recipes (.toml)", shown(suite)));
  std::ranges::sort(recipes);
  return recipes;
}

fs::path baseline_file(const fs::path& recipe) {
  return recipe.parent_path() / (recipe.stem().string() + ".baseline.json");
}

fs::path result_folder(const BaselineArguments& arguments) {
  if (!arguments.output.empty()) return arguments.output;
  const fs::path suite = fs::absolute(fs::path(arguments.suite) / "").parent_path();
  return fs::path("results") / suite.filename();
}

constexpr const char* result_file = "baseline.json";

bool is_result_of_check(const std::string& name) {
  return name == result_file || name == report_file;
}

class Suite {
 public:
  Suite(const BaselineArguments& arguments, const CommonOptions& common)
      : arguments_(arguments),
        common_(common),
        recipes_(recipes_in(arguments.suite)),
        folder_(result_folder(arguments)) {}

  ExitCode create() const {
    for (const fs::path& recipe : recipes_) {
      std::vector<RunRecord> seeds;
      for (int n = 0; n < arguments_.seeds; ++n) {
        const auto done_run = run(recipe, n);
        if (!done_run) return interrupted;
        seeds.push_back(*done_run);
      }
      write_baseline(baseline_file(recipe), make_baseline(seeds));
      if (!common_.quiet) fmt::print("{}\n", shown(baseline_file(recipe)));
    }
    return done;
  }

  ExitCode check_all() const {
    require_own(folder_, "a check of baselines",
                begins_with(folder_ / result_file, "{\n  \"passed\": "), is_result_of_check);
    std::vector<Comparison> comparisons;
    for (const fs::path& recipe : recipes_) {
      if (!fs::exists(baseline_file(recipe))) {
        throw InputError(fmt::format("{}: is missing; make it with scarp baseline create",
                                     shown(baseline_file(recipe))));
      }
      const Baseline baseline = read_baseline(baseline_file(recipe));
      const auto now = run(recipe, 0);
      if (!now) return interrupted;
      comparisons.push_back(check(baseline, *now));
      comparisons.back().second = shown(recipe.stem());
    }
    return report(comparisons);
  }

 private:
  std::optional<RunRecord> run(const fs::path& file, int seed) const {
    std::vector<std::string> set = arguments_.set;
    const std::uint64_t first = read_runnable(file, set).flux.options.seed;
    set.push_back(fmt::format("flux.seed={}", first + static_cast<std::uint64_t>(seed)));
    const Recipe recipe = read_runnable(file, set);
    const fs::path where = folder_ / file.stem() / fmt::format("seed_{}", recipe.flux.options.seed);
    // Notes of a run are of no use here; its warnings are.
    if (attended_run(recipe, where, {.quiet = true}) == RunEnd::interrupted) return std::nullopt;
    return read_run(where);
  }

  ExitCode report(std::span<const Comparison> comparisons) const {
    const auto passed = [](const Comparison& each) { return each.passed(); };
    const bool all_passed = std::ranges::all_of(comparisons, passed);
    const fs::path page = folder_ / report_file;
    nlohmann::ordered_json json{{"passed", all_passed}};
    for (const Comparison& each : comparisons) {
      json["recipes"][each.second] = {{"passed", each.passed()}, {"moved", each.moved()}};
      if (common_.json) continue;
      if (!each.passed() || !common_.quiet)
        fmt::print("{:32} {}\n", each.second, each.passed() ? "as it was" : "moved");
      for (const std::string& line : each.moved()) fmt::print("  {}\n", line);
    }
    // The mark of a check comes first.
    write_file(folder_ / result_file, json.dump(2) + '\n');
    std::vector<PageEntry> entries;
    for (const Comparison& each : comparisons) entries.push_back({.comparison = each});
    write_file(page, comparison_page(entries,
                                     {.title = "Baselines of " + arguments_.suite, .recipe = ""}));
    if (common_.json) std::cout << json.dump(2) << '\n';
    if (!common_.json && (!all_passed || !common_.quiet)) fmt::print("{}\n", shown(page));
    return all_passed ? done : check_failed;
  }

  const BaselineArguments& arguments_;
  const CommonOptions& common_;
  std::vector<fs::path> recipes_;
  fs::path folder_;
  FolderLock lock_{folder_};
};

}  // namespace

ExitCode execute(const BaselineArguments& arguments, const CommonOptions& common) {
  const Suite suite(arguments, common);
  return arguments.creates ? suite.create() : suite.check_all();
}

}  // namespace scarp
