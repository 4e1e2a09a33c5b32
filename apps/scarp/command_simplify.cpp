#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "apps/scarp/commands.h"
#include "core/log.h"
#include "core/printable.h"
#include "levelset/grid/welded.h"
#include "levelset/start/mesh_solid.h"
#include "mesh/files/mesh_file.h"
#include "mesh/sides.h"
#include "mesh/simplify/simplify.h"

namespace scarp {

namespace {

SimplifyMethod method_named(const std::string& name) {
  if (name == "paper") return SimplifyMethod::paper;
  if (name == "lindstrom-turk") return SimplifyMethod::lindstrom_turk;
  if (name == "length") return SimplifyMethod::length;
  return SimplifyMethod::curvature;
}

std::optional<std::size_t> vertices_asked(const TriMesh& mesh, const SimplifyOptions& options) {
  if (options.vertices || !options.remove) return options.vertices;
  return static_cast<std::size_t>(
      std::ceil((1 - *options.remove) * static_cast<double>(mesh.vertices.size())));
}

std::string reason_text(const std::string& stopped_by) {
  if (stopped_by == "self_intersections") {
    return "on the way to fewer, parts of the surface passed through each other; try --max-error";
  }
  if (stopped_by == "max_error") return "--max-error was reached";
  if (stopped_by == "sizes") return "edges are as long as they may be";
  if (stopped_by == "vertices") return "where facets meet only in a vertex each sheet has its own";
  return "no other edge can be collapsed without turning facets over, making them thin or moving a "
         "side";
}

void warn_of_missed_number(const SimplifyResult& simplified, std::optional<std::size_t> asked) {
  const std::size_t left = simplified.mesh.vertices.size();
  const bool is_missed = asked ? left > *asked : simplified.stopped_by == "self_intersections";
  if (!is_missed) return;
  Log(std::cerr).warn(fmt::format("{} vertices are left{}: {}", left,
                                  asked ? fmt::format(" in place of {}", *asked) : "",
                                  reason_text(simplified.stopped_by)));
}

// As in [[geometry]]; triangles that share no vertices have no edge that could be collapsed.
TriMesh read_and_weld(const std::string& name) {
  MeshFile file = read_mesh_file(name);
  const Log log(std::cerr);
  if (!file.left_out.empty()) log.warn(shown(name) + ": " + left_out_text(file.left_out));
  if (!file.data_left_out.empty()) log.info(shown(name) + ": " + left_out_text(file.data_left_out));
  if (!is_unwelded(file.mesh)) return std::move(file.mesh);
  TriMesh mesh = welded(file.mesh);
  log.info(fmt::format("{}: {} vertices at {} places are welded", shown(name),
                       file.mesh.vertices.size(), mesh.vertices.size()));
  return mesh;
}

// Bounds, sizes and features are in grid spacings.
void warn_of_coarse_spacing(const TriMesh& mesh, const SimplifyOptions& options) {
  if (options.spacing > 0) return;
  if (const std::optional<double> longest = edge_beyond_cells(mesh)) {
    Log(std::cerr).warn(fmt::format(
        "the mesh looks simplified already, with edges up to {:.3g}: bounds and sizes follow a "
        "grid spacing guessed from its edges, which is too large then; give that of the grid it "
        "came from by --spacing",
        *longest));
  }
}

}  // namespace

ExitCode execute(const SimplifyArguments& arguments, const CommonOptions& common) {
  const TriMesh mesh = read_and_weld(arguments.in);
  SimplifyOptions options = arguments.options;
  options.method = method_named(arguments.method);
  options.sides = sides_of(mesh);
  // No grid leaves edges longer than its cells. A body that is drawn stands in no domain.
  if (edge_beyond_cells(mesh)) {
    options.thin_facets = ThinFacets::exact;
    if (mesh_border(mesh) == 0) options.sides = {};
  }

  const auto start = std::chrono::steady_clock::now();
  const SimplifyResult simplified = simplify(mesh, options);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  write_mesh(arguments.out, simplified.mesh);
  warn_of_coarse_spacing(mesh, options);
  warn_of_missed_number(simplified, vertices_asked(mesh, options));

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
