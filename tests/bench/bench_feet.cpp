// How exact ends, lowest points and micro-trenches are at feet of walls, by spacing, scheme and the
// place of the walls between nodes.
//
//   ./dev bench feet [CASE...] [--spacings 20 10 5] [--places 0 0.25 0.5 0.75]
//                    [--processes NAME...] [--across 6 10 20 40] [--reference 40 80]
//                    [--slopes 0 15 30 45 60] [--kinds along aslant up down] [--json]
//
// fin:         when a fin 200 nm wide is gone, against half its width by the rate; in spacings.
// directional: a trench 200 nm wide through 200 nm of oxide, which has 200 s more in silicon that
// is
//              etched a hundred times more slowly: what is left of the oxide at the feet, in
//              squares of the spacing, and how much too small the volume taken from the silicon is.
// ions:        lowest point and micro-trench under ions that walls reflect, in nm.
// errors:      how often errors of lowest points and micro-trenches are within those that metrology
//              states (foot_errors.h), by spacings across an opening.
// walls:       how rough walls below a mask are that stands on a slope (slope_walls.h).
//
// Of several places the table has the mean, and the largest distance from it. Ratios are values in
// spacings and cells, those of ions by that of the finest spacing, and parts that are within.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/run/run.h"
#include "apps/simulator/recipe.h"
#include "apps/simulator/simulator.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/system/temporary_folder.h"
#include "levelset/metrology/cross_section.h"
#include "tests/bench/bench_main.h"
#include "tests/bench/foot_errors.h"
#include "tests/bench/slope_walls.h"

namespace scarp::bench {
namespace {

namespace fs = std::filesystem;

using Json = nlohmann::ordered_json;

struct Settings {
  std::vector<std::string> cases{};
  std::vector<double> spacings{20, 10, 5};
  std::vector<double> places{0, 0.25, 0.5, 0.75};
  FootErrorSettings errors{};
  SlopeWallSettings walls{};
  bool json = false;
};

struct Value {
  std::string name;
  std::string ratio;  ///< its name as one
  std::function<double(const Json& summary, double spacing)> of;
  bool by_finest = false;  ///< the ratio is that to the value of the finest spacing
};

struct Case {
  std::string name;
  std::string recipe;
  std::string center;  ///< key of the recipe
  std::vector<std::string> schemes;
  std::vector<Value> values;
};

/// Of the opening at the end of a run.
double of_opening(const Json& summary, const char* name) {
  return summary["metrology"]["openings"][0][name].get<double>();
}

/// What a run took from a material per length along the trench, in nm^2. Shapes lie a thousandth of
/// a spacing beside nodes.
double area_taken(const Json& summary, const char* material, double spacing) {
  const auto volume = [&](const char* when) {
    const Json& volumes = summary[when];
    return volumes.contains(material) ? volumes[material].get<double>() : 0;
  };
  return (volume("volumes_before") - volume("volumes_after")) / spacing;
}

const std::vector<Case> all_cases{
    {"fin",
     "end_fin.toml",
     "geometry[1].center",
     {"first_order", "eno2", "weno5"},
     {{"late / h", "late",
       [](const Json& summary, double spacing) {
         return (summary["steps"][0]["reached_s"].get<double>() - 100) / spacing;
       }}}},
    {"directional",
     "foot_directional.toml",
     "geometry[2].opening.center",
     {"first_order", "eno2", "weno5"},
     {{"oxide left / h^2", "oxide_left",
       [](const Json& summary, double spacing) {
         return (200 * 200 - area_taken(summary, "SiO2", spacing)) / (spacing * spacing);
       }},
      {"silicon taken, error in %", "silicon_error_percent",
       [](const Json& summary, double spacing) {
         return 100 * (area_taken(summary, "Si", spacing) / (200 * 2) - 1);
       }}}},
    {"ions",
     "foot_ions.toml",
     "geometry[1].opening.center",
     {"eno2"},
     {{"lowest, nm", "lowest",
       [](const Json& summary, double) { return summary["metrology"]["lowest_nm"].get<double>(); },
       true},
      {"micro-trench, nm", "micro_trench",
       [](const Json& summary, double) { return of_opening(summary, "micro_trenching_nm"); },
       true}}},
};

/// Cases that are measured elsewhere.
const std::string errors_name = "errors";
const std::string walls_name = "walls";

Json summary_of(const Case& of, const std::string& scheme, double spacing, double place) {
  const TemporaryFolder folder;
  const Recipe recipe =
      read_recipe(recipe_in(fs::path(SCARP_SOURCE_DIR) / "tests/bench/runs" / of.recipe,
                            {fmt::format("domain.spacing=\"{} nm\"", spacing),
                             fmt::format("advection.scheme=\"{}\"", scheme),
                             fmt::format("{}=\"{} nm\"", of.center, place * spacing)}));
  run(recipe, folder / "run", {});
  std::ifstream file(folder / "run" / "summary.json");
  Json summary = Json::parse(file);
  summary["volumes_after"] = summary["metrology"]["volumes_nm3"];
  const Layers start = start_state(recipe.domain.frame, recipe.start).layers;
  const std::vector<double> volumes = material_volumes(start);
  for (std::size_t n = 0; n < volumes.size(); ++n)
    summary["volumes_before"][recipe.materials[start.stack[n].material].name] = volumes[n];
  return summary;
}

Json measure(const Case& of, const Settings& settings) {
  Json rows = Json::array();
  for (const std::string& scheme : of.schemes) {
    for (const double spacing : settings.spacings) {
      std::vector<std::vector<double>> found(of.values.size());
      for (const double place : settings.places) {
        const Json summary = summary_of(of, scheme, spacing, place);
        for (std::size_t n = 0; n < of.values.size(); ++n)
          found[n].push_back(of.values[n].of(summary, spacing));
      }
      const bool is_finest = spacing == std::ranges::min(settings.spacings);
      Json row{{"scheme", scheme}, {"spacing", spacing}, {"finest", is_finest}};
      for (std::size_t n = 0; n < of.values.size(); ++n) {
        double mean = 0;
        for (const double each : found[n]) mean += each / static_cast<double>(found[n].size());
        double most = 0;
        for (const double each : found[n]) most = std::max(most, std::abs(each - mean));
        row[of.values[n].name] = {{"mean", mean}, {"spread", most}, {"all", found[n]}};
      }
      rows.push_back(row);
    }
  }
  return rows;
}

void print(const Case& of, const Json& rows) {
  std::string head = "| case | scheme | spacing |";
  std::string rule = "| --- | --- | --- |";
  for (const Value& value : of.values) {
    head += fmt::format(" {} |", value.name);
    rule += " --- |";
  }
  fmt::print("{}\n{}\n", head, rule);
  for (const Json& row : rows) {
    fmt::print("| {} | {} | {:g} nm |", of.name, row["scheme"].get<std::string>(),
               row["spacing"].get<double>());
    for (const Value& value : of.values) {
      const Json& found = row[value.name];
      fmt::print(" {:.3f} ({:.3f}) |", found["mean"].get<double>(), found["spread"].get<double>());
    }
    fmt::print("\n");
  }
  fmt::print("\n");
}

void add_ratios(const Case& of, const Json& rows, Json& ratios) {
  for (const Json& row : rows) {
    const Json& last = *std::ranges::find_if(rows, [&](const Json& other) {
      return other["scheme"] == row["scheme"] && other["finest"];
    });
    for (const Value& value : of.values) {
      const double mean = row[value.name]["mean"];
      const double unit = value.by_finest ? last[value.name]["mean"].get<double>() : 1;
      ratios[fmt::format("{}_{}_{:g}nm_{}", of.name, row["scheme"].get<std::string>(),
                         row["spacing"].get<double>(), value.ratio)] = mean / unit;
    }
  }
}

bool is_wanted(const Settings& settings, const std::string& name) {
  return settings.cases.empty() || std::ranges::find(settings.cases, name) != settings.cases.end();
}

void run_cases(const Settings& settings) {
  const ThreadLimit one_thread(1);
  Json results{{"ratios", Json::object()}, {"absolute", Json::object()}};
  for (const Case& each : all_cases) {
    if (!is_wanted(settings, each.name)) continue;
    const Json& rows = results["absolute"][each.name] = measure(each, settings);
    add_ratios(each, rows, results["ratios"]);
    if (!settings.json) print(each, rows);
  }
  if (is_wanted(settings, errors_name)) {
    const Json& found = results["absolute"][errors_name] = foot_errors(settings.errors);
    for (const auto& [name, part] : found["within"].items())
      results["ratios"][fmt::format("{}_{}_within", errors_name, name)] = part;
    if (!settings.json) print_foot_errors(found);
  }
  if (is_wanted(settings, walls_name)) {
    SlopeWallSettings walls = settings.walls;
    walls.spacings = settings.spacings;
    walls.places = settings.places;
    const Json& found = results["absolute"][walls_name] = slope_walls(walls);
    if (!settings.json) print_slope_walls(found);
  }
  if (settings.json) std::cout << results.dump(2) << '\n';
}

}  // namespace
}  // namespace scarp::bench

int main(int argc, char** argv) {
  scarp::bench::Settings settings;
  const auto declare = [&](CLI::App& app) {
    std::vector<std::string> names{scarp::bench::errors_name, scarp::bench::walls_name};
    for (const auto& each : scarp::bench::all_cases) names.push_back(each.name);
    app.add_option("cases", settings.cases, "Cases; all without any")->check(CLI::IsMember(names));
    app.add_option("--spacings", settings.spacings, "In nm");
    app.add_option("--places", settings.places, "Of the middle between two nodes, in spacings");
    app.add_option("--processes", settings.errors.processes, "Of errors; all without any")
        ->check(CLI::IsMember(scarp::bench::foot_error_processes()));
    app.add_option("--across", settings.errors.across, "Of errors: spacings across an opening");
    app.add_option("--reference", settings.errors.reference,
                   "Of errors: two of them, extrapolated from, the coarser one first")
        ->expected(2);
    app.add_option("--slopes", settings.walls.slopes, "Of walls: of the mask's underside, degrees");
    app.add_option("--kinds", settings.walls.kinds, "Of walls; all without any")
        ->check(CLI::IsMember(scarp::bench::slope_wall_kinds()));
    app.add_flag("--json", settings.json, "One object on standard output");
  };
  return scarp::bench::bench_main(argc, argv, "how exact ends and feet of walls are", declare,
                                  [&] { scarp::bench::run_cases(settings); });
}
