#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/run/restart.h"
#include "apps/scarp/commands.h"
#include "apps/scarp/region_volume.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/quantity.h"
#include "levelset/metrology/material_bodies.h"
#include "levelset/surface/resample.h"
#include "mesh/files/mesh_file.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

double bottom_of(const VolumeArguments& arguments, const Layers& layers) {
  if (arguments.bottom.empty()) return default_bottom(layers);
  try {
    return parse_quantity(arguments.bottom, Dimension::length);
  } catch (const InputError& error) {
    throw InputError(fmt::format("--bottom: {}", error.what()));
  }
}

std::vector<MaterialBody> bodies_of(const Layers& layers, double bottom) {
  try {
    return material_bodies(layers, bottom);
  } catch (const InputError& error) {
    throw InputError(fmt::format("--bottom: {}", error.what()));
  }
}

/// NAME.stl becomes NAME_SiO2.stl.
fs::path file_of(const fs::path& output, const std::string& material) {
  return output.parent_path() /
         fmt::format("{}_{}{}", output.stem().string(), material, output.extension().string());
}

/// Options of one mesh for all regions.
void refuse_options_of_regions(const VolumeArguments& arguments) {
  const char* const option = arguments.gas             ? "--gas"
                             : arguments.tetrahedra    ? "--tetrahedra"
                             : !arguments.size.empty() ? "--size"
                                                       : nullptr;
  if (option == nullptr) return;
  throw InputError(fmt::format(
      "{}: only meshes of all materials in one have it; write -o NAME.msh or NAME.vtu", option));
}

/// Before anything is computed.
void refuse_other_endings(const fs::path& output) {
  for (const char* const ending : {".obj", ".ply", ".stl", ".vtp"})
    if (output.extension() == ending) return;
  throw InputError(fmt::format(
      "{}: the ending does not name a mesh format; use .obj, .ply, .stl or .vtp for a file of each "
      "material, or .msh, .smesh or .vtu for all materials in one mesh",
      shown(output)));
}

}  // namespace

ExitCode execute(const VolumeArguments& arguments, const CommonOptions& common) {
  if (holds_regions(arguments.output)) return write_regions(arguments, common);
  refuse_options_of_regions(arguments);
  SavedWafer wafer = read_wafer(newest_state(arguments.where));
  refuse_other_endings(arguments.output);
  const Frame& frame = wafer.layers.frame;
  if (frame.is_around_axis()) wafer.layers = revolved(wafer.layers, frame.cells[0]);
  const std::vector<MaterialBody> bodies =
      bodies_of(wafer.layers, bottom_of(arguments, wafer.layers));
  nlohmann::ordered_json json{{"time_s", wafer.time}, {"bodies", nlohmann::ordered_json::array()}};
  for (const MaterialBody& body : bodies) {
    const std::string& name = wafer.materials[body.material].name;
    const fs::path file = file_of(arguments.output, name);
    write_mesh(file, body.surface);
    json["bodies"].push_back({{"material", name},
                              {"file", file.string()},
                              {"volume_nm3", enclosed_volume(body.surface)},
                              {"facets", body.surface.triangles.size()}});
    if (!common.json && !common.quiet)
      fmt::print("{}: {:.6g} nm^3, {} facets\n", shown(file), enclosed_volume(body.surface),
                 body.surface.triangles.size());
  }
  if (common.json) std::cout << json.dump(2) << '\n';
  return done;
}

}  // namespace scarp
