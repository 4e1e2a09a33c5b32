#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/run/metrology_files.h"
#include "apps/run/restart.h"
#include "apps/scarp/commands.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/quantity.h"
#include "core/suggestion.h"

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
    const double height = parse_quantity(text, Dimension::length);
    if (std::abs(height) <= longest_length) return height;
  } catch (const InputError& error) {
    throw InputError(fmt::format("--cd-at: {}", error.what()));
  }
  throw InputError(fmt::format("--cd-at: \"{}\" is beyond {}", text,
                               format_quantity(longest_length, Dimension::length)));
}

/// A material that is, or was at the start, on the wafer.
MaterialId mask_of(const std::string& name, const Materials& materials,
                   std::span<const Layers* const> wafers) {
  std::vector<std::string> names;
  for (const Layers* layers : wafers) {
    for (const Layer& layer : layers->stack) {
      const std::string& each = materials[layer.material].name;
      if (each == name) return layer.material;
      if (std::ranges::find(names, each) == names.end()) names.push_back(each);
    }
  }
  throw InputError(fmt::format("--mask: \"{}\" is not on the wafer{}; it has {}", name,
                               suggestion(name, names), fmt::join(names, ", ")));
}

/// The start, where there is one.
std::optional<SavedWafer> read_start(const MeasureArguments& arguments, const fs::path& file,
                                     const SavedWafer& wafer) {
  const std::optional<fs::path> earlier = start_file(arguments, file);
  if (!earlier) return std::nullopt;
  SavedWafer start = read_wafer(*earlier, wafer.materials);
  if (start.layers.frame == wafer.layers.frame) return start;
  throw InputError(
      fmt::format("--start: {} has another mode, spacing, extent or sides than {}; give a state of "
                  "the same run",
                  shown(*earlier), shown(file)));
}

}  // namespace

ExitCode execute(const MeasureArguments& arguments, const CommonOptions& common) {
  const fs::path file = newest_state(arguments.where);
  SavedWafer wafer = read_wafer(file);
  const std::optional<SavedWafer> before = read_start(arguments, file, wafer);
  std::vector<const Layers*> wafers{&wafer.layers};
  if (before) wafers.push_back(&before->layers);
  const Materials& materials = before ? before->materials : wafer.materials;
  MetrologyOptions& options = wafer.metrology;
  if (!arguments.masks.empty()) options.masks.clear();
  for (const std::string& mask : arguments.masks)
    if (mask != "none") options.masks.push_back(mask_of(mask, materials, wafers));
  if (!arguments.cd_at.empty()) options.cd_heights.clear();
  for (const std::string& height : arguments.cd_at) options.cd_heights.push_back(height_of(height));

  std::optional<Metrology> start;
  if (before) start = measure(before->layers, options, nullptr, before->openings);
  const Metrology found = measure(wafer.layers, options, start ? &*start : nullptr, wafer.openings);

  const MetrologyNames names{.materials = wafer.materials, .options = options};
  if (common.json) {
    nlohmann::ordered_json json{{"state", file.string()}, {"time_s", wafer.time}};
    json.update(metrology_json(found, names));
    std::cout << json.dump(2) << '\n';
  } else {
    fmt::print("{}, t = {:.6g} s\n\n{}", shown(file), wafer.time, metrology_table(found, names));
  }
  return done;
}

}  // namespace scarp
