#pragma once

// What a benchmark of simplification measures of one result, and how it is written.

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/tri_mesh.h"
#include "mesh/distance.h"
#include "mesh/sides.h"
#include "tests/bench/svg_plot.h"
#include "tests/mesh/quality.h"
#include "tests/mesh/self_intersections.h"

namespace scarp::bench {

/// Vertices on two sides of the original that have none within a hundredth of the unit in the
/// result. Less strict than find_defects, which wants the same bits.
inline std::size_t lost_corners(const TriMesh& result, const TriMesh& original) {
  const Sides sides = sides_of(original);
  const auto on_side = [&sides](const Vec3f& r, int axis) {
    return r[axis] == sides.lower[axis] || r[axis] == sides.upper[axis];
  };
  std::size_t count = 0;
  for (const Vec3f& corner : original.vertices) {
    if (!on_side(corner, 0) || !on_side(corner, 1)) continue;
    const auto is_there = [&corner](const Vec3f& r) { return length(r - corner) < 0.01F; };
    count += std::any_of(result.vertices.begin(), result.vertices.end(), is_there) ? 0 : 1;
  }
  return count;
}

/// One line of the table. Distances in the unit of the mesh: forward from the original's vertices,
/// reverse from those of the result.
struct Row {
  std::string method;
  double removed = 0;
  double seconds = 1e9;
  std::size_t vertices = 0;
  SurfaceDistance distance{};
  AngleStatistics angles{};
  Defects defects{};
  std::size_t self_intersections = 0;

  void measure(const TriMesh& result, const TriMesh& original) {
    vertices = result.vertices.size();
    distance = surface_distance(original, result);
    angles = angle_statistics(result);
    defects = find_defects(result, original, sides_of(original));
    defects.lost_corners = lost_corners(result, original);
    self_intersections = scarp::self_intersections(result);
  }

  nlohmann::ordered_json json() const {
    nlohmann::ordered_json object{{"method", method},
                                  {"removed", removed},
                                  {"vertices", vertices},
                                  {"seconds", seconds},
                                  {"mean_minimum_angle", angles.mean_minimum},
                                  {"lowest_angle", angles.lowest},
                                  {"angles_below_20", angles.below_20},
                                  {"angles_below_5", angles.below_5},
                                  {"flipped", defects.flipped},
                                  {"zero_area", defects.zero_area},
                                  {"self_intersections", self_intersections},
                                  {"non_manifold_edges", defects.non_manifold_edges},
                                  {"off_plane", defects.off_plane},
                                  {"lost_corners", defects.lost_corners}};
    const auto add = [&object](const std::string& prefix, const DistanceStatistics& of) {
      object[prefix + "mean"] = of.mean;
      object[prefix + "max"] = of.max;
      object[prefix + "rms"] = of.rms;
      object[prefix + "p99"] = of.p99;
    };
    add("", distance.forward);
    add("reverse_", distance.reverse);
    return object;
  }

  static std::string headings() {
    return fmt::format(
        "{:>7} {:<16} {:>8} {:>8} | {:>8} {:>8} {:>7} {:>7} | {:>8} {:>8} {:>7} {:>7} | {:>5} "
        "{:>5} {:>5} | {:>5} {:>5} {:>5} {:>5} {:>5}\n",
        "removed", "method", "vertices", "time", "mean", "rms", "p99", "max", "back", "rms", "p99",
        "max", "angle", "<20", "<5", "flips", "cross", "edges", "off", "lost");
  }

  std::string line() const {
    const auto distances = [](const DistanceStatistics& of) {
      return fmt::format("{:>8.5f} {:>8.5f} {:>7.4f} {:>7.4f}", of.mean, of.rms, of.p99, of.max);
    };
    return fmt::format(
        "{:>6.0f}% {:<16} {:>8} {:>7.3f}s | {} | {} | {:>5.1f} {:>4.1f}% {:>4.1f}% | {:>5} {:>5} "
        "{:>5} {:>5} {:>5}\n",
        100 * removed, method, vertices, seconds, distances(distance.forward),
        distances(distance.reverse), angles.mean_minimum, 100 * angles.below_20,
        100 * angles.below_5, defects.flipped, self_intersections, defects.non_manifold_edges,
        defects.off_plane, defects.lost_corners);
  }
};

/// Four plots over the fraction removed, a line per method in the order of their first rows.
/// Distances beyond the scale are drawn at its ends: on flat parts they come down to rounding.
inline std::string plots_of(const std::string& name, const std::vector<Row>& rows) {
  const auto plot = [&](const std::string& title, double (*value)(const Row&)) {
    Plot result{name + ": " + title, "vertices removed [%]", {}};
    for (const Row& row : rows) {
      const auto series = std::find_if(result.series.begin(), result.series.end(),
                                       [&](const Series& s) { return s.name == row.method; });
      const std::pair point{100 * row.removed, value(row)};
      if (series == result.series.end()) {
        result.series.push_back({row.method, {point}});
      } else {
        series->points.push_back(point);
      }
    }
    return result;
  };
  return svg_of(
      {plot("mean distance",
            [](const Row& row) { return std::clamp(row.distance.forward.mean, 1e-5, 0.1); }),
       plot("greatest distance",
            [](const Row& row) { return std::clamp(row.distance.forward.max, 1e-4, 1.0); }),
       plot("mean smallest angle", [](const Row& row) { return row.angles.mean_minimum; }),
       plot("time [s]", [](const Row& row) { return row.seconds; })});
}

}  // namespace scarp::bench
