#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/report/comparison.h"
#include "apps/report/comparison_case.h"
#include "apps/report/comparison_files.h"
#include "apps/report/report.h"
#include "apps/run/own_files.h"
#include "apps/run/restart.h"
#include "apps/run/tell.h"
#include "apps/scarp/attended_run.h"
#include "apps/scarp/commands.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/quantity.h"
#include "core/system/atomic_file.h"
#include "core/system/folder_lock.h"
#include "core/system/read_file.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

/// What is compared: its name and how it differs from the recipe.
struct Variant {
  std::string name;
  std::vector<std::string> overrides;
};

constexpr const char* full_mesh = "simplify.enabled=false";

/// What a recipe that leaves it open whether to simplify stands for is compared as that.
const char* simplified_mesh(const Simplification& simplification) {
  return simplification.where_it_pays ? "simplify.enabled=\"auto\"" : "simplify.enabled=true";
}

/// Of a slice of what has two dimensions. Spacings; the answer does not depend on it.
constexpr double slice_length = 4;

/// The recipe in one of the modes.
Variant in_mode(const std::string& mode, const Frame& frame) {
  Variant variant{.name = mode, .overrides = {}};
  if (mode == mode_name(frame)) return variant;
  const auto nm = [](double length) { return fmt::format("\"{} nm\"", format_number(length)); };
  const std::string extent = nm(frame.cells[0] * frame.spacing);
  const char* sides = frame.boundary[0] == Boundary::periodic ? "\"periodic\"" : "\"reflective\"";
  variant.overrides.push_back(fmt::format("domain.mode=\"{}\"", mode));
  if (mode == "3d") {
    const std::string along = frame.is_around_axis() ? extent : nm(slice_length * frame.spacing);
    variant.overrides.push_back(fmt::format("domain.extent=[{}, {}]", extent, along));
    variant.overrides.push_back(fmt::format("domain.boundary=[{}, \"reflective\"]", sides));
  } else {
    variant.overrides.push_back(fmt::format("domain.extent=[{}]", extent));
    variant.overrides.push_back(fmt::format("domain.boundary=[{}]", sides));
    variant.overrides.emplace_back(full_mesh);
  }
  return variant;
}

/// The first is what the others are compared with.
std::vector<Variant> variants_of(const CompareArguments& arguments, const Frame& frame,
                                 const Simplification& simplification) {
  if (!arguments.modes.empty()) {
    const std::size_t comma = arguments.modes.find(',');
    return {in_mode(arguments.modes.substr(0, comma), frame),
            in_mode(arguments.modes.substr(comma + 1), frame)};
  }
  std::vector<Variant> variants{{.name = "full", .overrides = {full_mesh}}};
  for (const std::string& method : arguments.methods)
    variants.push_back({.name = method,
                        .overrides = {simplified_mesh(simplification),
                                      fmt::format("simplify.method=\"{}\"", method)}});
  if (arguments.methods.empty())
    variants.push_back({.name = "simplified", .overrides = {simplified_mesh(simplification)}});
  return variants;
}

/// Makes the runs of a comparison, as far as they are not there yet.
class Runner {
 public:
  Runner(const CompareArguments& arguments, const CommonOptions& common)
      : arguments_(arguments), common_(common), folder_(arguments.result_folder()) {}

  /// Throws: InputError where the recipe is not one with the changes of the variant.
  Recipe recipe_of(const Variant& variant, std::uint64_t seed) const {
    std::vector<std::string> overrides = arguments_.set;
    overrides.insert(overrides.end(), variant.overrides.begin(), variant.overrides.end());
    overrides.push_back(fmt::format("flux.seed={}", seed));
    return read_runnable(arguments_.recipe, overrides);
  }

  /// The runs of a variant, whose seeds are every second number from the given one on; nothing when
  /// it was interrupted.
  std::optional<RunGroup> run(const Variant& variant, std::uint64_t first_seed) const {
    RunGroup group{.name = variant.name, .runs = {}};
    for (int n = 0; n < arguments_.seeds; ++n) {
      const std::uint64_t seed = first_seed + 2 * static_cast<std::uint64_t>(n);
      const Recipe recipe = recipe_of(variant, seed);
      const fs::path where = folder_ / fmt::format("{}_seed_{}", variant.name, seed);
      if (!common_.quiet) tell(fmt::format("{}, seed {}: {}\n", variant.name, seed, shown(where)));
      if (attended_run(recipe, where,
                       {.resume = holds(where, recipe.resolved), .quiet = common_.quiet}) ==
          RunEnd::interrupted) {
        return std::nullopt;
      }
      group.runs.push_back(read_run(where));
    }
    return group;
  }

 private:
  /// What another recipe left there is replaced.
  static bool holds(const fs::path& where, const std::string& recipe) {
    const fs::path before = where / "recipe.toml";
    return fs::exists(before) && read_file(before) == recipe;
  }

  const CompareArguments& arguments_;
  const CommonOptions& common_;
  fs::path folder_;
};

bool holds_comparison(const fs::path& folder) {
  const fs::path file = folder / "compare.json";
  if (!fs::exists(file)) return false;
  const auto json = nlohmann::json::parse(read_file(file), nullptr, /*allow_exceptions=*/false);
  return json.is_object() && json.contains("passed");
}

bool is_comparison(const std::string& name) {
  return name == "compare.json" || name == report_file;
}

/// The runs of a group, which are all there.
std::vector<fs::path> folders_of(const RunGroup& group) {
  std::vector<fs::path> folders;
  for (const RunRecord& run : group.runs) folders.push_back(run.where);
  return folders;
}

std::vector<Comparison> compare_all(std::span<const ComparisonCase> cases) {
  std::vector<Comparison> comparisons;
  for (const ComparisonCase& each : cases) comparisons.push_back(compare(each));
  return comparisons;
}

/// compare.json and report.html; what was compared first stands at the top.
///
/// Shape: a comparison for each case.
ExitCode write_results(const fs::path& folder, std::span<const ComparisonCase> cases,
                       std::span<const Comparison> comparisons, const std::string& title,
                       const CommonOptions& common) {
  nlohmann::ordered_json json = comparison_json(comparisons.front());
  bool passed = true;
  for (const Comparison& each : comparisons) {
    passed = passed && each.passed();
    for (const std::string& warning : each.warnings) tell("warning: " + warning + '\n');
    if (comparisons.size() > 1) json["methods"][each.second] = comparison_json(each);
  }
  json["passed"] = passed;
  json["title"] = title;
  for (const ComparisonCase& each : cases) json["cases"].push_back(case_json(each, folder));
  const std::string text = json.dump(2) + '\n';
  write_file(folder / "compare.json", text);
  write_file(folder / report_file, comparison_page(cases, comparisons, title));
  if (common.json) {
    std::cout << text;
  } else {
    for (const Comparison& each : comparisons) fmt::print("{}\n", comparison_text(each));
    fmt::print("{}\n", shown(folder / report_file));
  }
  return passed ? done : check_failed;
}

ExitCode compare_variants(const CompareArguments& arguments, const CommonOptions& common) {
  const Recipe recipe = read_runnable(arguments.recipe, arguments.set);
  if (recipe.domain.frame.is_section() && arguments.modes.empty()) {
    throw InputError(
        fmt::format("{}: in two dimensions the mesh is not simplified, so there is nothing to "
                    "compare; use --modes 3d,{} to compare it with three dimensions",
                    shown(arguments.recipe), mode_name(recipe.domain.frame)));
  }
  const fs::path folder = arguments.result_folder();
  const Runner runner(arguments, common);
  const std::vector<Variant> variants =
      variants_of(arguments, recipe.domain.frame, recipe.simplification);
  const std::uint64_t seed = recipe.flux.options.seed;
  // What cannot be run is refused before anything runs.
  for (const Variant& variant : variants) runner.recipe_of(variant, seed);
  // Of the whole comparison: each run holds its own folder, but only while it lasts.
  const FolderLock lock(folder);
  require_own(folder, "a comparison", holds_comparison(folder), is_comparison);
  std::vector<RunGroup> groups;
  for (const Variant& variant : variants) {
    const auto group = runner.run(variant, groups.empty() ? seed : seed + 1);
    if (!group) {
      tell("interrupted; run the same command again to continue\n");
      return interrupted;
    }
    groups.push_back(*group);
  }
  std::vector<ComparisonCase> cases;
  for (const RunGroup& group : std::span(groups).subspan(1)) {
    cases.push_back({.first = groups.front().name,
                     .second = group.name,
                     .first_runs = folders_of(groups.front()),
                     .second_runs = folders_of(group),
                     .tolerances = arguments.tolerances});
  }
  return write_results(folder, cases, compare_all(cases), recipe.title, common);
}

/// Runs or states, between commas unless that is the name of one.
std::vector<fs::path> runs_of(const std::string& text) {
  if (fs::exists(text)) return {text};
  std::vector<fs::path> runs;
  std::istringstream names(text);
  for (std::string name; std::getline(names, name, ',');) runs.emplace_back(name);
  return runs;
}

ExitCode compare_given(const CompareArguments& arguments, const CommonOptions& common) {
  ComparisonCase wanted{.first = shown(arguments.recipe),
                        .second = shown(arguments.with),
                        .first_runs = runs_of(arguments.recipe),
                        .tolerances = arguments.tolerances};
  if (fs::path(arguments.with).extension() == ".csv") {
    if (wanted.first_runs.size() > 1) {
      throw InputError(
          fmt::format("{}: a contour is compared with one run; name one", shown(arguments.recipe)));
    }
    wanted.contour = arguments.with;
    wanted.line = arguments.line;
  } else {
    wanted.second_runs = runs_of(arguments.with);
  }
  const fs::path folder = arguments.output.empty() ? "results/compare" : arguments.output;
  // What cannot be compared leaves no folder.
  const std::vector<Comparison> comparisons = compare_all(std::span(&wanted, 1));
  const FolderLock lock(folder);
  require_own(folder, "a comparison", holds_comparison(folder), is_comparison);
  return write_results(folder, std::span(&wanted, 1), comparisons,
                       fmt::format("{} and {}", wanted.first, wanted.second), common);
}

}  // namespace

ExitCode execute(const CompareArguments& arguments, const CommonOptions& common) {
  if (!arguments.with.empty()) {
    if (!arguments.modes.empty() || !arguments.methods.empty()) {
      throw InputError(fmt::format(
          "{}: --{} compares the runs of a recipe; leave out {}", shown(arguments.recipe),
          arguments.modes.empty() ? "methods" : "modes", shown(arguments.with)));
    }
    return compare_given(arguments, common);
  }
  if (fs::is_directory(arguments.recipe) || fs::path(arguments.recipe).extension() == ".vdb") {
    throw InputError(
        fmt::format("{}: name what it is compared with: another run or state, or a "
                    "contour (.csv)",
                    shown(arguments.recipe)));
  }
  return compare_variants(arguments, common);
}

}  // namespace scarp
