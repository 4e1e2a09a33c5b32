#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/commands.h"
#include "apps/metrology_files.h"
#include "apps/restart.h"
#include "core/error.h"
#include "core/quantity.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

/// What the state is compared with; nothing where there is none.
std::optional<fs::path> start_file(const MeasureArguments& arguments, const fs::path& state) {
  if (!arguments.start.empty()) return arguments.start;
  const fs::path beside = state.parent_path() / "state_0000.vdb";
  return fs::exists(beside) ? std::optional(beside) : std::nullopt;
}

double height_of(const std::string& text) {
  try {
    return parse_quantity(text, Dimension::length);
  } catch (const InputError& error) {
    throw InputError(fmt::format("--cd-at: {}", error.what()));
  }
}

MaterialId mask_of(const std::string& name, const Materials& materials) {
  try {
    return materials.id(name);
  } catch (const InputError& error) {
    throw InputError(fmt::format("--mask: {}", error.what()));
  }
}

}  // namespace

ExitCode execute(const MeasureArguments& arguments, const CommonOptions& common) {
  const fs::path file = newest_state(arguments.where);
  SavedWafer wafer = read_wafer(file);
  MetrologyOptions& options = wafer.metrology;
  if (!arguments.masks.empty()) options.masks.clear();
  for (const std::string& mask : arguments.masks)
    options.masks.push_back(mask_of(mask, wafer.materials));
  if (!arguments.cd_at.empty()) options.cd_heights.clear();
  for (const std::string& height : arguments.cd_at) options.cd_heights.push_back(height_of(height));

  std::optional<Metrology> start;
  if (const std::optional<fs::path> earlier = start_file(arguments, file)) {
    const SavedWafer before = read_wafer(*earlier, wafer.materials);
    if (!(before.layers.frame == wafer.layers.frame)) {
      throw InputError(fmt::format(
          "--start: {} has another mode, spacing, extent or sides than {}; give a state of the "
          "same run",
          earlier->string(), file.string()));
    }
    start = measure(before.layers, options);
  }
  const Metrology found = measure(wafer.layers, options, start ? &*start : nullptr);

  const MetrologyNames names{.materials = wafer.materials, .options = options};
  if (common.json) {
    nlohmann::ordered_json json{{"state", file.string()}, {"time_s", wafer.time}};
    json.update(metrology_json(found, names));
    std::cout << json.dump(2) << '\n';
  } else {
    fmt::print("{}, t = {:.6g} s\n\n{}", file.string(), wafer.time, metrology_table(found, names));
  }
  return done;
}

}  // namespace scarp
