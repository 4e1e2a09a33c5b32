#pragma once

// What is wrong with a simplified mesh, found independently of mesh/simplify.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "core/frame.h"
#include "core/parallel.h"
#include "core/tri_mesh.h"
#include "core/triangle_tree.h"
#include "mesh/sides.h"

namespace scarp {

/// The shape of the facets of a mesh. Units: degrees.
struct AngleStatistics {
  double mean_minimum = 0;  ///< mean over the facets of their smallest angle
  double lowest = 0;        ///< smallest angle of all
  double below_5 = 0;       ///< fraction of facets with an angle below 5 degrees
  double below_20 = 0;
};

/// What a simplified mesh must not have, counted.
struct Defects {
  std::size_t non_manifold_edges = 0;  ///< more than two triangles, or two that disagree
  std::size_t zero_area = 0;
  std::size_t flipped = 0;       ///< flipped_facets()
  std::size_t off_plane = 0;     ///< vertices that have left their side, or lie beyond one
  std::size_t lost_corners = 0;  ///< vertices at a corner of the domain that are not there any more
};

namespace quality_detail {

constexpr std::size_t grain = 1024;
constexpr double degrees = 180 / 3.14159265358979323846;

/// Smallest angle of a triangle in degrees. For reports only: the arc tangent's last bits may
/// differ between machines.
inline double smallest_angle(const std::array<Vec3d, 3>& p) {
  double smallest = 180;
  for (int i = 0; i < 3; ++i) {
    const Vec3d a = p[(i + 1) % 3] - p[i];
    const Vec3d b = p[(i + 2) % 3] - p[i];
    smallest = std::min(smallest, std::atan2(length(cross(a, b)), dot(a, b)) * degrees);
  }
  return smallest;
}

using Edge = std::array<std::uint32_t, 2>;

inline std::vector<Edge> sorted_half_edges(const TriMesh& mesh) {
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) edges.push_back({t[i], t[(i + 1) % 3]});
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

inline std::size_t count_non_manifold(const std::vector<Edge>& edges) {
  std::size_t count = 0;
  for (std::size_t i = 1; i < edges.size(); ++i) count += edges[i] == edges[i - 1] ? 1 : 0;
  return count;
}

/// The vertices that triangles use, by where they lie in them.
struct UsedVertices {
  std::vector<Vec3d> boundary;
  std::vector<Vec3d> inner;
};

inline UsedVertices used_vertices(const TriMesh& mesh, const std::vector<Edge>& edges) {
  enum : std::uint8_t { unused, inner, boundary };
  std::vector<std::uint8_t> use(mesh.vertices.size(), unused);
  for (const Edge& e : edges) {
    const bool is_boundary = !std::binary_search(edges.begin(), edges.end(), Edge{e[1], e[0]});
    for (const std::uint32_t v : e)
      use[v] = std::max<std::uint8_t>(use[v], is_boundary ? boundary : inner);
  }
  UsedVertices used;
  for (std::size_t v = 0; v < use.size(); ++v) {
    if (use[v] == boundary) used.boundary.emplace_back(mesh.vertices[v]);
    if (use[v] == inner) used.inner.emplace_back(mesh.vertices[v]);
  }
  return used;
}

inline std::size_t count_off_plane(const std::vector<Vec3d>& boundary, const SidePlanes& planes) {
  return static_cast<std::size_t>(std::count_if(
      boundary.begin(), boundary.end(), [&planes](Vec3d r) { return planes.mask(r) == 0; }));
}

inline std::size_t count_beyond(const std::vector<Vec3d>& inner, const SidePlanes& planes) {
  return static_cast<std::size_t>(
      std::count_if(inner.begin(), inner.end(), [&planes](Vec3d r) { return !planes.hold(r); }));
}

inline std::size_t count_lost_corners(const TriMesh& simplified, const TriMesh& original,
                                      const SidePlanes& planes) {
  std::set<std::array<float, 3>> corners;
  for (const Vec3f& r : original.vertices) {
    if (is_corner(planes.mask(Vec3d(r)))) corners.insert({r.x, r.y, r.z});
  }
  for (const Vec3f& r : simplified.vertices) corners.erase({r.x, r.y, r.z});
  return corners.size();
}

/// Whether a facet looks away from what lies around its middle.
inline bool is_flipped(const TriangleTree& original, const std::array<Vec3d, 3>& p) {
  const Vec3d n = cross(p[1] - p[0], p[2] - p[0]);
  const Vec3d middle = (p[0] + p[1] + p[2]) / 3.0;
  const double longest = std::max({length(p[1] - p[0]), length(p[2] - p[1]), length(p[0] - p[2])});
  const double near = original.closest(middle).distance + 0.01 * longest;
  return !original.closest_facing(middle, n, near).found();
}

}  // namespace quality_detail

/// The facets of a simplified mesh whose normal is turned by more than 90 degrees against every
/// facet of the original within a hundredth of their longest edge (and against the closest) of
/// their middle.
inline std::vector<std::uint32_t> flipped_facets(const TriMesh& simplified,
                                                 const TriMesh& original) {
  const TriangleTree tree(original);
  std::vector<std::uint8_t> flipped(simplified.triangles.size(), 0);
  parallel_for(flipped.size(), quality_detail::grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      flipped[f] = quality_detail::is_flipped(tree, corners(simplified, f)) ? 1 : 0;
    }
  });
  std::vector<std::uint32_t> facets;
  for (std::uint32_t f = 0; f < flipped.size(); ++f) {
    if (flipped[f] != 0) facets.push_back(f);
  }
  return facets;
}

inline AngleStatistics angle_statistics(const TriMesh& mesh) {
  AngleStatistics result{.lowest = 180};
  const auto count = static_cast<double>(mesh.triangles.size());
  if (mesh.triangles.empty()) return {};
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const double angle = quality_detail::smallest_angle(corners(mesh, f));
    result.mean_minimum += angle / count;
    result.lowest = std::min(result.lowest, angle);
    result.below_5 += angle < 5 ? 1 / count : 0;
    result.below_20 += angle < 20 ? 1 / count : 0;
  }
  return result;
}

/// Compares a simplified mesh with what it came from.
///
/// Boundary vertices count as off their plane only if every boundary vertex of the original lies on
/// one; other vertices where they lie beyond a side, only if none of the original does.
inline Defects find_defects(const TriMesh& simplified, const TriMesh& original,
                            const Sides& sides) {
  const SidePlanes planes(sides);
  const std::vector<quality_detail::Edge> edges = quality_detail::sorted_half_edges(simplified);
  Defects defects;
  defects.non_manifold_edges = quality_detail::count_non_manifold(edges);
  for (const double area : facet_areas(simplified)) defects.zero_area += area > 0 ? 0 : 1;
  defects.flipped = flipped_facets(simplified, original).size();
  const quality_detail::UsedVertices before =
      quality_detail::used_vertices(original, quality_detail::sorted_half_edges(original));
  const quality_detail::UsedVertices after = quality_detail::used_vertices(simplified, edges);
  if (quality_detail::count_off_plane(before.boundary, planes) == 0) {
    defects.off_plane += quality_detail::count_off_plane(after.boundary, planes);
  }
  if (quality_detail::count_beyond(before.inner, planes) == 0) {
    defects.off_plane += quality_detail::count_beyond(after.inner, planes);
  }
  defects.lost_corners = quality_detail::count_lost_corners(simplified, original, planes);
  return defects;
}

}  // namespace scarp
