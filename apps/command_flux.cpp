#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/commands.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/quantity.h"
#include "flux/solve.h"
#include "mesh/mesh_file.h"

namespace scarp {

namespace {

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

// What is neither absorbed nor escapes has found a way through the surface. The balance of gathered
// rays holds on average.
void warn_of_leaks(const FluxAudit& audit) {
  constexpr double most_lost = 1e-3;
  const double lost = audit.emitted > 0 ? audit.lost() / audit.emitted : 0;
  const double missing = std::abs(audit.balance_error()) - 5 * audit.balance_std_error;
  if (lost <= most_lost && missing <= most_lost) return;
  fmt::print(stderr,
             "warning: {:.2g} of the particles are lost: the mesh has holes, does not reach its "
             "sides, or faces down; its outside is where vertices go round counter-clockwise\n",
             std::max(lost, missing));
}

}  // namespace

ExitCode execute(const FluxArguments& arguments, const CommonOptions& common) {
  const TriMesh mesh = read_mesh(arguments.mesh);
  const Box box = bounding_box(mesh);
  FluxOptions options = arguments.options;
  options.sides = {.lower = {box.lower.x, box.lower.y},
                   .upper = {box.upper.x, box.upper.y},
                   .boundary = {arguments.boundary, arguments.boundary}};
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

  warn_of_leaks(flux.audit);
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
      {"target_reached", nullptr}};
  // Without a target there is none to be reached.
  if (options.rays == 0) result["target_reached"] = flux.target_reached;
  if (common.json) {
    std::cout << result.dump(2) << '\n';
  } else {
    for (const auto& [key, value] : result.items()) fmt::print("{:16} {}\n", key, value.dump());
  }
  return done;
}

}  // namespace scarp
