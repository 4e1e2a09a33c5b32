#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "core/region_mesh.h"
#include "core/triangle_tree.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/metrology/region_surface.h"
#include "mesh/regions/remesh.h"
#include "tests/mesh/self_intersections.h"

namespace scarp {

/// Directed edges of each meshed body that are not met once by each of two facets, one each way.
inline std::size_t open_edges(const RegionMesh& mesh) {
  std::size_t faults = 0;
  for (std::size_t body = 0; body < mesh.bodies.size(); ++body) {
    if (!mesh.regions[static_cast<std::size_t>(mesh.bodies[body].region)].is_meshed) continue;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const RegionMesh::Facet& facet : mesh.facets) {
      for (int side = 0; side < 2; ++side) {
        if (facet.bodies[static_cast<std::size_t>(side)] != static_cast<int>(body)) continue;
        for (std::size_t n = 0; n < 3; ++n) {
          const std::uint32_t a = facet.corners[n];
          const std::uint32_t b = facet.corners[(n + 1) % 3];
          ++edges[side == 0 ? std::pair(a, b) : std::pair(b, a)];
        }
      }
    }
    for (const auto& [edge, count] : edges) {
      const auto back = edges.find({edge.second, edge.first});
      faults += back == edges.end() || back->second != count ? 1 : 0;
    }
  }
  return faults;
}

/// Facets on sides with a corner that is not exactly there, or that face inwards.
inline std::size_t facets_off_sides(const RegionMesh& mesh) {
  std::size_t faults = 0;
  for (const RegionMesh::Facet& facet : mesh.facets) {
    if (facet.side == RegionMesh::nothing) continue;
    const int axis = facet.side / 2;
    const double wanted = facet.side % 2 == 0 ? mesh.lower[static_cast<std::size_t>(axis)]
                                              : mesh.upper[static_cast<std::size_t>(axis)];
    const auto r = corners(mesh, facet);
    const Vec3d n = cross(r[1] - r[0], r[2] - r[0]);
    const bool is_there = r[0][axis] == wanted && r[1][axis] == wanted && r[2][axis] == wanted;
    const bool faces_out = facet.side % 2 == 0 ? n[axis] < 0 : n[axis] > 0;
    faults += is_there && faces_out ? 0 : 1;
  }
  return faults;
}

/// Area of each side of the domain that facets cover.
inline double side_area(const RegionMesh& mesh, int side) {
  double area = 0;
  for (const RegionMesh::Facet& facet : mesh.facets) {
    const auto r = corners(mesh, facet);
    if (facet.side == side) area += length(cross(r[1] - r[0], r[2] - r[0])) / 2;
  }
  return area;
}

inline TriMesh all_facets(const RegionMesh& mesh) {
  TriMesh facets;
  for (const Vec3d& r : mesh.vertices) facets.vertices.emplace_back(r);
  for (const RegionMesh::Facet& facet : mesh.facets) facets.triangles.push_back(facet.corners);
  return facets;
}

inline RegionMesh remeshed(const Layers& layers, const RegionOptions& options, double size = 1) {
  const double h = layers.frame.spacing;
  return remesh(region_surface(layers, options), layer_surfaces(layers),
                {.spacing = h, .size = size * h, .max_distance = 0.05 * h});
}

/// Vertices that are nearer than that to a facet which they are no corner of.
inline std::size_t touching_vertices(const RegionMesh& mesh, double distance) {
  std::size_t count = 0;
  for (const RegionMesh::Facet& facet : mesh.facets) {
    const auto c = corners(mesh, facet);
    Box box;
    for (const Vec3d& r : c) {
      box.add(r - Vec3d{distance, distance, distance});
      box.add(r + Vec3d{distance, distance, distance});
    }
    for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
      const Vec3d& r = mesh.vertices[v];
      if (r.x < box.lower.x || r.y < box.lower.y || r.z < box.lower.z || r.x > box.upper.x ||
          r.y > box.upper.y || r.z > box.upper.z ||
          std::ranges::find(facet.corners, v) != facet.corners.end())
        continue;
      count += closest_on_triangle(r, c).distance < distance ? 1 : 0;
    }
  }
  return count;
}

/// What holds for every mesh: closed, conforming, on the sides, no thin facet, nothing crosses or
/// touches.
///
/// @param least_part of the spacing: the least altitude
inline void expect_sound(const RegionMesh& mesh, double spacing, double least_part = thin_part) {
  EXPECT_EQ(facets_off_sides(mesh), 0U);
  double least = 1e300;
  for (const RegionMesh::Facet& facet : mesh.facets) {
    const int region = mesh.bodies[static_cast<std::size_t>(facet.bodies[0])].region;
    if (mesh.is_flat && !mesh.regions[static_cast<std::size_t>(region)].is_meshed) continue;
    least = std::min(least, least_altitude(corners(mesh, facet)));
  }
  EXPECT_GE(least, least_part * spacing);
  if (mesh.is_flat) return;
  EXPECT_EQ(open_edges(mesh), 0U);
  EXPECT_EQ(self_intersections(all_facets(mesh)), 0U);
  EXPECT_EQ(touching_vertices(mesh, 1e-3 * spacing), 0U);
}

}  // namespace scarp
