#include "mesh/quality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "core/parallel.h"
#include "core/triangle_tree.h"
#include "mesh/sides.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 1024;
constexpr double degrees = 180 / 3.14159265358979323846;

/// Smallest angle of a triangle in degrees. For reports only: the arc tangent's last bits may
/// differ between machines.
double smallest_angle(const std::array<Vec3d, 3>& p) {
  double smallest = 180;
  for (int i = 0; i < 3; ++i) {
    const Vec3d a = p[(i + 1) % 3] - p[i];
    const Vec3d b = p[(i + 2) % 3] - p[i];
    smallest = std::min(smallest, std::atan2(length(cross(a, b)), dot(a, b)) * degrees);
  }
  return smallest;
}

using Edge = std::array<std::uint32_t, 2>;

std::vector<Edge> sorted_half_edges(const TriMesh& mesh) {
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) edges.push_back({t[i], t[(i + 1) % 3]});
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

std::size_t count_non_manifold(const std::vector<Edge>& edges) {
  std::size_t count = 0;
  for (std::size_t i = 1; i < edges.size(); ++i) count += edges[i] == edges[i - 1] ? 1 : 0;
  return count;
}

/// The vertices that triangles use, by where they lie in them.
struct UsedVertices {
  std::vector<Vec3d> boundary;
  std::vector<Vec3d> inner;
};

UsedVertices used_vertices(const TriMesh& mesh, const std::vector<Edge>& edges) {
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

std::size_t count_off_plane(const std::vector<Vec3d>& boundary, const SidePlanes& planes) {
  return static_cast<std::size_t>(std::count_if(
      boundary.begin(), boundary.end(), [&planes](Vec3d r) { return planes.mask(r) == 0; }));
}

std::size_t count_beyond(const std::vector<Vec3d>& inner, const SidePlanes& planes) {
  return static_cast<std::size_t>(
      std::count_if(inner.begin(), inner.end(), [&planes](Vec3d r) { return !planes.hold(r); }));
}

std::size_t count_lost_corners(const TriMesh& simplified, const TriMesh& original,
                               const SidePlanes& planes) {
  std::set<std::array<float, 3>> corners;
  for (const Vec3f& r : original.vertices) {
    if (is_corner(planes.mask(Vec3d(r)))) corners.insert({r.x, r.y, r.z});
  }
  for (const Vec3f& r : simplified.vertices) corners.erase({r.x, r.y, r.z});
  return corners.size();
}

/// Whether a facet looks away from what lies around its middle.
bool is_flipped(const TriangleTree& original, const std::array<Vec3d, 3>& p) {
  const Vec3d n = cross(p[1] - p[0], p[2] - p[0]);
  const Vec3d middle = (p[0] + p[1] + p[2]) / 3.0;
  const double longest = std::max({length(p[1] - p[0]), length(p[2] - p[1]), length(p[0] - p[2])});
  const double near = original.closest(middle).distance + 0.01 * longest;
  return !original.closest_facing(middle, n, near).found();
}

}  // namespace

std::vector<std::uint32_t> flipped_facets(const TriMesh& simplified, const TriMesh& original) {
  const TriangleTree tree(original);
  std::vector<std::uint8_t> flipped(simplified.triangles.size(), 0);
  parallel_for(flipped.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      flipped[f] = is_flipped(tree, corners(simplified, f)) ? 1 : 0;
    }
  });
  std::vector<std::uint32_t> facets;
  for (std::uint32_t f = 0; f < flipped.size(); ++f) {
    if (flipped[f] != 0) facets.push_back(f);
  }
  return facets;
}

AngleStatistics angle_statistics(const TriMesh& mesh) {
  AngleStatistics result{.lowest = 180};
  const auto count = static_cast<double>(mesh.triangles.size());
  if (mesh.triangles.empty()) return {};
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const double angle = smallest_angle(corners(mesh, f));
    result.mean_minimum += angle / count;
    result.lowest = std::min(result.lowest, angle);
    result.below_5 += angle < 5 ? 1 / count : 0;
    result.below_20 += angle < 20 ? 1 / count : 0;
  }
  return result;
}

Defects find_defects(const TriMesh& simplified, const TriMesh& original, const Sides& sides) {
  const SidePlanes planes(sides);
  const std::vector<Edge> edges = sorted_half_edges(simplified);
  Defects defects;
  defects.non_manifold_edges = count_non_manifold(edges);
  for (const double area : facet_areas(simplified)) defects.zero_area += area > 0 ? 0 : 1;
  defects.flipped = flipped_facets(simplified, original).size();
  const UsedVertices before = used_vertices(original, sorted_half_edges(original));
  const UsedVertices after = used_vertices(simplified, edges);
  if (count_off_plane(before.boundary, planes) == 0) {
    defects.off_plane += count_off_plane(after.boundary, planes);
  }
  if (count_beyond(before.inner, planes) == 0) {
    defects.off_plane += count_beyond(after.inner, planes);
  }
  defects.lost_corners = count_lost_corners(simplified, original, planes);
  return defects;
}

Sides sides_of(const TriMesh& mesh) {
  const Box box = bounding_box(mesh);
  Sides sides;
  for (int axis = 0; axis < 2; ++axis) {
    sides.lower[axis] = box.lower[axis];
    sides.upper[axis] = box.upper[axis];
  }
  return sides;
}

}  // namespace scarp
