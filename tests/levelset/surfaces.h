#pragma once

#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "core/frame.h"
#include "core/tri_mesh.h"
#include "levelset/grid/layers.h"
#include "levelset/metrology/material_bodies.h"
#include "levelset/motion/advect.h"
#include "levelset/start/shapes.h"
#include "tests/levelset/speeds.h"

namespace scarp {

inline Layers single_layer(const Frame& frame, const std::function<double(Vec3d)>& distance,
                           double lower, double upper) {
  Layers layers{.frame = frame, .stack = {}};
  layers.stack.push_back({0, LevelSet(frame, distance, lower, upper)});
  return layers;
}

/// Moves the surface with the given speeds for a time, in steps of the given length at most.
inline void move(Layers& layers, double time, double max_dt,
                 const std::function<double(Vec3d, MaterialId)>& speed,
                 Scheme scheme = Scheme::eno2) {
  const auto steps = static_cast<int>(std::ceil(time / max_dt - 1e-9));
  for (int step = 0; step < steps; ++step) {
    advect(layers, prescribe_speeds(layers, speed), time / steps, scheme);
  }
}

/// phi at both ends of each edge of the grid that the surface cuts, between two heights.
inline std::vector<float> phi_next_to_surface(const LevelSet& phi, int lower, int upper) {
  std::vector<float> found;
  const auto [cells_x, cells_y] = phi.frame().cells;
  for (int i = 0; i < cells_x; ++i) {
    for (int j = 0; j < cells_y; ++j) {
      for (int k = lower; k < upper; ++k) {
        const float here = phi.node(i, j, k);
        for (const float there :
             {phi.node(i + 1, j, k), phi.node(i, j + 1, k), phi.node(i, j, k + 1)}) {
          if ((here < 0) != (there < 0)) found.insert(found.end(), {here, there});
        }
      }
    }
  }
  return found;
}

/// What is wrong with a mesh that should be closed up to the sides of the domain.
struct MeshFaults {
  int non_manifold_edges = 0;  ///< a directed edge used more than once
  int boundary_off_sides = 0;  ///< boundary edges that do not lie on a side
  int zero_area = 0;
  int unused_vertices = 0;
  int boundary_edges = 0;  ///< not a fault
};

inline MeshFaults faults(const TriMesh& mesh, const Frame& frame) {
  MeshFaults found;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  std::vector<bool> used(mesh.vertices.size(), false);
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    for (int c = 0; c < 3; ++c) {
      ++edges[{mesh.triangles[f][c], mesh.triangles[f][(c + 1) % 3]}];
      used[mesh.triangles[f][c]] = true;
    }
    found.zero_area += length(area_vector(mesh, f)) > 0 ? 0 : 1;
  }
  for (const bool u : used) {
    found.unused_vertices += u ? 0 : 1;
  }
  const Sides sides = frame.sides();
  for (const auto& [edge, count] : edges) {
    found.non_manifold_edges += count > 1 ? 1 : 0;
    if (edges.contains({edge.second, edge.first})) {
      continue;
    }
    ++found.boundary_edges;
    bool on_side = false;
    for (int axis = 0; axis < 2; ++axis) {
      for (const double wall : {sides.lower[axis], sides.upper[axis]}) {
        const auto w = static_cast<float>(wall);
        on_side = on_side ||
                  (mesh.vertices[edge.first][axis] == w && mesh.vertices[edge.second][axis] == w);
      }
    }
    found.boundary_off_sides += on_side ? 0 : 1;
  }
  return found;
}

}  // namespace scarp
