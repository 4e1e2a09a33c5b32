#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/estimate/memory_estimate.h"
#include "apps/run/restart.h"
#include "apps/run/result_files.h"
#include "apps/scarp/commands.h"
#include "apps/simulator/recipe.h"
#include "apps/simulator/region_text.h"
#include "core/log.h"
#include "core/printable.h"

namespace scarp {

namespace {

nlohmann::ordered_json as_json(const Preview& preview, const std::string& title,
                               const Materials& materials, const std::filesystem::path& folder) {
  nlohmann::ordered_json layers = nlohmann::ordered_json::array();
  for (std::size_t k = 0; k < preview.layers.stack.size(); ++k) {
    const Layer& layer = preview.layers.stack[k];
    layers.push_back({{"material", materials[layer.material].name},
                      {"volume_nm3", preview.volumes[k]},
                      {"active_nodes", layer.phi.active_count()}});
  }
  const Frame& frame = preview.layers.frame;
  const Sides sides = frame.sides();
  const Box box = bounding_box(preview.surface);
  return {{"title", title},
          {"spacing_nm", frame.spacing},
          {"extent_nm", {sides.width(0), sides.width(1)}},
          {"lowest_nm", box.lower.z},
          {"highest_nm", box.upper.z},
          {"vertices", preview.surface.vertices.size()},
          {"facets", preview.surface.triangles.size()},
          {"layers", layers},
          {"void_count", preview.voids.size()},
          {"void_volume_nm3", volume_of(preview.voids)},
          {"islands_removed",
           {{"count", preview.islands.count}, {"volume_nm3", preview.islands.volume}}},
          {"files", {folder / "preview.vtp", folder / "preview.csv", folder / "preview.svg"}}};
}

// As a run would tell it.
void tell_of_regions(const Preview& preview, const Frame& frame, const Log& log) {
  const std::string loose = loose_solid_text(frame, preview.islands);
  if (!loose.empty()) log.warn(loose);
  if (preview.voids.empty()) return;
  log.info(counted(preview.voids.size(), "void") + " closed from the start");
  for (const std::string& line : region_lines(frame, preview.voids)) log.info(line);
}

}  // namespace

ExitCode execute(const PreviewArguments& arguments, const CommonOptions& common) {
  const Recipe recipe = read_runnable(arguments.recipe, arguments.set);
  require_memory_of_start(least_memory(recipe), arguments.memory_limit_mb());
  const std::filesystem::path folder = arguments.result_folder();
  const Preview preview = write_preview(folder, recipe);
  const nlohmann::ordered_json result = as_json(preview, recipe.title, recipe.materials, folder);
  const auto level = common.quiet ? Log::Level::warnings : Log::Level::everything;
  const Log log(std::cerr, level);
  for (const std::string& warning : recipe.warnings) log.warn(warning);
  tell_of_regions(preview, recipe.domain.frame, log);
  if (common.json) {
    std::cout << result.dump(2) << '\n';
    return done;
  }
  fmt::print("{:16} {:>16} {:>14}\n", "layer, top first", "volume [um^3]", "active nodes");
  for (auto layer = result["layers"].rbegin(); layer != result["layers"].rend(); ++layer) {
    fmt::print("{:16} {:16.6g} {:14}\n", (*layer)["material"].get<std::string>(),
               (*layer)["volume_nm3"].get<double>() * 1e-9,
               (*layer)["active_nodes"].get<std::size_t>());
  }
  const Box box = bounding_box(preview.surface);
  fmt::print(
      "surface from z = {:.6g} nm to {:.6g} nm, {} facets; the lowest layer's volume counts "
      "from z = 0\n{}: preview.vtp, preview.csv and preview.svg\n",
      box.lower.z, box.upper.z, preview.surface.triangles.size(), shown(folder));
  return done;
}

}  // namespace scarp
