#include <fmt/format.h>

#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/commands.h"
#include "core/log.h"
#include "mesh/mesh_file.h"
#include "mesh/quality.h"
#include "mesh/simplify.h"

namespace scarp {

namespace {

SimplifyMethod method_named(const std::string& name) {
  if (name == "paper") return SimplifyMethod::paper;
  if (name == "lindstrom-turk") return SimplifyMethod::lindstrom_turk;
  if (name == "length") return SimplifyMethod::length;
  return SimplifyMethod::curvature;
}

}  // namespace

ExitCode execute(const SimplifyArguments& arguments, const CommonOptions& common) {
  const TriMesh mesh = read_mesh(arguments.in);
  SimplifyOptions options = arguments.options;
  options.method = method_named(arguments.method);
  options.sides = sides_of(mesh);

  const auto start = std::chrono::steady_clock::now();
  const SimplifyResult simplified = simplify(mesh, options);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  write_mesh(arguments.out, simplified.mesh);
  if (simplified.stopped_by == "self_intersections") {
    Log(std::cerr).warn(fmt::format(
        "{} vertices are left: on the way to fewer, parts of the surface passed through "
        "each other; try --max-error",
        simplified.mesh.vertices.size()));
  }

  const nlohmann::ordered_json result{{"method", arguments.method},
                                      {"vertices_in", mesh.vertices.size()},
                                      {"vertices_out", simplified.mesh.vertices.size()},
                                      {"facets_in", mesh.triangles.size()},
                                      {"facets_out", simplified.mesh.triangles.size()},
                                      {"seconds", seconds.count()},
                                      {"max_distance", simplified.max_distance},
                                      {"reverse_max_distance", simplified.reverse_max_distance},
                                      {"stopped_by", simplified.stopped_by}};
  if (common.json) {
    std::cout << result.dump(2) << '\n';
  } else {
    for (const auto& [key, value] : result.items()) fmt::print("{:22} {}\n", key, value.dump());
  }
  return done;
}

}  // namespace scarp
