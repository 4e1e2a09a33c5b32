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
#include "core/recipe/csv.h"
#include "core/recipe/quantity.h"
#include "core/suggestion.h"
#include "core/system/atomic_file.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

/// What the state is compared with; nothing where there is none.
std::optional<fs::path> start_file(const MeasureArguments& arguments, const fs::path& state) {
  if (!arguments.start.empty()) return arguments.start;
  const fs::path beside = state.parent_path() / "state_0000.vdb";
  return fs::exists(beside) ? std::optional(beside) : std::nullopt;
}

double height_of(const std::string& option, const std::string& text) {
  try {
    const double height = parse_quantity(text, Dimension::length);
    if (std::abs(height) <= longest_length) return height;
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", option, error.what()));
  }
  throw InputError(fmt::format("{}: \"{}\" is beyond {}", option, text,
                               format_quantity(longest_length, Dimension::length)));
}

/// Those of the recipe, unless some are given.
void set_heights(const std::string& option, const std::vector<std::string>& given,
                 std::vector<double>& heights) {
  if (!given.empty()) heights.clear();
  for (const std::string& height : given) heights.push_back(height_of(option, height));
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

/// A state and what is measured of it.
struct Measured {
  fs::path file;
  double time = 0;
  MetrologyOptions options{};
  Metrology metrology{};
};

/// Materials that are known already keep their numbers, and those of the state are added to them.
Measured measured(const fs::path& file, const MeasureArguments& arguments, Materials& known,
                  std::vector<MaterialId>& occurring) {
  SavedWafer wafer = read_wafer(file, known);
  const std::optional<SavedWafer> before = read_start(arguments, file, wafer);
  std::vector<const Layers*> wafers{&wafer.layers};
  if (before) wafers.push_back(&before->layers);
  known = before ? before->materials : wafer.materials;
  MetrologyOptions& options = wafer.metrology;
  if (!arguments.masks.empty()) options.masks.clear();
  for (const std::string& mask : arguments.masks)
    if (mask != "none") options.masks.push_back(mask_of(mask, known, wafers));
  set_heights("--cd-at", arguments.cd_at, options.cd_heights);
  set_heights("--angle-at", arguments.angle_at, options.angle_heights);
  for (const Layer& layer : wafer.layers.stack)
    if (std::ranges::find(occurring, layer.material) == occurring.end())
      occurring.push_back(layer.material);

  std::optional<Metrology> start;
  if (before) start = measure(before->layers, options, nullptr, before->openings);
  Metrology found = measure(wafer.layers, options, start ? &*start : nullptr, wafer.openings);
  return {file, wafer.time, options, std::move(found)};
}

void print_one(const Measured& found, const Materials& materials, bool as_json) {
  const MetrologyNames names{.materials = materials, .options = found.options};
  if (as_json) {
    nlohmann::ordered_json json{{"state", found.file.string()}, {"time_s", found.time}};
    json.update(metrology_json(found.metrology, names));
    std::cout << json.dump(2) << '\n';
  } else {
    fmt::print("{}, t = {:.6g} s\n\n{}", shown(found.file), found.time,
               metrology_table(found.metrology, names));
  }
}

/// Those that are asked for, each once.
std::vector<fs::path> files_of(const MeasureArguments& arguments) {
  std::vector<fs::path> files;
  const auto add = [&](const fs::path& file) {
    const auto is_same = [&](const fs::path& other) {
      std::error_code missing;  // which reading the file reports
      return fs::equivalent(file, other, missing);
    };
    if (std::ranges::none_of(files, is_same)) files.push_back(file);
  };
  for (const std::string& where : arguments.where) {
    const bool takes_all = arguments.all && fs::is_directory(where);
    const std::vector<fs::path> states = takes_all ? states_of(where) : std::vector<fs::path>{};
    // Where there is no state, newest_state says what is missing.
    if (states.empty()) add(newest_state(where));
    std::ranges::for_each(states, add);
  }
  return files;
}

/// The lines of metrology.csv, each with the run and the state that it is of.
std::string csv_of(std::span<const Measured> all, const Materials& materials,
                   const std::vector<MaterialId>& occurring) {
  // Heights are the columns: all states have those of the first one.
  const MetrologyColumns columns{.materials = materials,
                                 .cd_heights = all.front().options.cd_heights,
                                 .angle_heights = all.front().options.angle_heights,
                                 .films = occurring,
                                 .occurring = occurring};
  std::string text = "run,state," + metrology_head(columns);
  std::size_t output = 0;
  for (std::size_t n = 0; n < all.size(); ++n) {
    const fs::path folder = all[n].file.parent_path();
    output = n > 0 && folder == all[n - 1].file.parent_path() ? output + 1 : 0;
    const std::string prefix =
        csv_field(folder.string()) + ',' + csv_field(all[n].file.filename().string()) + ',';
    const std::string rows = metrology_rows(output, all[n].time, all[n].metrology, columns);
    for (std::size_t begin = 0; begin < rows.size();) {
      const std::size_t end = rows.find('\n', begin) + 1;
      text += prefix + rows.substr(begin, end - begin);
      begin = end;
    }
  }
  return text;
}

/// All states of a table have to be asked for the same heights.
void require_same_heights(std::span<const Measured> all) {
  for (const Measured& each : all) {
    const MetrologyOptions& first = all.front().options;
    std::vector<std::string> keys;
    std::vector<std::string> options;
    const auto compare = [&](const std::vector<double> MetrologyOptions::*heights, const char* key,
                             const char* option) {
      if (each.options.*heights == first.*heights) return;
      keys.emplace_back(key);
      options.emplace_back(option);
    };
    compare(&MetrologyOptions::cd_heights, "cd_at", "--cd-at");
    compare(&MetrologyOptions::angle_heights, "angle_at", "--angle-at");
    if (keys.empty()) continue;
    throw InputError(fmt::format(
        "{}: its recipe has other {} than that of {}; give the heights with {}", shown(each.file),
        fmt::join(keys, " and "), shown(all.front().file), fmt::join(options, " and ")));
  }
}

}  // namespace

ExitCode execute(const MeasureArguments& arguments, const CommonOptions& common) {
  const std::vector<fs::path> files = files_of(arguments);
  Materials materials;
  std::vector<MaterialId> occurring;
  std::vector<Measured> all;
  all.reserve(files.size());
  for (const fs::path& file : files) all.push_back(measured(file, arguments, materials, occurring));
  const bool is_table = arguments.all || all.size() > 1 || !arguments.output.empty();
  if (!is_table) {
    print_one(all.front(), materials, common.json);
    return done;
  }
  require_same_heights(all);
  const std::string text = csv_of(all, materials, occurring);
  if (arguments.output.empty()) {
    std::cout << text;
  } else {
    write_file(arguments.output, text);
  }
  return done;
}

}  // namespace scarp
