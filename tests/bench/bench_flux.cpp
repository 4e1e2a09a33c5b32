// Flux: flights per second of forward tracing against a plain tracer and against nothing but
// rtcIntersect1 on the plain tracer's rays; all threads against one; cost against facets; flights
// and time to an error, of ions too; a time step of the default recipe. CPU time, side by side in
// one process.
//
//   ./dev bench flux [MESH...] [--json] [--rays N] [--repeats N] [--table]
//
// Lengths are in spacings of the grid. Without files, the surfaces of tests/bench/surfaces, which
// runs of scarp leave. Sides are those of the bounding box, and mirrors.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "flux/solve.h"
#include "mesh/sides.h"
#include "tests/bench/bench_main.h"
#include "tests/bench/cpu_time.h"
#include "tests/bench/flux_to_error.h"
#include "tests/bench/plain_tracer.h"
#include "tests/bench/surfaces.h"
#include "tests/bench/time_step.h"
#include "tests/flux/ion_traces.h"
#include "tests/mesh/generated_surface.h"

namespace scarp::bench {
namespace {

struct Settings {
  std::vector<std::string> files;
  std::uint64_t rays = 1 << 22;  // thirty and more per facet, as a flux of some percent takes
  int repeats = 3;
  bool table = false;
  bool json = false;
};

constexpr float sticking = 0.1F;

/// The width of the least surface of growing size, in spacings; the largest has 64 times its
/// facets.
constexpr int least_width = 16;
constexpr int width_factors[]{1, 2, 4, 8};
constexpr std::uint64_t gathered_rays_per_facet = 16;

/// Flights, and the least time for them.
struct Cost {
  double segments = 0;
  double cpu = 1e9;
  double wall = 1e9;

  double rate() const { return segments / cpu; }
};

FluxField solve(const TriMesh& mesh, FluxOptions::Engine engine, std::uint64_t rays) {
  const Species species{.name = "gas", .sticking = {sticking}};
  return solve_flux(mesh, {&species, 1},
                    {.engine = engine, .sides = sides_of(mesh), .spacing = 1, .rays = rays})
      .front();
}

/// Everything is in the time: the grid of cells, patches, sums, standard errors.
void trace(const TriMesh& mesh, FluxOptions::Engine engine, std::uint64_t rays, Cost& cost) {
  FluxField field;
  double cpu = 0;
  cost.wall = std::min(cost.wall, seconds_of([&] {
                         cpu = cpu_seconds_of([&] { field = solve(mesh, engine, rays); });
                       }));
  cost.cpu = std::min(cost.cpu, cpu);
  cost.segments = static_cast<double>(field.segments);
}

nlohmann::ordered_json json_of(const Cost& cost, std::uint64_t rays) {
  return {{"msegments_per_cpu_second", 1e-6 * cost.rate()},
          {"segments_per_ray", cost.segments / static_cast<double>(rays)}};
}

/// On one thread. The plain tracer's time is that of its flights only: Embree's tree is not in it.
void compare_with_plain(const Surface& surface, const std::string& name, const Settings& settings,
                        nlohmann::ordered_json& result) {
  const ThreadLimit one_thread(1);
  // Enough for a mean, and few enough to be kept.
  const std::uint64_t recorded_rays = std::min<std::uint64_t>(settings.rays, 1 << 17);
  PlainTracer tracer(surface.mesh, sides_of(surface.mesh), sticking);
  std::vector<PlainRay> recorded;
  const auto recorded_segments = static_cast<double>(tracer.trace(recorded_rays, 1, &recorded));
  Cost own;
  Cost plain;
  Cost bare{.segments = recorded_segments};
  for (int repeat = 0; repeat < settings.repeats; ++repeat) {
    trace(surface.mesh, FluxOptions::Engine::forward, settings.rays, own);
    plain.cpu = std::min(plain.cpu, cpu_seconds_of([&] {
                           plain.segments = static_cast<double>(tracer.trace(settings.rays, 1));
                         }));
    bare.cpu = std::min(bare.cpu, cpu_seconds_of([&] { tracer.fly_again(recorded); }));
  }
  result["ratios"]["forward_vs_intersect1_" + name] = own.rate() / plain.rate();
  result["ratios"]["forward_vs_bare_intersect1_" + name] = own.rate() / bare.rate();
  result["absolute"][name] = {{"surface", surface.name},
                              {"facets", surface.mesh.triangles.size()},
                              {"forward", json_of(own, settings.rays)},
                              {"plain", json_of(plain, settings.rays)},
                              {"bare_intersect1", json_of(bare, recorded_rays)}};
}

/// The time on all threads, and what the flights cost there more than on one.
void compare_threads(const Surface& surface, const Settings& settings,
                     nlohmann::ordered_json& result) {
  Cost one;
  Cost all;
  for (int repeat = 0; repeat < settings.repeats; ++repeat) {
    trace(surface.mesh, FluxOptions::Engine::forward, settings.rays, all);
    const ThreadLimit one_thread(1);
    trace(surface.mesh, FluxOptions::Engine::forward, settings.rays, one);
  }
  result["ratios"]["forward_threads_speedup"] = one.wall / all.wall;
  result["ratios"]["forward_threads_cpu"] = all.cpu / one.cpu;
  result["absolute"]["threads"] = thread_count();
}

/// Deep trenches of growing size, with as many rays per facet.
void compare_facets(int repeats, nlohmann::ordered_json& result) {
  const ThreadLimit one_thread(1);
  std::vector<double> per_facet;
  for (const int factor : width_factors) {
    const int width = least_width * factor;
    const TriMesh mesh =
        polygonised({.cells = {width, width, width + 20}}, deep_trenches(width, width));
    const std::uint64_t facets = mesh.triangles.size();
    Cost gather;
    Cost forward;
    for (int repeat = 0; repeat < repeats; ++repeat) {
      trace(mesh, FluxOptions::Engine::gather, gathered_rays_per_facet * facets, gather);
      trace(mesh, FluxOptions::Engine::forward, facets, forward);
    }
    per_facet.push_back(gather.cpu / static_cast<double>(facets));
    result["absolute"]["microseconds_per_facet"][std::to_string(facets)] = {
        {"gather", 1e6 * per_facet.back()},
        {"forward", 1e6 * forward.cpu / static_cast<double>(facets)}};
  }
  const auto [least, most] = std::minmax_element(per_facet.begin(), per_facet.end());
  result["ratios"]["facet_cost_spread"] = *most / *least;
}

/// How many times fewer flights and less time gathering with a target of 1 % takes than the plain
/// tracer to the error that it reached.
void compare_to_error(const Settings& settings, nlohmann::ordered_json& result) {
  const ThreadLimit one_thread(1);
  constexpr double target = 0.01;
  const Feature trench{.kind = Feature::Kind::trench, .aspect_ratio = 4, .sticking = 0.1F};
  const Feature hole{.kind = Feature::Kind::hole, .aspect_ratio = 20, .sticking = 0.01F};
  for (const Feature& feature : {trench, hole}) {
    const TriMesh mesh = mesh_of(feature);
    CostToError measured = plain(mesh, feature, settings.rays);
    CostToError gather = gathered(mesh, feature, target);
    for (int repeat = 1; repeat < settings.repeats; ++repeat) {
      measured.cpu = std::min(measured.cpu, plain(mesh, feature, settings.rays).cpu);
      gather.cpu = std::min(gather.cpu, gathered(mesh, feature, target).cpu);
    }
    const CostToError forward = at_error(measured, gather.error);
    const bool is_trench = feature.kind == Feature::Kind::trench;
    nlohmann::ordered_json& ratios = result["ratios"];
    if (is_trench) ratios["gather_segments_vs_forward_a4_s01"] = forward.segments / gather.segments;
    ratios[is_trench ? "gather_time_vs_forward_a4_s01" : "gather_time_vs_forward_hole20_s001"] =
        forward.cpu / gather.cpu;
    result["absolute"]["to_error_" + feature.name()] = {
        {"facets", mesh.triangles.size()},
        {"error", gather.error},
        {"gather", {{"segments", gather.segments}, {"cpu_s", gather.cpu}}},
        {"plain", {{"segments", forward.segments}, {"cpu_s", forward.cpu}}}};
  }
}

/// What auto decides by (flux/solve.cpp): how much area sticks for that of the source, by the root
/// of the error.
double area_that_sticks(const TriMesh& mesh, const Feature& feature, double target) {
  double area = 0;
  for (const double a : facet_areas(mesh)) area += a;
  return feature.sticking * area / sides_of(mesh).area() * std::sqrt(target);
}

bool auto_gathers(const TriMesh& mesh, const Feature& feature, double target) {
  const FluxOptions options{
      .sides = sides_of(mesh), .spacing = 1, .target_error = target, .max_rays = 1};
  return solve_flux(mesh, species_of(feature), options).front().engine == FluxEngine::gather;
}

/// Flights and CPU time of both engines and the plain tracer on all features, and what auto takes.
void print_table(const Settings& settings) {
  const ThreadLimit one_thread(1);
  fmt::print(
      "| feature | sticking | error | sticks | gather | | forward | | plain | | auto | takes |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const Feature::Kind kind : {Feature::Kind::trench, Feature::Kind::hole}) {
    for (const int aspect_ratio : {1, 4, 10, 20}) {
      for (const float each : {1.0F, 0.5F, 0.2F, 0.1F, 0.01F}) {
        const Feature feature{kind, aspect_ratio, each};
        const TriMesh mesh = mesh_of(feature);
        const CostToError own = forward(mesh, feature, settings.rays);
        const CostToError other = plain(mesh, feature, settings.rays);
        for (const double target : {0.03, 0.01, 0.003}) {
          const CostToError gather = gathered(mesh, feature, target);
          const CostToError f = at_error(own, target);
          const CostToError p = at_error(other, target);
          const bool gathers = auto_gathers(mesh, feature, target);
          const double more = gathers ? gather.segments / f.segments : f.segments / gather.segments;
          fmt::print(
              "| {} | {:g} | {:g} % | {:.2f} | {:.3g} M | {:.3g} s | {:.3g} M | {:.3g} s | {:.3g} "
              "M "
              "| {:.3g} s | {} | {:.2g} |\n",
              feature.name(), each, 100 * target, area_that_sticks(mesh, feature, target),
              1e-6 * gather.segments, gather.cpu, 1e-6 * f.segments, f.cpu, 1e-6 * p.segments,
              p.cpu, gathers ? "gather" : "forward", more);
        }
      }
    }
  }
}

/// Ions of n = 500 with coned reflection, to 1 %, in a trench and a hole four times as deep as
/// wide.
void compare_ions(int repeats, nlohmann::ordered_json& result) {
  const ThreadLimit one_thread(1);
  Species ions = exact::plasma_ions();
  ions.source.cosine_power = 500;
  for (const bool is_hole : {false, true}) {
    const exact::Shape shape = is_hole ? exact::hole(4) : exact::trench(4, 4, 8, 40);
    const auto to_target = [&](FluxOptions::Engine engine) {
      Cost cost;
      for (int repeat = 0; repeat < repeats; ++repeat) {
        FluxField field;
        const double cpu = cpu_seconds_of(
            [&] { field = exact::trace(shape, ions, {.engine = engine, .target_error = 0.01}); });
        cost.cpu = std::min(cost.cpu, cpu);
        cost.segments = static_cast<double>(field.segments);
      }
      return cost;
    };
    const Cost forward = to_target(FluxOptions::Engine::forward);
    const Cost gathered = to_target(FluxOptions::Engine::gather);
    const std::string name = is_hole ? "hole4" : "trench4";
    result["ratios"]["ion_rays_forward_vs_gather_" + name] = forward.segments / gathered.segments;
    result["ratios"]["ion_time_forward_vs_gather_" + name] = forward.cpu / gathered.cpu;
    result["absolute"]["ions_" + name] = {{"facets", shape.mesh.triangles.size()},
                                          {"forward_segments", forward.segments},
                                          {"gather_segments", gathered.segments},
                                          {"forward_cpu_seconds", forward.cpu},
                                          {"gather_cpu_seconds", gathered.cpu}};
  }
}

/// What part of the time steps of the default trench the flux takes, and how many times less the
/// first one takes than without simplification and with particles from the source, to the same
/// error.
void compare_time_steps(int repeats, nlohmann::ordered_json& result) {
  const ThreadLimit one_thread(1);
  const double own = first_time_step({}, repeats);
  const double plain = first_time_step({"simplify.enabled=false", "flux.engine=\"forward\""}, 1);
  result["ratios"]["time_step_vs_unsimplified_forward"] = plain / own;
  result["ratios"]["time_step_flux_share"] = flux_share_of_run();
  result["absolute"]["time_step_cpu_seconds"] = {{"default", own}, {"unsimplified_forward", plain}};
}

void run(const Settings& settings) {
  if (settings.table) return print_table(settings);
  nlohmann::ordered_json result;
  const std::vector<Surface> surfaces = surfaces_of(settings.files);
  for (std::size_t n = 0; n < surfaces.size(); ++n)
    compare_with_plain(surfaces[n], fmt::format("surface{}", n + 1), settings, result);
  compare_threads(surfaces.front(), settings, result);
  compare_facets(settings.repeats, result);
  compare_to_error(settings, result);
  compare_ions(settings.repeats, result);
  compare_time_steps(settings.repeats, result);
  if (settings.json) {
    std::cout << result.dump(2) << '\n';
    return;
  }
  fmt::print("Cosine source, sticking {}; {} rays, least CPU time of {} runs.\n\n", sticking,
             settings.rays, settings.repeats);
  for (const auto& [key, value] : result["ratios"].items())
    fmt::print("  {:40} {:.3f}\n", key, value.get<double>());
  fmt::print("\n{}\n", result["absolute"].dump(2));
}

}  // namespace
}  // namespace scarp::bench

int main(int argc, char** argv) {
  scarp::bench::Settings settings;
  const auto declare = [&](CLI::App& app) {
    app.add_option("mesh", settings.files, "Surfaces: .obj .ply .stl .vtp .obj.gz");
    app.add_option("--rays", settings.rays, "Particles per run (4194304)")
        ->check(CLI::PositiveNumber);
    app.add_option("--repeats", settings.repeats, "How often each is timed (3)")
        ->check(CLI::PositiveNumber);
    app.add_flag("--table", settings.table,
                 "Instead: flights and time to errors, on trenches and holes");
    app.add_flag("--json", settings.json, "One object on standard output");
  };
  return scarp::bench::bench_main(argc, argv,
                                  "flux: flights per second, threads, cost against facets", declare,
                                  [&] { scarp::bench::run(settings); });
}
