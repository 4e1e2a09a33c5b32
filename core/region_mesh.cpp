#include "core/region_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>

namespace scarp {

double least_altitude(const std::array<Vec3d, 3>& corners) {
  const Vec3d a = corners[1] - corners[0];
  const Vec3d b = corners[2] - corners[0];
  const Vec3d c = corners[2] - corners[1];
  const double longest = std::sqrt(std::max({dot(a, a), dot(b, b), dot(c, c)}));
  return longest > 0 ? length(cross(a, b)) / longest : 0;
}

double shape_of(const std::array<Vec3d, 3>& corners) {
  const Vec3d a = corners[1] - corners[0];
  const Vec3d b = corners[2] - corners[0];
  const Vec3d c = corners[2] - corners[1];
  const double longest = std::max({dot(a, a), dot(b, b), dot(c, c)});
  return longest > 0 ? length(cross(a, b)) / longest : 0;
}

std::array<Vec3d, 3> corners(const RegionMesh& mesh, const RegionMesh::Facet& facet) {
  return {mesh.vertices[facet.corners[0]], mesh.vertices[facet.corners[1]],
          mesh.vertices[facet.corners[2]]};
}

std::vector<double> region_volumes(const RegionMesh& mesh) {
  std::vector<double> volumes(mesh.regions.size());
  // Of a flat mesh the area; else a pyramid over each facet, from a corner of the domain.
  const Vec3d origin{mesh.lower[0], mesh.lower[1], mesh.lower[2]};
  for (const RegionMesh::Facet& facet : mesh.facets) {
    const auto [a, b, c] = corners(mesh, facet);
    const double volume = mesh.is_flat ? length(cross(b - a, c - a)) / 2
                                       : dot(a - origin, cross(b - origin, c - origin)) / 6;
    for (int n = 0; n < 2; ++n) {
      const int body = facet.bodies[static_cast<std::size_t>(n)];
      if (body == RegionMesh::nothing) continue;
      const auto region =
          static_cast<std::size_t>(mesh.bodies[static_cast<std::size_t>(body)].region);
      volumes[region] += n == 0 ? volume : -volume;
    }
  }
  for (std::size_t n = 0; n < volumes.size(); ++n)
    if (!mesh.regions[n].is_meshed) volumes[n] = 0;
  return volumes;
}

std::uint8_t sides_at(const RegionMesh& mesh, const Vec3d& r) {
  std::uint8_t sides = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (mesh.is_flat && axis == 1) continue;
    const auto n = static_cast<std::size_t>(axis);
    if (r[axis] == mesh.lower[n]) sides |= static_cast<std::uint8_t>(1U << (2 * n));
    if (r[axis] == mesh.upper[n]) sides |= static_cast<std::uint8_t>(2U << (2 * n));
  }
  return sides;
}

std::vector<RegionLine> lines_of(const RegionMesh& flat) {
  using Edge = std::array<std::uint32_t, 2>;
  std::map<Edge, std::size_t> facet_of;
  for (std::size_t f = 0; f < flat.facets.size(); ++f)
    for (std::size_t n = 0; n < 3; ++n)
      facet_of[{flat.facets[f].corners[n], flat.facets[f].corners[(n + 1) % 3]}] = f;
  std::vector<RegionLine> lines;
  for (const RegionMesh::Facet& facet : flat.facets) {
    for (std::size_t n = 0; n < 3; ++n) {
      const Edge edge{facet.corners[n], facet.corners[(n + 1) % 3]};
      const auto other = facet_of.find({edge[1], edge[0]});
      RegionLine line{.ends = edge, .bodies = {facet.bodies[0], RegionMesh::nothing}};
      if (other == facet_of.end()) {
        const unsigned sides =
            sides_at(flat, flat.vertices[edge[0]]) & sides_at(flat, flat.vertices[edge[1]]);
        for (int side = RegionMesh::side_count - 1; side >= 0; --side)
          if ((sides >> static_cast<unsigned>(side) & 1U) != 0) line.side = side;
      } else {
        const RegionMesh::Facet& beyond = flat.facets[other->second];
        line.bodies[1] = beyond.bodies[0];
        // Both see the line: it counts as that of the lower layer.
        if (line.bodies[0] == line.bodies[1] || facet.layer > beyond.layer) continue;
        if (facet.layer == beyond.layer && line.bodies[0] > line.bodies[1]) continue;
        line.layer = facet.layer;
      }
      lines.push_back(line);
    }
  }
  return lines;
}

namespace {

/// A facet on a side, or an edge there of a flat mesh: the number of its material, and its corners
/// as they are seen along the axis.
struct SideElement {
  int material = RegionMesh::nothing;
  std::vector<std::array<double, 2>> corners{};

  auto operator<=>(const SideElement&) const =
      default;  // NOLINT(modernize-use-nullptr): no pointer
};

std::vector<SideElement> elements_on(const RegionMesh& mesh, int side) {
  const int across = side < 2 ? 1 : 0;
  std::vector<SideElement> elements;
  const auto add = [&](int body, std::span<const std::uint32_t> corners) {
    const int region = mesh.bodies[static_cast<std::size_t>(body)].region;
    SideElement element;
    if (mesh.regions[static_cast<std::size_t>(region)].kind == MeshRegion::Kind::material)
      element.material = region;
    for (const std::uint32_t v : corners)
      element.corners.push_back({mesh.is_flat ? 0 : mesh.vertices[v][across], mesh.vertices[v].z});
    std::ranges::sort(element.corners);
    elements.push_back(std::move(element));
  };
  if (mesh.is_flat) {
    for (const RegionLine& line : lines_of(mesh))
      if (line.side == side) add(line.bodies[0], line.ends);
  } else {
    for (const RegionMesh::Facet& facet : mesh.facets)
      if (facet.side == side) add(facet.bodies[0], facet.corners);
  }
  std::ranges::sort(elements);
  return elements;
}

}  // namespace

bool sides_match(const RegionMesh& mesh, int axis) {
  return elements_on(mesh, 2 * axis) == elements_on(mesh, 2 * axis + 1);
}

namespace {

/// How far a ray from outside of a triangle goes until it meets it.
std::optional<double> distance_along(const Vec3d& from, const Vec3d& u,
                                     const std::array<Vec3d, 3>& t) {
  const Vec3d a = t[1] - t[0];
  const Vec3d b = t[2] - t[0];
  const Vec3d p = cross(u, b);
  const double determinant = dot(a, p);
  if (determinant == 0) return std::nullopt;
  const Vec3d s = from - t[0];
  const double alpha = dot(s, p) / determinant;
  const Vec3d q = cross(s, a);
  const double beta = dot(u, q) / determinant;
  constexpr double room = 1e-9;  // at edges both facets count
  if (alpha < -room || beta < -room || alpha + beta > 1 + room) return std::nullopt;
  return dot(b, q) / determinant;
}

}  // namespace

std::vector<std::optional<Vec3d>> inner_points(const RegionMesh& mesh) {
  constexpr std::size_t tried = 8;  // of the largest facets
  std::vector<std::optional<Vec3d>> points;
  for (std::size_t body = 0; body < mesh.bodies.size(); ++body) {
    std::vector<std::pair<double, std::size_t>> largest;
    for (std::size_t f = 0; f < mesh.facets.size(); ++f) {
      const RegionMesh::Facet& facet = mesh.facets[f];
      if (facet.bodies[0] != static_cast<int>(body) && facet.bodies[1] != static_cast<int>(body))
        continue;
      largest.emplace_back(-least_altitude(corners(mesh, facet)), f);
    }
    std::ranges::sort(largest);
    largest.resize(std::min(largest.size(), tried));
    double deepest = 0;
    std::optional<Vec3d> point;
    for (const auto& [altitude, f] : largest) {
      const auto [a, b, c] = corners(mesh, mesh.facets[f]);
      const Vec3d centre = (a + b + c) / 3.0;
      const Vec3d out = normalized(cross(b - a, c - a));
      const Vec3d u = mesh.facets[f].bodies[0] == static_cast<int>(body) ? -out : out;
      double depth = std::numeric_limits<double>::infinity();
      for (std::size_t other = 0; other < mesh.facets.size(); ++other) {
        if (other == f) continue;
        const auto distance = distance_along(centre, u, corners(mesh, mesh.facets[other]));
        if (distance && *distance > 0) depth = std::min(depth, *distance);
      }
      if (depth > deepest && std::isfinite(depth)) {
        deepest = depth;
        point = centre + 0.5 * depth * u;
      }
    }
    points.push_back(point);
  }
  return points;
}

}  // namespace scarp
