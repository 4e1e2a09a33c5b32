#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "apps/scarp/commands.h"
#include "core/log.h"
#include "core/printable.h"
#include "mesh/distance.h"
#include "mesh/files/mesh_file.h"

namespace scarp {

namespace {

nlohmann::ordered_json as_json(const DistanceStatistics& distance) {
  return {
      {"max", distance.max}, {"mean", distance.mean}, {"rms", distance.rms}, {"p99", distance.p99}};
}

void write_distances(const std::string& file, const TriMesh& a, const TriMesh& b) {
  std::vector<Vec3d> places;
  for (const Vec3f& r : a.vertices) places.emplace_back(r);
  const std::vector<double> values = distances(places, TriangleTree(b));
  write_vtp(file, a, {.facets = {}, .vertices = {{"distance", std::span(values)}}});
}

/// Warns if the file holds more than a surface.
TriMesh read_whole(const std::string& name) {
  MeshFile file = read_mesh_file(name);
  if (!file.left_out.empty())
    Log(std::cerr).warn(shown(name) + ": " + left_out_text(file.left_out));
  return std::move(file.mesh);
}

}  // namespace

ExitCode execute(const DistanceArguments& arguments, const CommonOptions& common) {
  const TriMesh a = read_whole(arguments.a);
  const TriMesh b = read_whole(arguments.b);
  const SurfaceDistance distance = surface_distance(a, b);
  const auto& [there, back, symmetric_max] = distance;
  if (!arguments.output.empty()) write_distances(arguments.output, a, b);
  const nlohmann::ordered_json result{
      {"forward", as_json(there)}, {"reverse", as_json(back)}, {"symmetric_max", symmetric_max}};
  if (common.json) {
    std::cout << result.dump(2) << '\n';
    return done;
  }
  fmt::print("{:22} {:>12} {:>12} {:>12} {:>12}\n", "distance", "max", "mean", "rms", "p99");
  for (const auto& [name, d] :
       {std::pair{"vertices of A to B", there}, std::pair{"vertices of B to A", back}}) {
    fmt::print("{:22} {:12.6g} {:12.6g} {:12.6g} {:12.6g}\n", name, d.max, d.mean, d.rms, d.p99);
  }
  fmt::print("{:22} {:12.6g}\n", "symmetric", symmetric_max);
  return done;
}

}  // namespace scarp
