#pragma once

// Who removes vertices from a surface: scarp's own methods, and the peers that are installed.

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "core/tri_mesh.h"

namespace scarp::bench {

/// One simplification that is ready to run. Only `run` is timed.
struct Job {
  std::function<void()> run;
  std::function<TriMesh()> result;
};

/// Brings a surface to a number of vertices; the mesh outlives the job.
struct Method {
  std::string name;
  std::function<Job(const TriMesh& mesh, std::size_t vertices)> prepare;
};

/// A library with methods of its own, and where Debian has it. No methods: not installed.
struct Peer {
  std::string package;
  std::vector<Method> methods{};
};

Peer cgal_peer();
Peer meshoptimizer_peer();
Peer openmesh_peer();
Peer vtk_peer();

/// For peers that count facets: how many are left with that many vertices, sides not counted.
inline std::size_t facets_left(const TriMesh& mesh, std::size_t vertices) {
  return mesh.triangles.size() - 2 * (mesh.vertices.size() - vertices);
}

}  // namespace scarp::bench
