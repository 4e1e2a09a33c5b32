#include <fmt/format.h>

#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/commands.h"
#include "core/error.h"
#include "mesh/mesh_file.h"
#include "mesh/simplify.h"

namespace scarp {

namespace {

struct SimplifyArguments {
  std::string in;
  std::string out;
  std::string method = "paper";
  SimplifyOptions options;
};

SimplifyMethod method_named(const std::string& name) {
  if (name == "lindstrom-turk") return SimplifyMethod::lindstrom_turk;
  if (name == "length") return SimplifyMethod::length;
  if (name == "paper") return SimplifyMethod::paper;
  throw InputError("--method curvature does not exist yet; use paper, lindstrom-turk or length");
}

int simplify_mesh(const SimplifyArguments& arguments, const CommonOptions& common) {
  const TriMesh mesh = read_mesh(arguments.in);
  const Box box = bounding_box(mesh);
  SimplifyOptions options = arguments.options;
  options.method = method_named(arguments.method);
  options.sides = {.lower = {box.lower.x, box.lower.y}, .upper = {box.upper.x, box.upper.y}};

  const auto start = std::chrono::steady_clock::now();
  const SimplifyResult simplified = simplify(mesh, options);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  write_mesh(arguments.out, simplified.mesh);

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
  } else if (!common.quiet) {
    for (const auto& [key, value] : result.items()) fmt::print("{:22} {}\n", key, value.dump());
  }
  return done;
}

}  // namespace

void add_simplify(CLI::App& app, const CommonOptions& common, CommandAction& action) {
  CLI::App* command = app.add_subcommand("simplify", "Reduce a surface mesh by edge collapse");
  const auto arguments = std::make_shared<SimplifyArguments>();
  SimplifyOptions& options = arguments->options;
  command->add_option("in", arguments->in, "Mesh: .obj .ply .stl .vtp")->required();
  command->add_option("out", arguments->out, "Result, the format by its ending")->required();
  command->add_option("--method", arguments->method, "paper (default), lindstrom-turk or length")
      ->check(CLI::IsMember({"paper", "curvature", "lindstrom-turk", "length"}));
  command
      ->add_option("--spacing", options.spacing,
                   "Grid spacing the mesh came from: sizes default to what a recipe has")
      ->check(CLI::PositiveNumber);
  auto* remove = command->add_option("--remove", options.remove, "Fraction of vertices to remove");
  command->add_option("--vertices", options.vertices, "Number of vertices to keep")
      ->check(CLI::PositiveNumber)
      ->excludes(remove);
  command->add_option("--max-error", options.max_error, "Bound on the distance, both ways");
  command->add_option("--l0", options.l0, "Shortest edge wanted at features");
  command->add_option("--step-length", options.step_length, "Growth of the edge length per region");
  command->add_option("--l-max", options.l_max, "Longest edge wanted in flat regions");
  command->add_option("--curvature-threshold", options.curvature_threshold,
                      "Mean curvature above which a vertex is a feature (default: from the noise)");
  command->callback([&common, &action, arguments] {
    action = [&common, arguments] { return simplify_mesh(*arguments, common); };
  });
}

}  // namespace scarp
