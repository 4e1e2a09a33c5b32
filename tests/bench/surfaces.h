#pragma once

// The surfaces that benchmarks run on.

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "core/tri_mesh.h"

namespace scarp::bench {

struct Surface {
  std::string name;
  TriMesh mesh;
};

inline double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Those of the files; without files what runs of scarp leave: an array of vias after deposition,
/// deep trenches after etching, a trench with scallops.
std::vector<Surface> surfaces_of(const std::vector<std::string>& files);

/// The last full surface of configs/trench_deposition.toml, in the unit of its spacing.
Surface trench_deposition();

}  // namespace scarp::bench
