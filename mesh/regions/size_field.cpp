#include "mesh/regions/size_field.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "core/region_mesh.h"

namespace scarp {

namespace {

/// Surfaces nearer to each other than this, in spacings, are one: there is no film between them.
constexpr double no_film = 0.1;

/// Cosine of the angle between neighbouring triangles from which on a surface bends: 6 degrees, as
/// with a radius of some eight spacings.
constexpr double bent = 0.9945;

/// Edges at which a surface bends, as triangles without area.
void add_bends(const TriMesh& surface, double spacing, TriMesh& details) {
  const std::vector<Vec3f> normals = facet_normals(surface);
  const double least_altitude_of_normals = 0.01 * spacing;  // rounding turns those of thinner ones
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> facet_at;
  for (std::uint32_t f = 0; f < surface.triangles.size(); ++f) {
    const Triangle& t = surface.triangles[f];
    if (least_altitude({Vec3d(surface.vertices[t[0]]), Vec3d(surface.vertices[t[1]]),
                        Vec3d(surface.vertices[t[2]])}) < least_altitude_of_normals)
      continue;
    for (std::size_t n = 0; n < 3; ++n) {
      const std::pair<std::uint32_t, std::uint32_t> edge = std::minmax(t[n], t[(n + 1) % 3]);
      const auto [other, is_first] = facet_at.try_emplace(edge, f);
      if (is_first || dot(Vec3d(normals[f]), Vec3d(normals[other->second])) > bent) continue;
      const auto v = static_cast<std::uint32_t>(details.vertices.size());
      details.vertices.push_back(surface.vertices[edge.first]);
      details.vertices.push_back(surface.vertices[edge.second]);
      details.triangles.push_back({v, v + 1, v + 1});
    }
  }
}

/// Triangles of a surface that are near another one.
void add_films(const TriMesh& surface, const TriangleTree& other, double spacing,
               TriMesh& details) {
  for (const Triangle& t : surface.triangles) {
    const Vec3d a(surface.vertices[t[0]]);
    const Vec3d b(surface.vertices[t[1]]);
    const Vec3d c(surface.vertices[t[2]]);
    const std::array<Vec3d, 4> places{(a + b + c) / 3.0, 0.5 * (a + b), 0.5 * (b + c),
                                      0.5 * (c + a)};
    const bool has_film = std::ranges::any_of(places, [&](const Vec3d& r) {
      const ClosestPoint closest = other.closest(r, spacing);
      return closest.found() && closest.distance > no_film * spacing;
    });
    if (!has_film) continue;
    const auto v = static_cast<std::uint32_t>(details.vertices.size());
    for (const std::uint32_t corner : t) details.vertices.push_back(surface.vertices[corner]);
    details.triangles.push_back({v, v + 1, v + 2});
  }
}

}  // namespace

SizeField::SizeField(std::span<const TriMesh> surfaces, double spacing, double size)
    : spacing_(spacing), size_(size) {
  TriMesh details;
  std::vector<TriangleTree> trees;
  for (const TriMesh& surface : surfaces) {
    add_bends(surface, spacing, details);
    trees.emplace_back(surface);
  }
  for (std::size_t k = 0; k < surfaces.size(); ++k)
    for (std::size_t m = 0; m < surfaces.size(); ++m)
      if (m != k) add_films(surfaces[k], trees[m], spacing, details);
  details_ = TriangleTree(details);
}

double SizeField::at(const Vec3d& r) const {
  const ClosestPoint closest = details_.closest(r, (size_ - spacing_) / growth);
  return closest.found() ? std::min(size_, spacing_ + growth * closest.distance) : size_;
}

double SizeField::of_facet(const std::array<Vec3d, 3>& corners) const {
  return std::min({at(corners[0]), at(corners[1]), at(corners[2])});
}

double relative_altitude(const std::array<Vec3d, 3>& corners, const SizeField& targets,
                         double enough) {
  const double altitude = least_altitude(corners);
  if (altitude >= enough * targets.largest()) return enough;
  return std::min(enough, altitude / targets.of_facet(corners));
}

}  // namespace scarp
