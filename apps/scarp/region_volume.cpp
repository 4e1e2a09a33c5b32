#include "apps/scarp/region_volume.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string_view>

#include "apps/run/restart.h"
#include "apps/scarp/tetrahedra.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/quantity.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/metrology/region_surface.h"
#include "levelset/surface/extract_surface.h"
#include "levelset/surface/resample.h"
#include "mesh/files/region_file.h"
#include "mesh/regions/remesh.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

constexpr double default_room = 10;    ///< spacings below and above the surfaces
constexpr double default_size = 4;     ///< spacings
constexpr double max_distance = 0.05;  ///< spacings

double length_of(const std::string& option, const std::string& text) {
  try {
    return parse_quantity(text, Dimension::length);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", option, error.what()));
  }
}

std::string ending_of(const std::string& file) { return fs::path(file).extension().string(); }

RegionMesh cut(const VolumeArguments& arguments, const Layers& layers) {
  const double room = default_room * layers.frame.spacing;
  RegionOptions options;
  options.bottom = arguments.bottom.empty()
                       ? bounding_box(extract_surface(layers, 0)).lower.z - room
                       : length_of("--bottom", arguments.bottom);
  if (arguments.gas) {
    options.lid = arguments.top.empty() ? bounding_box(extract_surface(layers.top())).upper.z + room
                                        : length_of("--top", arguments.top);
  }
  try {
    return region_surface(layers, options);
  } catch (const InputError& error) {
    const bool is_top = std::string_view(error.what()).starts_with("the lid");
    throw InputError(fmt::format("{}: {}", is_top ? "--top" : "--bottom", error.what()));
  }
}

/// Volumes of materials in the run, from the bottom of the mesh on. Of a section areas.
///
/// Shape: as the regions; the last ones, of gas, are 0.
std::vector<double> wanted_volumes(const Layers& layers, const RegionMesh& mesh) {
  const Frame& frame = layers.frame;
  const double thickness = frame.is_slice() ? frame.spacing : 1;
  const double radius = frame.sides().width(0) / 2;
  const double floor =
      frame.axisymmetric ? std::numbers::pi * radius * radius : frame.sides().area() / thickness;
  std::vector<double> wanted(mesh.regions.size());
  const std::vector<double> of_layers = material_volumes(layers);
  for (std::size_t k = 0; k < of_layers.size(); ++k) {
    for (std::size_t n = 0; n < mesh.regions.size(); ++n) {
      if (mesh.regions[n].kind != MeshRegion::Kind::material ||
          mesh.regions[n].material != layers.stack[k].material)
        continue;
      wanted[n] += of_layers[k] / thickness - (k == 0 ? mesh.lower[2] * floor : 0);
    }
  }
  return wanted;
}

/// Of the half of a section around an axis, the volumes of what goes around it.
std::vector<double> volumes_of(const RegionMesh& mesh, const Frame& frame) {
  if (!frame.axisymmetric) return region_volumes(mesh);
  std::vector<double> volumes(mesh.regions.size());
  for (const RegionMesh::Facet& facet : mesh.facets) {
    const auto [a, b, c] = corners(mesh, facet);
    const auto region =
        static_cast<std::size_t>(mesh.bodies[static_cast<std::size_t>(facet.bodies[0])].region);
    if (mesh.regions[region].is_meshed)
      volumes[region] +=
          2 * std::numbers::pi * (a.x + b.x + c.x) / 3 * length(cross(b - a, c - a)) / 2;
  }
  return volumes;
}

struct Written {
  RegionMesh mesh;
  NamedMesh named;
  RegionQuality quality;
  std::vector<double> volumes;
  std::vector<std::string> warnings;
};

/// What a user has to know of a mesh.
std::vector<std::string> warnings_of(const Written& written, const Layers& layers) {
  constexpr double tolerated = 0.01;
  const double h = layers.frame.spacing;
  std::vector<std::string> warnings;
  const std::vector<double> wanted = wanted_volumes(layers, written.mesh);
  const char* unit = layers.frame.is_slice() ? "nm^2" : "nm^3";
  for (std::size_t n = 0; n < wanted.size(); ++n) {
    const MeshRegion& region = written.mesh.regions[n];
    if (region.kind != MeshRegion::Kind::material) continue;
    if (std::abs(written.volumes[n] - wanted[n]) <= tolerated * std::abs(wanted[n])) continue;
    // What is left out is missing; whatever else differs is how coarse the mesh is.
    const bool is_missing = written.volumes[n] < wanted[n];
    warnings.push_back(fmt::format(
        "{} has {:.6g} {} in the mesh and {:.6g} {} in the run: the mesh keeps within {:.3g} nm of "
        "the run's interfaces{}; run with a smaller spacing",
        region.name, written.volumes[n], unit, wanted[n], unit, written.quality.max_distance,
        is_missing
            ? fmt::format(", and leaves out films thinner than {:.4g} nm", thinnest_meshed_film * h)
            : ""));
  }
  if (written.quality.thin_facets > 0) {
    warnings.push_back(fmt::format(
        "{} facets have an altitude below {:g} of their target size; the least is {:.2g} of it",
        written.quality.thin_facets, thin_part, written.quality.least_relative_altitude));
  }
  for (int axis = 0; axis < 2; ++axis) {
    if (written.mesh.is_periodic[static_cast<std::size_t>(axis)] &&
        !sides_match(written.mesh, axis))
      warnings.push_back(fmt::format(
          "the facets on {0}_min and {0}_max do not match, though the sides are periodic",
          axis == 0 ? 'x' : 'y'));
  }
  return warnings;
}

std::size_t count_of(const NamedMesh& mesh, int dimension) {
  std::size_t count = 0;
  for (const ElementGroup& group : mesh.groups)
    if (group.dimension == dimension)
      count += group.corners.size() / (static_cast<std::size_t>(dimension) + 1);
  return count;
}

nlohmann::ordered_json json_of(const Written& written, const VolumeArguments& arguments,
                               double time, bool is_slice) {
  nlohmann::ordered_json json{{"time_s", time},
                              {"file", arguments.output},
                              {"vertices", written.named.vertices.size()},
                              {"facets", count_of(written.named, 2)},
                              {"tetrahedra", count_of(written.named, 3)},
                              {"least_altitude_nm", written.quality.least_altitude},
                              {"least_relative_altitude", written.quality.least_relative_altitude},
                              {"max_distance_nm", written.quality.max_distance},
                              {"max_plain_distance_nm", written.quality.max_plain_distance},
                              {"regions", nlohmann::ordered_json::array()},
                              {"interfaces", nlohmann::ordered_json::array()},
                              {"warnings", written.warnings}};
  for (std::size_t n = 0; n < written.mesh.regions.size(); ++n) {
    if (!written.mesh.regions[n].is_meshed) continue;
    std::size_t bodies = 0;
    for (const RegionMesh::Body& body : written.mesh.bodies)
      bodies += body.region == static_cast<int>(n) ? 1 : 0;
    json["regions"].push_back({{"name", written.mesh.regions[n].name},
                               {is_slice ? "area_nm2" : "volume_nm3", written.volumes[n]},
                               {"bodies", bodies}});
  }
  const int dimension = written.mesh.is_flat ? 1 : 2;
  std::map<std::string, std::size_t> interfaces;
  for (const ElementGroup& group : written.named.groups)
    if (group.dimension == dimension)
      interfaces[group.name] += group.corners.size() / (static_cast<std::size_t>(dimension) + 1);
  for (const auto& [name, count] : interfaces)
    json["interfaces"].push_back({{"name", name}, {"elements", count}});
  return json;
}

void refuse_sections(const VolumeArguments& arguments, const Frame& frame) {
  if (!frame.is_slice()) return;
  const char* const remedy =
      "write a .msh or .vtu file, whose triangles fill the section, or run with domain.mode = "
      "\"3d\"";
  if (arguments.tetrahedra)
    throw InputError(fmt::format("--tetrahedra: a section has none; {}", remedy));
  if (ending_of(arguments.output) == ".smesh")
    throw InputError(
        fmt::format("-o: tetgen fills surfaces in space, and this is a section; {}", remedy));
}

/// A section around an axis stays flat only where programs take it so.
bool is_revolved(const VolumeArguments& arguments, const Frame& frame) {
  return frame.axisymmetric && (arguments.tetrahedra || ending_of(arguments.output) == ".smesh");
}

void write(const VolumeArguments& arguments, const Written& written) {
  const fs::path file = arguments.output;
  const std::string ending = ending_of(arguments.output);
  if (ending == ".msh") write_msh(file, written.named);
  if (ending == ".vtu") write_vtu(file, written.named);
  if (ending == ".smesh") write_smesh(file, written.mesh);
}

}  // namespace

bool holds_regions(const std::string& file) {
  const std::string ending = ending_of(file);
  return ending == ".msh" || ending == ".smesh" || ending == ".vtu";
}

ExitCode write_regions(const VolumeArguments& arguments, const CommonOptions& common) {
  if (arguments.tetrahedra && ending_of(arguments.output) == ".smesh")
    throw InputError("--tetrahedra: a .smesh file holds surfaces; write .msh or .vtu");
  SavedWafer wafer = read_wafer(newest_state(arguments.where));
  refuse_sections(arguments, wafer.layers.frame);
  if (is_revolved(arguments, wafer.layers.frame))
    wafer.layers = revolved(wafer.layers, wafer.layers.frame.cells[0]);
  const Layers& layers = wafer.layers;
  const double h = layers.frame.spacing;
  const double size =
      arguments.size.empty() ? default_size * h : length_of("--size", arguments.size);
  if (!(size >= h))
    throw InputError(fmt::format("--size: {:g} nm is less than the spacing of {:g} nm", size, h));

  const std::vector<TriMesh> surfaces = layer_surfaces(layers);
  Written written;
  written.mesh = remesh(cut(arguments, layers), surfaces,
                        {.spacing = h, .size = size, .max_distance = max_distance * h});
  for (MeshRegion& region : written.mesh.regions) {
    region.name = region.kind == MeshRegion::Kind::material ? wafer.materials[region.material].name
                  : region.kind == MeshRegion::Kind::gas    ? "gas"
                                                            : "void";
  }
  written.quality = quality(written.mesh, surfaces, h, size);
  written.volumes = volumes_of(written.mesh, layers.frame);
  written.warnings = warnings_of(written, layers);
  for (const std::string& warning : written.warnings) std::cerr << "warning: " << warning << '\n';
  written.named = arguments.tetrahedra ? filled_by_program(written.mesh) : named_mesh(written.mesh);
  write(arguments, written);

  const bool is_slice = layers.frame.is_slice();
  const nlohmann::ordered_json json = json_of(written, arguments, wafer.time, is_slice);
  if (common.json) {
    std::cout << json.dump(2) << '\n';
  } else if (!common.quiet) {
    for (const auto& region : json["regions"])
      fmt::print("{}: {:.6g} {}\n", region["name"].get<std::string>(),
                 region[is_slice ? "area_nm2" : "volume_nm3"].get<double>(),
                 is_slice ? "nm^2" : "nm^3");
    fmt::print(
        "{}: {} vertices, {} facets, {} tetrahedra; altitudes from {:.3g} nm, interfaces "
        "within {:.3g} nm\n",
        shown(arguments.output), written.named.vertices.size(), count_of(written.named, 2),
        count_of(written.named, 3), written.quality.least_altitude, written.quality.max_distance);
  }
  return done;
}

}  // namespace scarp
