#pragma once

// What flights and time the flux of a feature takes up to an error: gathering, forward tracing, and
// the plain tracer. All on one thread, and the error is that of FluxOptions::target_error for each.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "flux/rays/patches.h"
#include "flux/solve.h"
#include "mesh/sides.h"
#include "tests/bench/cpu_time.h"
#include "tests/bench/plain_tracer.h"
#include "tests/mesh/generated_surface.h"

namespace scarp::bench {

/// A trench or a round hole, 20 spacings wide, as marching cubes give it.
struct Feature {
  enum class Kind { trench, hole };
  Kind kind = Kind::trench;
  int aspect_ratio = 1;
  float sticking = 1;

  std::string name() const {
    return (kind == Kind::trench ? "trench" : "hole") + std::to_string(aspect_ratio);
  }
};

inline TriMesh mesh_of(const Feature& feature) {
  constexpr double half_width = 10;
  constexpr int field = 4;  // on each side
  const int depth = 20 * feature.aspect_ratio;
  const bool is_hole = feature.kind == Feature::Kind::hole;
  constexpr int width = 20 + 2 * field;
  const Grid grid{.cells = {width, is_hole ? width : 16, depth + 4}};
  const auto shape = [=](Vec3d r) {
    const double x = r.x - 0.5 * width;
    const double y = is_hole ? r.y - 0.5 * width : 0;
    const double cut = std::max(std::hypot(x, y) - half_width, 2.3 - r.z);
    return std::max(r.z - (depth + 2.3), -cut);
  };
  return polygonised(grid, shape);
}

/// Flights and CPU seconds up to an error, and that error.
struct CostToError {
  double segments = 0;
  double cpu = 0;
  double error = 0;
};

/// What is measured at some error, as it would be at another: the error of independent particles
/// falls as the root of their number.
inline CostToError at_error(const CostToError& cost, double target) {
  const double more = (cost.error / target) * (cost.error / target);
  return {.segments = cost.segments * more, .cpu = cost.cpu * more, .error = target};
}

inline std::vector<Species> species_of(const Feature& feature) {
  return {{.name = "gas", .sticking = {feature.sticking}}};
}

/// The mean over some seeds: with some of them it takes a round of rays more. The error is the root
/// of the mean square of what they state, somewhat below the target.
inline CostToError gathered(const TriMesh& mesh, const Feature& feature, double target) {
  constexpr int seeds = 8;
  CostToError cost;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    FluxField field;
    cost.cpu += cpu_seconds_of([&] {
                  field = solve_flux(mesh, species_of(feature),
                                     {.engine = FluxOptions::Engine::gather,
                                      .sides = sides_of(mesh),
                                      .spacing = 1,
                                      .target_error = target,
                                      .seed = seed})
                              .front();
                }) /
                seeds;
    if (!field.target_reached())
      throw InputError("the gathered flux of " + feature.name() + " does not reach its target");
    cost.segments += static_cast<double>(field.segments) / seeds;
    cost.error += field.error * field.error / seeds;
  }
  cost.error = std::sqrt(cost.error);
  return cost;
}

inline CostToError forward(const TriMesh& mesh, const Feature& feature, std::uint64_t rays) {
  FluxField field;
  const double cpu = cpu_seconds_of([&] {
    field = solve_flux(mesh, species_of(feature),
                       {.engine = FluxOptions::Engine::forward,
                        .sides = sides_of(mesh),
                        .spacing = 1,
                        .rays = rays})
                .front();
  });
  return {static_cast<double>(field.segments), cpu, field.error};
}

/// The spread between batches tells the error.
inline CostToError plain(const TriMesh& mesh, const Feature& feature, std::uint64_t rays) {
  constexpr std::size_t batches = 32;
  const Sides sides = sides_of(mesh);
  PlainTracer tracer(mesh, sides, feature.sticking);
  std::vector<std::vector<double>> sums{std::vector<double>(mesh.triangles.size())};
  CostToError cost;
  cost.cpu = cpu_seconds_of([&] {
    for (std::uint64_t batch = 1; batch <= batches; ++batch) {
      cost.segments += static_cast<double>(tracer.trace(rays / batches, batch));
      sums.push_back(tracer.arrived());
    }
  });
  const RayScene scene(mesh, sides, 1);
  const Patches patches(mesh, scene);
  const double weight = scene.source_area() / static_cast<double>(rays / batches);
  const auto in_batch = [&](std::size_t f, std::size_t batch) {
    return weight * (sums[batch + 1][f] - sums[batch][f]) / scene.area(f);
  };
  const auto mean = [&](std::size_t f) {
    return weight * sums.back()[f] / scene.area(f) / static_cast<double>(batches);
  };
  const FluxEstimate estimated = estimate(scene, patches,
                                          {.flux = mean,
                                           .deviations =
                                               [&](std::size_t f, std::span<double> of_facet) {
                                                 for (std::size_t b = 0; b < of_facet.size(); ++b)
                                                   of_facet[b] = in_batch(f, b) - mean(f);
                                               },
                                           .count = batches,
                                           .divisor = batches * (batches - 1.0),
                                           .unseen = weight / static_cast<double>(batches)});
  cost.error = estimated.error;
  return cost;
}

}  // namespace scarp::bench
