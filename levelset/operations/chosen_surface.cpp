#include "levelset/operations/chosen_surface.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "levelset/surface/extract_surface.h"

namespace scarp {

namespace {

/// How far a point of the surface is from where some layers end: below 0 where they are seen.
class Seen {
 public:
  Seen(const Layers& layers, std::span<const MaterialId> materials)
      : layers_(layers), spacing_(layers.frame.spacing) {
    for (std::size_t n = 0; n < layers.stack.size(); ++n)
      if (std::ranges::find(materials, layers.stack[n].material) != materials.end())
        chosen_.push_back(n);
  }

  double operator()(Vec3d r, Vec3d normal) const {
    double nearest = infinity;
    for (const std::size_t layer : chosen_) {
      const double below = layer == 0 ? infinity : covered(layer - 1, r, normal);
      nearest = std::min(nearest, std::max(covered(layer, r, normal), -below));
    }
    const double most = LevelSet::half_width * spacing_;
    return std::clamp(nearest, -most, most);
  }

 private:
  static constexpr double infinity = std::numeric_limits<double>::infinity();
  static constexpr double thinnest = 0.1;  // spacings; a film that is known to lie on a layer

  /// How far other layers lie over a layer and those below it, or how far it is to them: < 0 where
  /// it is seen. Outside, the body tells how thick they are; beside an edge of theirs only inside,
  /// beyond where the top cuts the body, and on both sides of the edge.
  double covered(std::size_t layer, Vec3d r, Vec3d normal) const {
    if (layer + 1 == layers_.stack.size()) return -infinity;
    const LevelSet& body = layers_.stack[layer].phi;
    const Vec3d half = (0.5 * spacing_) * normal;
    // At an edge one side alone tells that nothing lies between.
    const double thickness =
        std::min(above(body, r - half), above(body, r + half)) - thinnest * spacing_;
    const std::optional<double> edge = inside(body, r, normal);
    return edge && thickness < 0 ? *edge : std::max(edge.value_or(-infinity), thickness);
  }

  double above(const LevelSet& body, Vec3d r) const {
    return body.distance(r) - layers_.top().distance(r);
  }

  /// Nothing where solid ends behind.
  std::optional<double> inside(const LevelSet& body, Vec3d r, Vec3d normal) const {
    for (const double depth : {1.5, 1.0, 0.5}) {
      const Vec3d at = r - (depth * spacing_) * normal;
      if (layers_.top().distance(at) < -0.5 * depth * spacing_) return body.distance(at);
    }
    return std::nullopt;
  }

  const Layers& layers_;
  double spacing_;
  std::vector<std::size_t> chosen_;
};

/// Facets that share a vertex with one that is chosen while they are not, or the other way round;
/// and those that share a vertex with these.
std::vector<bool> near_borders(const TriMesh& mesh, const std::vector<bool>& chosen) {
  std::vector<bool> near(chosen.size(), false);
  std::vector<std::array<bool, 2>> touches(mesh.vertices.size(), {false, false});
  for (std::size_t f = 0; f < chosen.size(); ++f)
    for (const std::uint32_t v : mesh.triangles[f]) touches[v][chosen[f] ? 1 : 0] = true;
  std::vector<bool> is_border(mesh.vertices.size());
  for (std::size_t v = 0; v < touches.size(); ++v) is_border[v] = touches[v][0] && touches[v][1];
  for (int ring = 0; ring < 2; ++ring) {
    for (std::size_t f = 0; f < chosen.size(); ++f)
      near[f] = near[f] || std::ranges::any_of(mesh.triangles[f],
                                               [&](std::uint32_t v) { return is_border[v]; });
    for (std::size_t f = 0; f < chosen.size(); ++f)
      for (const std::uint32_t v : mesh.triangles[f]) is_border[v] = is_border[v] || near[f];
  }
  return near;
}

/// The part of a triangle where a number that its corners have is below 0: up to four corners.
std::vector<Vec3d> part_below_zero(const std::array<Vec3d, 3>& corners,
                                   const std::array<double, 3>& values) {
  std::vector<Vec3d> part;
  for (std::size_t n = 0; n < 3; ++n) {
    const std::size_t next = (n + 1) % 3;
    if (values[n] < 0) part.push_back(corners[n]);
    if ((values[n] < 0) == (values[next] < 0)) continue;
    // From the end that is below 0, so that neighbours cut their edge at the same place.
    const std::size_t from = values[n] < 0 ? n : next;
    const std::size_t to = n + next - from;
    const double along = values[from] / (values[from] - values[to]);
    part.push_back(corners[from] + along * (corners[to] - corners[from]));
  }
  return part;
}

void add_fan(std::span<const Vec3d> polygon, TriMesh& mesh) {
  for (std::size_t n = 2; n < polygon.size(); ++n) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const Vec3d& r : {polygon[0], polygon[n - 1], polygon[n]}) mesh.vertices.emplace_back(r);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
}

}  // namespace

TriMesh chosen_surface(const Layers& layers, const OpenGas& gas,
                       std::span<const MaterialId> materials) {
  const TriMesh all = extract_surface(layers, gas);
  std::vector<bool> chosen(all.triangles.size());
  for (std::size_t f = 0; f < chosen.size(); ++f)
    chosen[f] = std::ranges::find(materials, all.materials[f]) != materials.end();
  const std::vector<bool> near = near_borders(all, chosen);
  const Seen seen(layers, materials);
  TriMesh found;
  for (std::size_t f = 0; f < chosen.size(); ++f) {
    const std::array<Vec3d, 3> at = corners(all, f);
    if (!near[f]) {
      if (chosen[f]) add_fan(at, found);
      continue;
    }
    const Vec3d normal = normalized(area_vector(all, f));
    std::array<double, 3> values{};
    for (std::size_t n = 0; n < 3; ++n) values[n] = seen(at[n], normal);
    add_fan(part_below_zero(at, values), found);
  }
  return found;
}

}  // namespace scarp
