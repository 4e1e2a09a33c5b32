#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/commands.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/quantity.h"
#include "flux/solve.h"
#include "mesh/mesh_file.h"

namespace scarp {

namespace {

struct FluxArguments {
  std::string mesh;
  std::string output;
  double sticking = 1;
  double source_power = 1;
  double spacing = 0;
  double target_error = 0.01;
  std::uint64_t rays = 0;
  std::uint64_t max_rays = FluxOptions{}.max_rays;
  std::uint64_t seed = 1;
  FluxOptions::Engine engine = FluxOptions::Engine::automatic;
  Boundary boundary = Boundary::reflective;
};

void write_csv(const std::filesystem::path& file, const TriMesh& mesh, const FluxField& flux) {
  AtomicFile out(file);
  out.write("facet,x,y,z,nx,ny,nz,area,flux,std_error\n");
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto [a, b, c] = corners(mesh, f);
    const Vec3d r = (a + b + c) / 3.0;
    const Vec3d area = area_vector(mesh, f);
    const Vec3d n = normalized(area);
    out.write(fmt::format("{},{},{},{},{},{},{},{},{},{}\n", f, r.x, r.y, r.z, n.x, n.y, n.z,
                          length(area), flux.arrivals().mean[f], flux.arrivals().std_error[f]));
  }
  out.commit();
}

void write_output(const std::filesystem::path& file, const TriMesh& mesh, const FluxField& flux) {
  if (file.extension() == ".csv") {
    write_csv(file, mesh, flux);
  } else if (file.extension() == ".vtp") {
    write_vtp(file, mesh,
              {.facets = {{"flux", std::span(flux.arrivals().mean)},
                          {"flux_std_error", std::span(flux.arrivals().std_error)}},
               .vertices = {}});
  } else {
    throw InputError(
        fmt::format("{}: results are written as .vtp or .csv, by the ending", file.string()));
  }
}

int trace_mesh(const FluxArguments& arguments, const CommonOptions& common) {
  const TriMesh mesh = read_mesh(arguments.mesh);
  const Box box = bounding_box(mesh);
  FluxOptions options;
  options.engine = arguments.engine;
  options.sides = {.lower = {box.lower.x, box.lower.y},
                   .upper = {box.upper.x, box.upper.y},
                   .boundary = {arguments.boundary, arguments.boundary}};
  options.spacing = arguments.spacing;
  options.target_error = arguments.target_error;
  options.rays = arguments.rays;
  options.max_rays = arguments.max_rays;
  options.seed = arguments.seed;
  Species species{.name = "particles"};
  species.source.cosine_power = arguments.source_power;
  species.sticking = std::vector<float>(1, static_cast<float>(arguments.sticking));

  TriMesh bare = mesh;
  bare.materials.clear();
  const auto start = std::chrono::steady_clock::now();
  const std::vector<FluxField> fields = solve_flux(bare, std::span(&species, 1), options);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  const FluxField& flux = fields.front();
  if (!arguments.output.empty()) write_output(arguments.output, mesh, flux);
  if (!flux.target_reached) {
    fmt::print(stderr,
               "warning: the error {:.3g} is above the target {:.3g}: the cap of {} rays came "
               "first; raise --max-rays or the target\n",
               flux.error, options.target_error, options.max_rays);
  }

  const double emitted = flux.audit.emitted > 0 ? flux.audit.emitted : 1;
  nlohmann::ordered_json result{
      {"engine", flux.engine == FluxEngine::gather ? "gather" : "forward"},
      {"facets", mesh.triangles.size()},
      {"rays", flux.rays},
      {"segments", flux.segments},
      {"seconds", seconds.count()},
      {"absorbed", flux.audit.absorbed / emitted},
      {"escaped", flux.audit.escaped / emitted},
      {"lost", flux.audit.lost() / emitted},
      {"balance_error", flux.audit.balance_error()},
      {"error", flux.error},
      {"max_facet_error", flux.max_facet_error},
      {"target_reached", flux.target_reached}};
  if (common.json) {
    std::cout << result.dump(2) << '\n';
  } else if (!common.quiet) {
    for (const auto& [key, value] : result.items()) fmt::print("{:16} {}\n", key, value.dump());
  }
  return done;
}

}  // namespace

void add_flux(CLI::App& app, const CommonOptions& common, CommandAction& action) {
  CLI::App* command = app.add_subcommand("flux", "What arrives on a mesh, relative to the source");
  const auto arguments = std::make_shared<FluxArguments>();
  command->add_option("mesh", arguments->mesh, "Mesh: .obj .ply .stl .vtp")->required();
  command->add_option("--sticking", arguments->sticking, "Sticking probability (default: 1)");
  command->add_option("--source-power", arguments->source_power,
                      "Power of the cosine of the source (default: 1)");
  command->add_option("--engine", arguments->engine, "forward, gather or auto (default)")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, FluxOptions::Engine>{{"auto", FluxOptions::Engine::automatic},
                                                     {"forward", FluxOptions::Engine::forward},
                                                     {"gather", FluxOptions::Engine::gather}}));
  auto* rays = command->add_option("--rays", arguments->rays, "Number of rays; no target then")
                   ->check(CLI::PositiveNumber);
  command
      ->add_option("--target-error", arguments->target_error,
                   "Rays are added until this error (default: 0.01)")
      ->excludes(rays);
  command->add_option("--max-rays", arguments->max_rays, "Cap on the rays for the target")
      ->check(CLI::PositiveNumber);
  command->add_option("--spacing", arguments->spacing,
                      "Grid spacing the mesh came from (default: from its facets)");
  command->add_option("--seed", arguments->seed, "Seed of the random numbers (default: 1)")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--boundary", arguments->boundary, "reflective (default) or periodic sides")
      ->transform(CLI::CheckedTransformer(std::map<std::string, Boundary>{
          {"reflective", Boundary::reflective}, {"periodic", Boundary::periodic}}));
  command->add_option("-o,--output", arguments->output, "Flux per facet: .vtp or .csv");
  command->callback([&common, &action, arguments] {
    action = [&common, arguments] { return trace_mesh(*arguments, common); };
  });
}

}  // namespace scarp
