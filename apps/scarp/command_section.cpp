#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/run/picture.h"
#include "apps/run/restart.h"
#include "apps/run/results.h"
#include "apps/scarp/commands.h"
#include "apps/simulator/section.h"
#include "core/error.h"
#include "core/plain_number.h"
#include "core/printable.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

/// The surfaces of a run before its newest state; none of a state alone.
std::vector<EarlierSurface> earlier_surfaces(const fs::path& where, const SectionLine& line) {
  std::vector<EarlierSurface> surfaces;
  if (!fs::is_directory(where)) return surfaces;
  std::vector<fs::path> states = states_of(where);
  states.pop_back();
  for (const fs::path& file : states) {
    const SavedWafer wafer = read_wafer(file);
    surfaces.push_back(
        {.time = wafer.time,
         .lines = exposed_lines(cut(wafer.layers, layer_surfaces(wafer.layers), line))});
  }
  return surfaces;
}

SectionLine line_of(const std::string& text, const Frame& frame) {
  try {
    return parse_section(text, frame);
  } catch (const InputError& error) {
    throw InputError(fmt::format("line: {}", error.what()));
  }
}

void refuse_files_of_runs(const fs::path& file) {
  const bool is_in_run = fs::exists(file.parent_path() / "metrics.csv");
  if (!is_in_run || !is_result(file.filename().string())) return;
  throw InputError(
      fmt::format("-o: {} is a file that the run writes there; choose another name", shown(file)));
}

}  // namespace

ExitCode execute(const SectionArguments& arguments, const CommonOptions& common) {
  if (fs::path(arguments.output).filename().empty())
    throw InputError("-o: name the files, without their ending");
  const std::string points = arguments.output + ".csv";
  const std::string picture = arguments.output + ".svg";
  refuse_files_of_runs(points);
  refuse_files_of_runs(picture);
  const SavedWafer wafer = read_wafer(newest_state(arguments.where));
  const SectionLine line = line_of(arguments.line, wafer.layers.frame);
  const ProfileView view{
      .title = fmt::format("{}, t = {} s", arguments.line, plain_number(wafer.time, 4)),
      .layers = cut(wafer.layers, layer_surfaces(wafer.layers), line),
      .left = line.left,
      .right = line.right,
      .earlier = some_of(earlier_surfaces(arguments.where, line))};
  write_section_csv(points, view.layers, line, wafer.materials);
  write_svg(picture, view, wafer.materials);
  if (common.json) {
    const nlohmann::ordered_json json{{"line", arguments.line},
                                      {"time_s", wafer.time},
                                      {"earlier_surfaces", view.earlier.size()},
                                      {"csv", points},
                                      {"svg", picture}};
    std::cout << json.dump(2) << '\n';
  } else if (!common.quiet) {
    fmt::print("{} and {}\n", shown(picture), shown(points));
  }
  return done;
}

}  // namespace scarp
