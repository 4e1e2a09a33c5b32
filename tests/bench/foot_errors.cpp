#include "tests/bench/foot_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "apps/run/run.h"
#include "apps/simulator/recipe.h"
#include "core/system/temporary_folder.h"

namespace scarp::bench {
namespace {

namespace fs = std::filesystem;

using Json = nlohmann::ordered_json;

constexpr double width = 240;  // of openings, nm

/// A recipe whose last shape is a mask with an opening.
struct Process {
  std::string name;
  std::string recipe;
  std::string mask;  ///< key of the shape in the recipe
  std::vector<std::string> overrides;
};

const std::string ions = "tests/bench/runs/foot_ions.toml";
const std::string neutrals = "tests/regression/etch_ions.toml";
const std::string plasma = "tests/regression/etch_sf6_o2.toml";
const std::string beam = "tests/bench/runs/foot_directional.toml";

const std::vector<Process> processes{
    {"ions, power 100", ions, "geometry[1]", {"step[0].ion[0].source_power=100"}},
    {"ions, power 300", ions, "geometry[1]", {}},
    {"ions, power 1000", ions, "geometry[1]", {"step[0].ion[0].source_power=1000"}},
    {"ions, cosine", ions, "geometry[1]", {"step[0].ion[0].yield[0].angular=\"cosine\""}},
    {"ions, sputter", ions, "geometry[1]", {"step[0].ion[0].yield[0].angular=\"sputter\""}},
    {"ions and neutrals", neutrals, "geometry[1]", {}},
    {"sf6_o2",
     plasma,
     "geometry[1]",
     {"geometry[1].thickness=\"120 nm\"", "step[0].duration=\"10 s\""}},
    {"beam, isotropic part",
     beam,
     "geometry[2]",
     {"step[0].duration=\"150 s\"",
      "step[0].isotropic_etch_rate={ SiO2 = \"0.1 nm/s\", default = \"0 nm/s\" }"}}};

enum class Kind { trench, hole };

struct FootRun {
  double across = 0;
  double place = 0;
  Json openings;
  double lowest = 0;
  double lowest_error = 0;
  double micro_trench = 0;
  double micro_trench_error = 0;
};

std::vector<std::string> overrides_of(const Process& process, Kind kind, double across,
                                      double place) {
  const double spacing = width / across;
  std::vector<std::string> all = process.overrides;
  all.push_back(fmt::format("domain.spacing=\"{} nm\"", spacing));
  all.push_back(fmt::format("domain.extent=[\"{} nm\"]", 2 * width));
  all.push_back("flux.target_error=0.01");
  if (kind == Kind::trench) {
    all.push_back("domain.mode=\"2d\"");
    all.push_back("domain.boundary=[\"periodic\"]");
    all.push_back(
        fmt::format("{}.opening={{ shape = \"trench\", width = \"{} nm\", center = \"{} nm\" }}",
                    process.mask, width, place * spacing));
  } else {
    all.push_back("domain.mode=\"axisymmetric\"");
    all.push_back("domain.boundary=[\"reflective\"]");
    all.push_back(fmt::format("{}.opening={{ shape = \"hole\", radius = \"{} nm\" }}", process.mask,
                              width / 2));
  }
  return all;
}

FootRun run_of(const Process& process, Kind kind, double across, double place) {
  const TemporaryFolder folder;
  const Recipe recipe = read_recipe(recipe_in(fs::path(SCARP_SOURCE_DIR) / process.recipe,
                                              overrides_of(process, kind, across, place)));
  run(recipe, folder / "run", {});
  std::ifstream file(folder / "run" / "summary.json");
  const Json metrology = Json::parse(file)["metrology"];
  const Json& opening = metrology["openings"][0];
  const auto number = [](const Json& json, const char* name, double otherwise = 0) {
    return json[name].is_number() ? json[name].get<double>() : otherwise;
  };
  // Where no error is stated lengths have that of all metrology.
  const double usual = 0.1 * recipe.domain.frame.spacing;
  return {.across = across,
          .place = place,
          .openings = metrology["openings"],
          .lowest = number(metrology, "lowest_nm"),
          .lowest_error = number(metrology, "lowest_error_nm", usual),
          .micro_trench = number(opening, "micro_trenching_nm"),
          .micro_trench_error = number(opening, "micro_trenching_error_nm", usual)};
}

/// Of first order in the spacing.
double extrapolated(const std::vector<FootRun>& finer, double FootRun::*value) {
  const FootRun& coarse = finer.front();
  const FootRun& fine = finer.back();
  const double part = coarse.across / (fine.across - coarse.across);
  return fine.*value + part * (fine.*value - coarse.*value);
}

/// A value at one spacing: its mean over places, its largest error and the least that is stated.
struct Row {
  double mean = 0;
  double error = 0;
  double stated = 1e300;
  int within = 0;
};

Row row_of(const std::vector<FootRun>& runs, double reference, double FootRun::*value,
           double FootRun::*stated) {
  Row row;
  for (const FootRun& each : runs) {
    const double error = std::abs(each.*value - reference);
    row.mean += each.*value / static_cast<double>(runs.size());
    row.error = std::max(row.error, error);
    row.stated = std::min(row.stated, each.*stated);
    if (error <= each.*stated) ++row.within;
  }
  return row;
}

Json json_of(const Row& row, double reference) {
  return {{"mean", row.mean},
          {"extrapolated", reference},
          {"error", row.error},
          {"stated", row.stated}};
}

class FootErrors {
 public:
  explicit FootErrors(const FootErrorSettings& settings) : settings_(settings) {}

  void add(const Process& process, Kind kind) {
    std::vector<FootRun> finer;
    for (const double across : settings_.reference)
      finer.push_back(run_of(process, kind, across, 0));
    const double lowest = extrapolated(finer, &FootRun::lowest);
    const double micro_trench = extrapolated(finer, &FootRun::micro_trench);
    const std::string opening = kind == Kind::trench ? "trench" : "hole";
    for (const double across : settings_.across) {
      std::vector<FootRun> runs;
      for (const double place : places_of(kind)) {
        const auto known =
            std::ranges::find_if(finer, [&](const FootRun& each) { return each.across == across; });
        const bool is_known = place == 0 && known != finer.end();
        runs.push_back(is_known ? *known : run_of(process, kind, across, place));
        runs_.push_back({{"process", process.name},
                         {"opening", opening},
                         {"across", across},
                         {"place", place},
                         {"lowest_nm", runs.back().lowest},
                         {"openings", runs.back().openings}});
      }
      const Row low = row_of(runs, lowest, &FootRun::lowest, &FootRun::lowest_error);
      const Row deep =
          row_of(runs, micro_trench, &FootRun::micro_trench, &FootRun::micro_trench_error);
      rows_.push_back({{"process", process.name},
                       {"opening", opening},
                       {"across", across},
                       {"lowest_nm", json_of(low, lowest)},
                       {"micro_trench_nm", json_of(deep, micro_trench)}});
      lowest_within_ += low.within;
      micro_trench_within_ += deep.within;
    }
  }

  Json found() const {
    const auto count = static_cast<double>(runs_.size());
    return {{"rows", rows_},
            {"runs", runs_},
            {"within",
             {{"lowest", lowest_within_ / count}, {"micro_trench", micro_trench_within_ / count}}}};
  }

 private:
  /// The axis of a hole is on nodes.
  std::vector<double> places_of(Kind kind) const {
    return kind == Kind::trench ? settings_.places : std::vector<double>{0};
  }

  const FootErrorSettings& settings_;
  Json rows_ = Json::array();
  Json runs_ = Json::array();
  int lowest_within_ = 0;
  int micro_trench_within_ = 0;
};

}  // namespace

std::vector<std::string> foot_error_processes() {
  std::vector<std::string> names;
  for (const Process& each : processes) names.push_back(each.name);
  return names;
}

Json foot_errors(const FootErrorSettings& settings) {
  FootErrors errors(settings);
  for (const Process& process : processes) {
    const bool is_wanted =
        settings.processes.empty() ||
        std::ranges::find(settings.processes, process.name) != settings.processes.end();
    if (!is_wanted) continue;
    for (const Kind kind : {Kind::trench, Kind::hole}) errors.add(process, kind);
  }
  return errors.found();
}

void print_foot_errors(const Json& found) {
  fmt::print(
      "| process | opening | spacings across | lowest point, nm | error | stated | micro-trench, "
      "nm | error | stated |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const Json& row : found["rows"]) {
    fmt::print("| {} | {} | {:g} |", row["process"].get<std::string>(),
               row["opening"].get<std::string>(), row["across"].get<double>());
    for (const char* name : {"lowest_nm", "micro_trench_nm"})
      for (const char* key : {"mean", "error", "stated"})
        fmt::print(" {:.1f} |", row[name][key].get<double>());
    fmt::print("\n");
  }
  fmt::print("\nwithin the stated error: {:.1f} % of lowest points, {:.1f} % of micro-trenches\n\n",
             100 * found["within"]["lowest"].get<double>(),
             100 * found["within"]["micro_trench"].get<double>());
}

}  // namespace scarp::bench
