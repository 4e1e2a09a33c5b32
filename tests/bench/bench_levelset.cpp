// The level set against OpenVDB's own tools on the same surface: whole time steps, extraction of
// the surface, extension of speeds; and how the cost grows with the domain. All on one thread, in
// CPU time, side by side in one process.
//
//   ./dev bench levelset [--json] [--cells N] [--repeats N]
//
// The surface: a plate with a square lattice of round blind holes, all edges sharp. It hangs in the
// gas, because OpenVDB's tools know no sides of a domain. Both work on the same leaves, and nodes
// are counted the same way: active voxels of the tree, before every step. The domains of growing
// size hold a wafer with such holes that goes through all sides.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "core/triangle_tree.h"
#include "levelset/grid/band.h"
#include "levelset/grid/distance.h"
#include "levelset/grid/redistance.h"
#include "levelset/motion/advect.h"
#include "levelset/motion/extend.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/extract_surface.h"
#include "tests/bench/bench_main.h"
#include "tests/bench/cpu_time.h"
#include "tests/bench/openvdb_peer.h"
#include "tests/levelset/speeds.h"

namespace scarp::bench {
namespace {

struct Settings {
  int cells = 256;
  int repeats = 3;
  bool json = false;
};

/// Lateral period, radius and depth of the holes, in spacings; the spacing is 1 nm.
constexpr int pitch = 64;
constexpr double hole_radius = 20.3;
constexpr double hole_depth = 40.4;
constexpr double plate_thickness = 56.7;

/// What the surface moves by in a time step, in spacings: the most that LevelSetMorphing takes at
/// once at first order.
constexpr double step_length = 0.17;
constexpr int steps = 4;

/// The least domain is two pitches wide; the largest has 64 times its area.
constexpr int width_factors[]{1, 2, 4, 8};

double from_hole_axis(double x) { return x - pitch * std::floor(x / pitch) - 0.5 * pitch; }

Distance distance_to_wafer(Vec3d r) {
  const double x = from_hole_axis(r.x);
  const double y = from_hole_axis(r.y);
  const double radius = std::max(std::hypot(x, y), 1e-9);
  const Distance top{r.z - 0.3, {0, 0, 1}};
  const Distance wall{hole_radius - radius, {-x / radius, -y / radius, 0}};
  const Distance floor{r.z + hole_depth, {0, 0, 1}};
  return intersect(top, unite(wall, floor));
}

Layers solid(int cells, double lower, const std::function<double(Vec3d)>& distance) {
  const Frame frame{.spacing = 1, .cells = {cells, cells}};
  Layers layers{.frame = frame, .stack = {}};
  layers.stack.push_back({0, LevelSet(frame, distance, lower - 6, 6)});
  return layers;
}

/// A wafer with holes, best a whole number of periods wide.
Layers wafer(int cells) {
  return solid(cells, -hole_depth, [](Vec3d r) { return distance_to_wafer(r).value; });
}

/// A part of that, just away from the sides.
Layers plate(int cells) {
  const double half = 0.5 * cells - 6.4;
  return solid(cells, -plate_thickness, [=](Vec3d r) {
    const Distance x{std::abs(r.x) - half, {std::copysign(1.0, r.x), 0, 0}};
    const Distance y{std::abs(r.y) - half, {0, std::copysign(1.0, r.y), 0}};
    const Distance below{-plate_thickness - r.z, {0, 0, -1}};
    return intersect(intersect(x, y), intersect(below, distance_to_wafer(r))).value;
  });
}

SpeedField uniform_speed(const Layers& layers) {
  return {.speed = std::vector<float>(layers.top().band().leaves().size() * leaf_size, 1.0F)};
}

/// Active nodes of all steps, and the least CPU time for them.
struct Cost {
  double nodes = 0;
  double seconds = 1e9;
  double moved = 0;  ///< spacings, of the flat surface amid four holes

  double rate() const { return nodes / seconds; }
};

void grow(Layers layers, Scheme scheme, Cost& cost) {
  cost.nodes = 0;
  const int middle = layers.frame.cells[0] / 2;
  const float before = layers.top().node(middle, middle, 1);
  const double seconds = cpu_seconds_of([&] {
    for (int n = 0; n < steps; ++n) {
      cost.nodes += static_cast<double>(layers.top().active_count());
      advect(layers, uniform_speed(layers), step_length, scheme);
    }
  });
  cost.seconds = std::min(cost.seconds, seconds);
  cost.moved = before - layers.top().node(middle, middle, 1);
}

void grow_peer(OpenVdbPeer peer, int middle, Scheme scheme, Cost& cost) {
  const float before = peer.node(middle, middle, 1);
  std::vector<std::size_t> counts;
  cost.seconds = std::min(cost.seconds,
                          cpu_seconds_of([&] { counts = peer.grow(scheme, steps, step_length); }));
  cost.nodes = 0;
  for (const std::size_t count : counts) cost.nodes += static_cast<double>(count);
  cost.moved = before - peer.node(middle, middle, 1);
}

const std::vector<std::pair<std::string, Scheme>>& schemes() {
  static const std::vector<std::pair<std::string, Scheme>> all{
      {"first_order", Scheme::first_order}, {"eno2", Scheme::eno2}, {"weno5", Scheme::weno5}};
  return all;
}

nlohmann::ordered_json json_of(const Cost& cost) {
  return {{"mvoxels_per_second_core", 1e-6 * cost.rate()},
          {"active_nodes_per_step", cost.nodes / steps},
          {"milliseconds_per_step", 1e3 * cost.seconds / steps},
          {"moved_spacings", cost.moved}};
}

/// Whole time steps, re-distancing and the change of the band included.
void compare_steps(const Layers& layers, int repeats, nlohmann::ordered_json& ratios,
                   nlohmann::ordered_json& absolute) {
  for (const auto& [name, scheme] : schemes()) {
    Cost ours;
    Cost morphing;
    for (int repeat = 0; repeat < repeats; ++repeat) {
      grow(layers.copy(), scheme, ours);
      grow_peer(OpenVdbPeer(layers.top()), layers.frame.cells[0] / 2, scheme, morphing);
    }
    ratios["advect_" + name + "_vs_morphing"] = ours.rate() / morphing.rate();
    if (scheme == Scheme::eno2) ratios["eno2_mvoxels_per_second_core"] = 1e-6 * ours.rate();
    absolute["advect_" + name] = json_of(ours);
    absolute["morphing_" + name] = json_of(morphing);
  }
}

/// Re-distancing alone, of a surface at rest.
void compare_tracking(const Layers& layers, int repeats, nlohmann::ordered_json& absolute) {
  double ours = 1e9;
  double tracker = 1e9;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    Layers own = layers.copy();
    ours = std::min(ours, cpu_seconds_of([&] { redistance(own.top().band(), Scheme::eno2); }));
    OpenVdbPeer peer(layers.top());
    tracker = std::min(tracker, cpu_seconds_of([&] { peer.track(); }));
  }
  absolute["redistance_milliseconds"] = 1e3 * ours;
  absolute["level_set_tracker_default_milliseconds"] = 1e3 * tracker;
}

/// Of the same band, both into arrays of vertices and of triangles or quads. Ours has vertices on
/// creases, the peer's has not. Beside them what a time step asks for: of the open gas, with
/// materials.
void compare_surfaces(const Layers& layers, int repeats, nlohmann::ordered_json& ratios,
                      nlohmann::ordered_json& absolute) {
  double ours = 1e9;
  double dual = 1e9;
  double of_step = 1e9;
  std::size_t vertices = 0;
  std::size_t dual_vertices = 0;
  const OpenVdbPeer peer(layers.top());
  const OpenGas gas = open_gas(layers);
  for (int repeat = 0; repeat < repeats; ++repeat) {
    ours = std::min(
        ours, cpu_seconds_of([&] { vertices = extract_surface(layers.top()).vertices.size(); }));
    dual = std::min(dual, cpu_seconds_of([&] { dual_vertices = peer.mesh(); }));
    of_step = std::min(of_step, cpu_seconds_of([&] { extract_surface(layers, gas); }));
  }
  ratios["marching_cubes_vs_volume_to_mesh"] = dual / ours;
  absolute["marching_cubes"] = {{"milliseconds", 1e3 * ours}, {"vertices", vertices}};
  absolute["marching_cubes_of_open_gas_milliseconds"] = 1e3 * of_step;
  absolute["volume_to_mesh"] = {{"milliseconds", 1e3 * dual}, {"vertices", dual_vertices}};
}

/// The closest point of the facets for every active node of the band.
SpeedField ask_for_every_node(const Layers& layers, const TriMesh& facets,
                              const CornerSpeeds& speeds) {
  const Band& band = layers.top().band();
  SpeedField field{.speed = std::vector<float>(band.leaves().size() * leaf_size)};
  const TriangleTree tree(facets);
  for (std::size_t n = 0; n < band.leaves().size(); ++n) {
    const Leaf& leaf = band.leaves()[n];
    for (int node = 0; node < leaf_size; ++node) {
      if (std::abs(leaf.phi[node]) >= LevelSet::half_width) continue;
      const Frame& frame = layers.frame;
      const ClosestPoint found = tree.closest(frame.node_position(node_at(leaf, node)),
                                              (LevelSet::half_width + 1) * frame.spacing);
      float& speed = field.speed[n * leaf_size + static_cast<std::size_t>(node)];
      for (std::size_t c = 0; found.found() && c < 3; ++c) {
        speed += static_cast<float>(found.barycentric[c]) * speeds[found.triangle][c];
      }
    }
  }
  return field;
}

/// The speed of a corner grows with its height, so that a wrong facet would show.
CornerSpeeds speeds_by_height(const TriMesh& facets) {
  CornerSpeeds speeds(facets.triangles.size());
  for (std::size_t f = 0; f < speeds.size(); ++f) {
    for (std::size_t c = 0; c < 3; ++c) {
      speeds[f][c] = 1 + 0.01F * facets.vertices[facets.triangles[f][c]].z;
    }
  }
  return speeds;
}

void compare_extension(const Layers& layers, int repeats, nlohmann::ordered_json& ratios,
                       nlohmann::ordered_json& absolute) {
  const OpenGas gas = open_gas(layers);
  const TriMesh facets = extract_surface(layers, gas);
  const CornerSpeeds speeds = speeds_by_height(facets);
  double ours = 1e9;
  double all = 1e9;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    ours = std::min(ours, cpu_seconds_of([&] { extend_speeds(layers, gas, facets, speeds); }));
    all = std::min(all, cpu_seconds_of([&] { ask_for_every_node(layers, facets, speeds); }));
  }
  ratios["extension_vs_all_point_queries"] = all / ours;
  absolute["extension_milliseconds"] = 1e3 * ours;
  absolute["all_point_queries_milliseconds"] = 1e3 * all;
}

/// What the level set does in a time step that is not the first one, per unit of area: gas,
/// surface, speeds, motion.
struct AreaCost {
  double stages = 1e9;  ///< gas, surface and speeds
  double advect = 1e9;

  double total() const { return stages + advect; }
};

void measure_area_cost(Layers layers, AreaCost& cost) {
  advect(layers, uniform_speed(layers), step_length);
  const double area = layers.frame.sides().area();
  SpeedField field;
  const double stages = cpu_seconds_of([&] {
    const OpenGas gas = open_gas(layers);
    const TriMesh facets = extract_surface(layers, gas);
    field = extend_speeds(layers, gas, facets, CornerSpeeds(facets.triangles.size(), {1, 1, 1}));
  });
  cost.stages = std::min(cost.stages, stages / area);
  cost.advect =
      std::min(cost.advect, cpu_seconds_of([&] { advect(layers, field, step_length); }) / area);
}

/// All areas in turn, so that what else the machine does falls on all of them alike.
void compare_areas(int repeats, nlohmann::ordered_json& ratios, nlohmann::ordered_json& absolute) {
  std::vector<Layers> wafers;
  for (const int factor : width_factors) wafers.push_back(wafer(2 * pitch * factor));
  std::vector<AreaCost> costs(wafers.size());
  for (int repeat = 0; repeat < repeats; ++repeat)
    for (std::size_t n = 0; n < wafers.size(); ++n) measure_area_cost(wafers[n].copy(), costs[n]);

  std::vector<double> totals;
  for (std::size_t n = 0; n < wafers.size(); ++n) {
    totals.push_back(costs[n].total());
    absolute["nanoseconds_per_area"][std::to_string(wafers[n].frame.cells[0])] = {
        {"total", 1e9 * costs[n].total()}, {"advect", 1e9 * costs[n].advect}};
  }
  const auto [least, most] = std::minmax_element(totals.begin(), totals.end());
  ratios["area_cost_spread"] = *most / *least;
}

void print(const nlohmann::ordered_json& result, const Settings& settings) {
  fmt::print(
      "A plate with round holes in {0} x {0} spacings; one thread, least CPU time of {1} runs.\n"
      "Whole steps of {2} spacings with re-distancing and change of the band. Nodes: active voxels "
      "before each step.\n\n",
      settings.cells, settings.repeats, step_length);
  for (const auto& [key, value] : result["ratios"].items()) {
    fmt::print("  {:40} {:.3f}\n", key, value.get<double>());
  }
  fmt::print("\n{}\n", result["absolute"].dump(2));
}

void run(const Settings& settings) {
  const ThreadLimit one_thread(1);
  nlohmann::ordered_json ratios;
  nlohmann::ordered_json absolute;
  const Layers layers = plate(settings.cells);
  compare_steps(layers, settings.repeats, ratios, absolute);
  compare_tracking(layers, settings.repeats, absolute);
  compare_surfaces(layers, settings.repeats, ratios, absolute);
  compare_extension(layers, settings.repeats, ratios, absolute);
  compare_areas(settings.repeats, ratios, absolute);
  ratios["bytes_per_active_node"] = static_cast<double>(layers.top().memory_bytes()) /
                                    static_cast<double>(layers.top().active_count());
  const nlohmann::ordered_json result{{"ratios", ratios}, {"absolute", absolute}};
  if (settings.json) {
    std::cout << result.dump(2) << '\n';
  } else {
    print(result, settings);
  }
}

}  // namespace
}  // namespace scarp::bench

int main(int argc, char** argv) {
  scarp::bench::Settings settings;
  const auto declare = [&](CLI::App& app) {
    app.add_option("--cells", settings.cells, "Width of the domain in spacings (256)")
        ->check(CLI::Range(64, 4096));
    app.add_option("--repeats", settings.repeats, "How often each is timed (3)")
        ->check(CLI::PositiveNumber);
    app.add_flag("--json", settings.json, "One object on standard output");
  };
  return scarp::bench::bench_main(argc, argv, "the level set against OpenVDB's tools", declare,
                                  [&] { scarp::bench::run(settings); });
}
