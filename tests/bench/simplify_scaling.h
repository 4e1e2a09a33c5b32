#pragma once

// What the removal of one vertex costs, and how much memory it takes, from small to large surfaces.

#include <malloc.h>

#include <algorithm>
#include <ctime>
#include <fstream>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "core/tri_mesh.h"
#include "mesh/sides.h"
#include "mesh/simplify/simplify.h"
#include "tests/bench/surfaces.h"
#include "tests/mesh/generated_surface.h"

namespace scarp::bench {

/// A surface with mirrored copies of itself on its sides, count x count in all, joined.
///
/// The mesh spans [0, width] x [0, depth] with whole numbers, so that copies meet exactly.
inline TriMesh mirrored_tiles(const TriMesh& mesh, float width, float depth, int count) {
  TriMesh result;
  std::map<std::tuple<float, float, float>, std::uint32_t> on_sides;
  const auto tile = [](float x, float size, int i) {
    const auto corner = static_cast<float>(i) * size;
    return i % 2 == 0 ? corner + x : corner + (size - x);
  };
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      std::vector<std::uint32_t> place;
      for (const Vec3f& r : mesh.vertices) {
        const Vec3f p{tile(r.x, width, i), tile(r.y, depth, j), r.z};
        const auto next = static_cast<std::uint32_t>(result.vertices.size());
        const bool on_side = r.x == 0 || r.x == width || r.y == 0 || r.y == depth;
        place.push_back(on_side ? on_sides.try_emplace({p.x, p.y, p.z}, next).first->second : next);
        if (place.back() == next) result.vertices.push_back(p);
      }
      for (Triangle t : mesh.triangles) {
        if ((i + j) % 2 == 1) std::swap(t[1], t[2]);
        result.triangles.push_back({place[t[0]], place[t[1]], place[t[2]]});
      }
    }
  }
  return result;
}

/// A figure of /proc/self/status. Units: bytes.
inline double memory(const std::string& key) {
  std::ifstream status("/proc/self/status");
  std::string word;
  double kilobytes = 0;
  while (status >> word) {
    if (word == key + ":" && status >> kilobytes) break;
  }
  return 1024 * kilobytes;
}

/// Times on one core and on all of them; memory beside the input.
struct Cost {
  std::size_t vertices = 0;
  double cpu_per_removed = 1e9;  ///< us
  double per_removed = 1e9;      ///< us
  double bytes_per_vertex = 0;
};

inline Cost cost_of(const TriMesh& mesh, SimplifyMethod method, int repeats) {
  constexpr double removed = 0.78;
  const auto count = static_cast<double>(mesh.vertices.size());
  const SimplifyOptions options{
      .method = method, .sides = sides_of(mesh), .remove = removed, .measure = false};
  Cost cost{.vertices = mesh.vertices.size()};
  for (int repeat = 0; repeat < repeats; ++repeat) {
    malloc_trim(0);
    std::ofstream("/proc/self/clear_refs") << 5;  // the peak starts from what there is now
    const double before = memory("VmRSS");
    const std::clock_t start = std::clock();
    const double seconds = seconds_of([&] { simplify(mesh, options); });
    const double cpu = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    cost.cpu_per_removed = std::min(cost.cpu_per_removed, 1e6 * cpu / (removed * count));
    cost.per_removed = std::min(cost.per_removed, 1e6 * seconds / (removed * count));
    cost.bytes_per_vertex = std::max(cost.bytes_per_vertex, (memory("VmHWM") - before) / count);
  }
  return cost;
}

/// From about 20 thousand to 5 million vertices of the same surface.
inline std::vector<TriMesh> growing_surfaces() {
  const Grid grid{.cells = {110, 78, 76}, .noise = 0.006, .seed = 1};
  const TriMesh tile = polygonised(grid, via_array(grid.cells[0], grid.cells[1], 60));
  std::vector<TriMesh> surfaces;
  for (int count = 1; count <= 16; count *= 2) {
    surfaces.push_back(mirrored_tiles(tile, static_cast<float>(grid.cells[0]),
                                      static_cast<float>(grid.cells[1]), count));
  }
  return surfaces;
}

/// The dearest vertex against the cheapest.
inline double spread(const std::vector<Cost>& costs) {
  const auto [least, most] = std::minmax_element(
      costs.begin(), costs.end(),
      [](const Cost& a, const Cost& b) { return a.cpu_per_removed < b.cpu_per_removed; });
  return most->cpu_per_removed / least->cpu_per_removed;
}

}  // namespace scarp::bench
