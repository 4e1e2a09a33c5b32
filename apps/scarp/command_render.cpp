#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/report/render.h"
#include "apps/run/png_file.h"
#include "apps/run/restart.h"
#include "apps/scarp/commands.h"
#include "apps/simulator/section.h"
#include "core/error.h"
#include "core/printable.h"
#include "levelset/surface/resample.h"

namespace scarp {

namespace {

/// "y = 0 nm", as sections are written, or "none".
std::optional<RenderCut> cut_of(const std::string& text, const Frame& frame) {
  if (text == "none") return std::nullopt;
  try {
    const SectionLine line = parse_section(text, frame);
    if (line.lateral == "x") return RenderCut{.axis = 1, .position = line.plane.origin[1]};
    if (line.lateral == "y") return RenderCut{.axis = 0, .position = line.plane.origin[0]};
  } catch (const InputError& error) {
    throw InputError(fmt::format("--cut: {}", error.what()));
  }
  throw InputError("--cut: cuts lie across x or y, such as \"y = 0 nm\"; or none");
}

}  // namespace

ExitCode execute(const RenderArguments& arguments, const CommonOptions& common) {
  if (std::filesystem::path(arguments.output).extension() != ".png")
    throw InputError(fmt::format("-o: {}: pictures are .png", shown(arguments.output)));
  const SavedWafer wafer = read_wafer(newest_state(arguments.where));
  const Frame& own = wafer.layers.frame;
  const Frame frame = own.is_around_axis() ? revolved(own, own.cells[0]) : own;
  const Image image = render(wafer.layers, {.cut = cut_of(arguments.cut, frame),
                                            .azimuth = arguments.azimuth,
                                            .elevation = arguments.elevation,
                                            .width = arguments.width});
  write_png(arguments.output, image);
  if (common.json) {
    const nlohmann::ordered_json json{{"file", arguments.output},
                                      {"time_s", wafer.time},
                                      {"width", image.width},
                                      {"height", image.height}};
    std::cout << json.dump(2) << '\n';
  } else if (!common.quiet) {
    fmt::print("{}\n", shown(arguments.output));
  }
  return done;
}

}  // namespace scarp
