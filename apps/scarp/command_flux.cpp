#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/run/tell.h"
#include "apps/run/watchdog.h"
#include "apps/scarp/commands.h"
#include "apps/simulator/flux_target.h"
#include "core/error.h"
#include "core/log.h"
#include "core/printable.h"
#include "core/recipe/quantity.h"
#include "core/system/atomic_file.h"
#include "flux/solve.h"
#include "mesh/files/mesh_file.h"
#include "mesh/surface_fault.h"

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
        fmt::format("{}: results are written as .vtp or .csv, by the ending", shown(file)));
  }
}

// Single precision carries the ratio of the largest coordinate to the smallest facet only so far.
void refuse_far_vertices(const std::filesystem::path& file, const TriMesh& mesh) {
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vec3f r = mesh.vertices[v];
    if (std::max({std::abs(r.x), std::abs(r.y), std::abs(r.z)}) <= longest_length) continue;
    throw InputError(fmt::format(
        "{}: vertex {} at ({:g}, {:g}, {:g}) is too far away to be traced; no coordinate may be "
        "above {:g}: correct the vertex or scale the mesh",
        shown(file), v, r.x, r.y, r.z, longest_length));
  }
}

constexpr double most_lost = 1e-3;

double share(double part, const FluxAudit& audit) {
  return audit.emitted > 0 ? part / audit.emitted : 0;
}

// Rays from facets cannot tell what passes them by: a missing part of the particles is looked for
// from the source, where they arrive first.
void book_missed(const TriMesh& mesh, Species species, FluxOptions options, FluxAudit& audit) {
  if (is_balanced(audit)) return;
  constexpr std::uint64_t probes = 1 << 15;
  species.sticking = {1};
  options.engine = FluxOptions::Engine::forward;
  options.rays = probes;
  const FluxAudit first = solve_flux(mesh, std::span(&species, 1), options).front().audit;
  const double scale = audit.emitted / first.emitted;
  audit.lost_back_face += scale * first.lost_back_face;
  audit.lost_below += scale * first.lost_below;
  audit.lost_side_limit += scale * first.lost_side_limit;
  const double lost = share(first.lost(), first);
  const double variance = lost * (1 - lost) / probes;
  audit.balance_std_error = std::sqrt(audit.balance_std_error * audit.balance_std_error + variance);
}

// What passes a small mesh may be more than what arrives at its back faces.
bool is_inside_out(const FluxAudit& audit) {
  const bool reaches_outside = audit.absorbed + audit.escaped > 0;
  return share(audit.lost_back_face, audit) > 0.5 || (audit.lost_back_face > 0 && !reaches_outside);
}

void require_balance(const std::filesystem::path& file, const FluxField& flux) {
  const FluxAudit& audit = flux.audit;
  if (is_inside_out(audit)) {
    throw InputError(fmt::format(
        "{}: is inside out as seen from the source: {:.3g} % of the particles arrive at back "
        "faces; turn its triangles over, their outside is where the vertices go round "
        "counter-clockwise",
        shown(file), 100 * share(audit.lost_back_face, audit)));
  }
  if (is_balanced(flux)) return;
  const double off = audit.balance_error();
  throw NumericalError(fmt::format(
      "{}: the particles do not balance: {:.3g} % {} of what the source sends, with a standard "
      "error of {:.2g} %; the flux is not trusted: look for very thin or overlapping triangles, "
      "use more rays or --engine forward",
      shown(file), 100 * std::abs(off), off < 0 ? "are missing" : "are too many",
      100 * audit.balance_std_error));
}

// Rays along the longer sides cross the shorter ones too often to come to an end.
void require_sides_alike(const std::filesystem::path& file, const Box& box) {
  constexpr double most = 1e6;
  const double x = box.upper.x - box.lower.x;
  const double y = box.upper.y - box.lower.y;
  // Without a width it is refused by the flux.
  if (std::min(x, y) <= 0 || std::max(x, y) <= most * std::min(x, y)) return;
  throw InputError(fmt::format(
      "{}: is {:g} by {:g} wide, and sides that differ by more than a factor of {:g} are not "
      "traced; correct vertices that lie far away, or cut the mesh",
      shown(file), x, y, most));
}

// A source one spacing above would be seen past more mirror images of the mesh than can be crossed.
void require_spacing_of_mesh(const std::filesystem::path& file, double spacing, const Box& box) {
  const double width = std::min(box.upper.x - box.lower.x, box.upper.y - box.lower.y);
  constexpr double rounding = 1e-6;
  if (!(spacing > (1 + rounding) * width)) return;
  throw InputError(fmt::format(
      "--spacing {:g} is larger than {}, which is {:.3g} wide; give the spacing of the grid in the "
      "unit of the mesh",
      spacing, shown(file), width));
}

void warn_of_leaks(const FluxAudit& audit) {
  const double lost = share(audit.lost(), audit);
  if (lost <= most_lost) return;
  tell(fmt::format(
      "warning: {:.2g} % of the particles are lost: the mesh has holes, does not reach its "
      "sides, or faces down in places; its outside is where vertices go round "
      "counter-clockwise\n",
      100 * lost));
}

// Particles meet the facets all the same, from both sides if they have to.
void warn_of_fault(const TriMesh& mesh, const Sides& sides) {
  const auto fault = surface_fault(mesh, sides);
  if (!fault) return;
  tell(
      fmt::format("warning: the mesh is not the border of a solid: {} at ({:.4g}, {:.4g}, {:.4g}); "
                  "the flux there and nearby is meaningless\n",
                  fault->text, fault->r.x, fault->r.y, fault->r.z));
}

// A simplified mesh looks as if it came from a coarser grid, on whose scale the flux is resolved.
void warn_of_coarse_spacing(const TriMesh& mesh) {
  const std::optional<double> longest = edge_beyond_cells(mesh);
  if (!longest) return;
  tell(fmt::format(
      "warning: the mesh looks simplified, with edges up to {:.3g}; errors are those of patches of "
      "{:.3g}, four times a spacing guessed from its facets: give the grid spacing that it came "
      "from by --spacing\n",
      *longest, 4 * guessed_spacing(mesh)));
}

// Both engines have a least number of rays.
void tell_more_rays(const FluxOptions& options, const FluxField& flux) {
  const std::uint64_t asked = options.rays > 0 ? options.rays : options.max_rays;
  if (flux.rays <= asked) return;
  tell(fmt::format("note: {} rays instead of {}: {}\n", flux.rays, asked,
                   flux.engine == FluxEngine::gather ? "fewer cannot tell their error"
                                                     : "they come in whole batches of 32"));
}

}  // namespace

ExitCode execute(const FluxArguments& arguments, const CommonOptions& common) {
  const MeshFile file = read_mesh_file(arguments.mesh);
  if (!file.left_out.empty())
    Log(std::cerr).warn(shown(arguments.mesh) + ": " + left_out_text(file.left_out));
  const TriMesh& mesh = file.mesh;
  refuse_far_vertices(arguments.mesh, mesh);
  const Box box = bounding_box(mesh);
  require_spacing_of_mesh(arguments.mesh, arguments.options.spacing, box);
  require_sides_alike(arguments.mesh, box);
  FluxOptions options = arguments.options;
  options.sides = {.lower = {box.lower.x, box.lower.y},
                   .upper = {box.upper.x, box.upper.y},
                   .boundary = {arguments.boundary, arguments.boundary}};
  Species species;
  species.name = "particles";
  species.source.cosine_power = arguments.source_power;
  species.sticking = std::vector<float>(1, static_cast<float>(arguments.sticking));

  TriMesh bare = mesh;
  bare.materials.clear();
  const auto start = std::chrono::steady_clock::now();
  std::vector<FluxField> fields = solve_flux(bare, std::span(&species, 1), options);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  FluxField& flux = fields.front();
  book_missed(bare, species, options, flux.audit);
  require_balance(arguments.mesh, flux);
  if (!arguments.output.empty()) write_output(arguments.output, mesh, flux);
  if (!flux.target_reached()) {
    tell(fmt::format("warning: the error {:.3g} is above the target {:.3g}: {}\n", flux.error,
                     options.target_error,
                     missed_target_text(flux, options,
                                        {.max_rays = "--max-rays",
                                         .memory_limit = "",
                                         .engine = "--engine",
                                         .target = "--target-error"})));
  }

  warn_of_fault(mesh, options.sides);
  warn_of_leaks(flux.audit);
  if (options.spacing == 0) warn_of_coarse_spacing(mesh);
  if (!common.quiet) tell_more_rays(options, flux);
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
      {"balance_std_error", flux.audit.balance_std_error},
      {"error", flux.error},
      {"bias", flux.bias},
      {"max_facet_error", flux.max_facet_error},
      {"target_reached", nullptr}};
  // Without a target there is none to be reached.
  if (options.rays == 0) result["target_reached"] = flux.target_reached();
  if (common.json) {
    std::cout << result.dump(2) << '\n';
  } else {
    for (const auto& [key, value] : result.items()) fmt::print("{:16} {}\n", key, value.dump());
  }
  return done;
}

}  // namespace scarp
