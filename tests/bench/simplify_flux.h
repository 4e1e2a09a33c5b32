#pragma once

// What simplification saves in the flux, and whether the flux stays what it was.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "core/tri_mesh.h"
#include "core/triangle_tree.h"
#include "flux/solve.h"
#include "mesh/sides.h"
#include "mesh/simplify/simplify.h"
#include "tests/bench/surfaces.h"

namespace scarp::bench {

/// Two flux solutions to the same error, of an original and of its simplified mesh.
struct FluxComparison {
  double removed = 0;
  double simplify_seconds = std::numeric_limits<double>::infinity();
  double original_seconds = std::numeric_limits<double>::infinity();
  double simplified_seconds = std::numeric_limits<double>::infinity();
  double difference = 0;  ///< on patches, relative, root mean square
  double error = 0;       ///< what the errors of the two let expect of it

  double speedup() const { return original_seconds / simplified_seconds; }
  double speedup_with_simplification() const {
    return original_seconds / (simplified_seconds + simplify_seconds);
  }
  double difference_vs_error() const { return difference / error; }
};

inline FluxField flux_of(const TriMesh& mesh, const Sides& sides, double error,
                         std::uint64_t seed) {
  const std::vector<Species> species{{.name = "neutral", .sticking = {0.1F}}};
  FluxOptions options;
  options.sides = sides;
  options.spacing = 1;
  options.target_error = error;
  options.seed = seed;
  return std::move(solve_flux(mesh, species, options).front());
}

/// Root mean square over patches of 4 spacings, by area, of the difference divided by max(flux,
/// 0.05); as FluxOptions::target_error counts. Facets of the original find theirs by the nearest.
inline double flux_difference(const TriMesh& original, const FluxField& a,
                              const TriMesh& simplified, const FluxField& b) {
  struct Patch {
    double area = 0;
    double a = 0;
    double b = 0;
  };
  std::map<std::array<int, 3>, Patch> patches;
  const TriangleTree tree(simplified);
  const std::vector<double> areas = facet_areas(original);
  for (std::size_t f = 0; f < areas.size(); ++f) {
    const auto p = corners(original, f);
    const Vec3d middle = (p[0] + p[1] + p[2]) / 3.0;
    std::array<int, 3> key;
    for (int axis = 0; axis < 3; ++axis) key[axis] = static_cast<int>(std::floor(middle[axis] / 4));
    Patch& patch = patches[key];
    patch.area += areas[f];
    patch.a += areas[f] * a.arrivals().mean[f];
    patch.b += areas[f] * b.arrivals().mean[tree.closest(middle).triangle];
  }
  double squares = 0;
  double area = 0;
  for (const auto& [key, patch] : patches) {
    const double relative = (patch.a - patch.b) / std::max(patch.a, 0.05 * patch.area);
    squares += patch.area * relative * relative;
    area += patch.area;
  }
  return std::sqrt(squares / area);
}

inline FluxComparison compare_flux(const TriMesh& mesh, double removed, double error, int repeats) {
  FluxComparison result{.removed = removed};
  const SimplifyOptions options{.method = SimplifyMethod::curvature,
                                .sides = sides_of(mesh),
                                .remove = removed,
                                .measure = false};
  const auto shorten = [](double& seconds, const std::function<void()>& work) {
    seconds = std::min(seconds, seconds_of(work));
  };
  TriMesh simplified;
  FluxField a;
  FluxField b;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    shorten(result.simplify_seconds, [&] { simplified = simplify(mesh, options).mesh; });
    shorten(result.original_seconds, [&] { a = flux_of(mesh, options.sides, error, 1); });
    shorten(result.simplified_seconds, [&] { b = flux_of(simplified, options.sides, error, 2); });
  }
  result.difference = flux_difference(mesh, a, simplified, b);
  result.error = std::hypot(a.error, b.error);
  return result;
}

}  // namespace scarp::bench
