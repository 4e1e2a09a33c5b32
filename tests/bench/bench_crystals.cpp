// How exact crystals are by the spacing, wherever edges of masks and surfaces lie between nodes.
//
//   ./dev bench crystals [CASE...] [--places 0 0.2 0.4 0.6 0.8] [--json]
//
// walls:   a slot 800 nm wide in KOH, 200 nm deep, {111} a twentieth as fast as {100}: undercut
//          below the mask, and width half-way down.
// tips:    a square opening 160 nm wide in KOH, until the pyramid is complete: its tip.
// epitaxy: a crystal that grows out of a slot 800 nm wide, 240 nm high above the mask: the {111}
//          facets at half of that height, and the top.
//
// At a place of p spacings the edge of the mask lies p spacings beside a node, one of a slot that
// is shifted, or all four of a square that is wider; and the wafer lies 3 p spacings above nodes,
// without the whole ones. Errors are against closed forms: means of the sizes over the places, with
// the largest one in brackets, in nm and in spacings. The order is that between a spacing and the
// one before. Of tips the finest spacing has the middle place alone.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/simulator/symmetry.h"
#include "core/parallel.h"
#include "levelset/metrology/metrology.h"
#include "tests/apps/final_state.h"
#include "tests/apps/recipe_text.h"
#include "tests/bench/bench_main.h"

namespace scarp::bench {
namespace {

using Json = nlohmann::ordered_json;

struct Settings {
  std::vector<std::string> cases{};
  std::vector<double> places{0, 0.2, 0.4, 0.6, 0.8};
  bool json = false;
};

/// Where edges and surfaces lie. Units: nm.
struct Place {
  double spacing = 0;
  double edge = 0;
  double lift = 0;
};

struct Case {
  std::string name;
  std::vector<double> spacings;
  std::vector<std::string> values;
  /// Errors of the values.
  std::vector<double> (*errors)(const Place& place);
  bool is_slow = false;  ///< the finest spacing has the middle one of the places alone
};

const double sine_111 = std::sqrt(2.0 / 3);
const double cotangent_111 = std::sqrt(0.5);

std::string key(const char* name, double value, const char* unit) {
  return fmt::format("{} = \"{} {}\"\n", name, value, unit);
}

/// A wafer below a mask. opening are lines of the recipe.
std::string masked_wafer(const Place& place, double thickness, const std::string& opening) {
  std::string text = "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n";
  if (place.lift > 0)
    text +=
        "[[geometry]]\nshape = \"layer\"\nmaterial = \"Si\"\n" + key("thickness", place.lift, "nm");
  return text + "[[geometry]]\nshape = \"mask\"\nmaterial = \"SiO2\"\n" +
         key("thickness", thickness, "nm") + opening;
}

constexpr double slot_width = 800;

std::string slot(const Place& place, double thickness) {
  return "[domain]\nmode = \"2d\"\nextent = [\"1600 nm\"]\n" + key("spacing", place.spacing, "nm") +
         masked_wafer(place, thickness,
                      "opening.shape = \"trench\"\n" + key("opening.width", slot_width, "nm") +
                          key("opening.center", place.edge, "nm"));
}

std::vector<double> wall_errors(const Place& place) {
  constexpr double minutes = 0.2;
  constexpr double rate_111 = 50;  // nm/min
  constexpr double depth = 200;
  const Recipe recipe =
      read_text(slot(place, 240) + "[[step]]\nmodel = \"koh_etch\"\n" +
                key("duration", minutes, "min") + key("etch_rate_111", rate_111, "nm/min"));
  MetrologyOptions options;
  for (std::size_t m = 0; m < recipe.materials.size(); ++m)
    if (recipe.materials[m].name == "SiO2") options.masks.push_back(static_cast<MaterialId>(m));
  const OpeningMetrology found = measure(final_state(recipe).layers, options).openings.at(0);
  const double undercut = rate_111 * minutes / sine_111;
  const double width = slot_width + 2 * undercut - depth * cotangent_111;
  return {found.undercut.value() - undercut, found.middle_cd.value() - width};
}

std::vector<double> tip_errors(const Place& place) {
  constexpr double minutes = 0.25;
  constexpr double rate_111 = 7.3;  // nm/min
  const double width = 160 + 2 * place.edge;
  const std::string size = fmt::format("opening.size = [\"{0} nm\", \"{0} nm\"]\n", width);
  const Recipe recipe = read_text(
      "[domain]\nextent = [\"320 nm\", \"320 nm\"]\n" + key("spacing", place.spacing, "nm") +
      masked_wafer(place, 80, "opening.shape = \"rectangle\"\n" + size) +
      "[[step]]\nmodel = \"koh_etch\"\n" + key("duration", minutes, "min") +
      key("etch_rate_111", rate_111, "nm/min"));
  const double lowest = measure(final_state(on_part(recipe, mirror_planes(recipe))).layers).lowest;
  const double half = 0.5 * width + rate_111 * minutes / sine_111;
  return {lowest - (place.lift - half / cotangent_111)};
}

/// Where a line leaves the crystal, as part of its length.
double leaves(const LevelSet& phi, const Vec3d& start, const Vec3d& way) {
  double inner = 0;
  double outer = 1;
  for (int n = 0; n < 40; ++n) {
    const double middle = 0.5 * (inner + outer);
    (phi.distance(start + middle * way) < 0 ? inner : outer) = middle;
  }
  return inner;
}

std::vector<double> epitaxy_errors(const Place& place) {
  constexpr double thickness = 160;
  constexpr double height = 240;
  constexpr double ratio = 0.2;
  const Recipe recipe =
      read_text(slot(place, thickness) + "[[step]]\nmodel = \"epitaxy\"\nmaterial = \"SiGe\"\n" +
                key("growth_rate", 1, "nm/s") + key("duration", thickness + height, "s") +
                fmt::format("ratio_111 = {}\nratio_110 = 0.5\nratio_311 = 0.7\n", ratio));
  const State state = final_state(recipe);
  const LevelSet& phi = state.layers.top();
  const double mask = place.lift + thickness;
  const double top = 2 * height * leaves(phi, {0, 0, mask}, {0, 0, 2 * height}) - height;
  double facets = 0;
  for (const int side : {-1, 1}) {
    const double far = 780;
    const double x = far * leaves(phi, {0, 0, mask + 0.5 * height}, {side * far, 0, 0});
    const double edge = 0.5 * slot_width + side * place.edge;
    const double exact = edge + ratio * height / sine_111 - 0.5 * height * cotangent_111;
    if (std::abs(x - exact) > std::abs(facets)) facets = x - exact;
  }
  return {facets, top};
}

const std::vector<Case> all_cases{
    {"walls", {40, 20, 10, 5}, {"undercut", "width"}, wall_errors},
    {"tips", {40, 20, 10, 5}, {"tip"}, tip_errors, true},
    {"epitaxy", {40, 20, 10, 5}, {"facet", "top"}, epitaxy_errors},
};

struct Sizes {
  double mean = 0;
  double most = 0;
};

Sizes sizes(const std::vector<double>& errors) {
  Sizes found;
  for (const double error : errors) {
    found.mean += std::abs(error) / static_cast<double>(errors.size());
    found.most = std::max(found.most, std::abs(error));
  }
  return found;
}

Json measure_case(const Case& of, const Settings& settings) {
  Json rows = Json::array();
  for (const double spacing : of.spacings) {
    std::vector<std::vector<double>> found(of.values.size());
    std::vector<double> places = settings.places;
    if (of.is_slow && spacing == of.spacings.back()) places = {places[places.size() / 2]};
    for (const double place : places) {
      const double lift = 3 * place - std::floor(3 * place + 1e-9);
      const std::vector<double> errors =
          of.errors({.spacing = spacing, .edge = place * spacing, .lift = lift * spacing});
      for (std::size_t n = 0; n < errors.size(); ++n) found[n].push_back(errors[n]);
    }
    Json row{{"spacing", spacing}};
    for (std::size_t n = 0; n < of.values.size(); ++n) {
      const Sizes of_errors = sizes(found[n]);
      row[of.values[n]] = {
          {"mean_nm", of_errors.mean}, {"most_nm", of_errors.most}, {"all", found[n]}};
      if (!rows.empty()) {
        const double before = rows.back()[of.values[n]]["mean_nm"];
        row[of.values[n]]["order"] = std::log2(before / of_errors.mean);
      }
    }
    rows.push_back(row);
  }
  return rows;
}

void print(const Case& of, const Json& rows) {
  fmt::print("| {} | spacing | error, nm | error, spacings | order |\n", of.name);
  fmt::print("| --- | --- | --- | --- | --- |\n");
  for (const std::string& name : of.values) {
    for (const Json& row : rows) {
      const double h = row["spacing"];
      const Json& value = row[name];
      const double mean = value["mean_nm"];
      const double most = value["most_nm"];
      const std::string order =
          value.contains("order") ? fmt::format("{:.1f}", value["order"].get<double>()) : "";
      fmt::print("| {} | {:g} nm | {:.2f} ({:.2f}) | {:.3f} ({:.3f}) | {} |\n", name, h, mean, most,
                 mean / h, most / h, order);
    }
  }
  fmt::print("\n");
}

void run_cases(const Settings& settings) {
  const ThreadLimit one_thread(1);
  Json results{{"ratios", Json::object()}, {"absolute", Json::object()}};
  for (const Case& each : all_cases) {
    if (!settings.cases.empty() &&
        std::ranges::find(settings.cases, each.name) == settings.cases.end())
      continue;
    const Json& rows = results["absolute"][each.name] = measure_case(each, settings);
    for (const Json& row : rows) {
      const double h = row["spacing"];
      for (const std::string& name : each.values)
        results["ratios"][fmt::format("{}_{}_{:g}nm_spacings", each.name, name, h)] =
            row[name]["mean_nm"].get<double>() / h;
    }
    if (!settings.json) print(each, rows);
  }
  if (settings.json) std::cout << results.dump(2) << '\n';
}

}  // namespace
}  // namespace scarp::bench

int main(int argc, char** argv) {
  scarp::bench::Settings settings;
  const auto declare = [&](CLI::App& app) {
    scarp::bench::add_cases(app, scarp::bench::all_cases, settings.cases);
    app.add_option("--places", settings.places, "Of edges between two nodes, in spacings");
    app.add_flag("--json", settings.json, "One object on standard output");
  };
  return scarp::bench::bench_main(argc, argv, "how exact crystals are", declare,
                                  [&] { scarp::bench::run_cases(settings); });
}
