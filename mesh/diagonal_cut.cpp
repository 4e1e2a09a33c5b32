#include "mesh/diagonal_cut.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

namespace scarp {

namespace {

class DiagonalCut {
 public:
  DiagonalCut(const TriMesh& surface, const Sides& sides, double spacing);

  TriMesh result();

 private:
  std::uint32_t place(std::uint32_t v);
  std::uint32_t place_on_diagonal(Vec3f r);
  std::uint32_t cut_edge(std::uint32_t below, std::uint32_t above);
  void add(std::size_t facet, std::span<const std::uint32_t> corners);

  const TriMesh& surface_;
  std::array<float, 2> ends_;  // of the diagonal
  std::vector<float> side_;    // of each vertex: x - y, 0 on the diagonal
  std::map<std::uint32_t, std::uint32_t> below_;
  // By place, x and z: a vertex and its image meet there, and so do cuts of edges with them.
  std::map<std::pair<float, float>, std::uint32_t> on_diagonal_;
  TriMesh result_;
};

DiagonalCut::DiagonalCut(const TriMesh& surface, const Sides& sides, double spacing)
    : surface_(surface),
      ends_{static_cast<float>(sides.lower[0]), static_cast<float>(sides.upper[0])} {
  constexpr double close = 1e-3;  // spacings
  for (const Vec3f& r : surface.vertices) {
    const float side = r.x - r.y;
    side_.push_back(std::abs(side) <= close * spacing ? 0 : side);
  }
}

std::uint32_t DiagonalCut::place(std::uint32_t v) {
  const Vec3f r = surface_.vertices[v];
  if (side_[v] == 0) {
    const auto is_end = [&](float at) { return at == ends_[0] || at == ends_[1]; };
    const float inside = is_end(r.y) ? r.y : 0.5F * (r.x + r.y);
    const float at = is_end(r.x) ? r.x : inside;
    return place_on_diagonal({at, at, r.z});
  }
  const auto [found, is_new] =
      below_.try_emplace(v, static_cast<std::uint32_t>(result_.vertices.size()));
  if (is_new) result_.vertices.push_back(r);
  return found->second;
}

std::uint32_t DiagonalCut::place_on_diagonal(Vec3f r) {
  const auto [found, is_new] =
      on_diagonal_.try_emplace({r.x, r.z}, static_cast<std::uint32_t>(result_.vertices.size()));
  if (is_new) result_.vertices.push_back(r);
  return found->second;
}

std::uint32_t DiagonalCut::cut_edge(std::uint32_t below, std::uint32_t above) {
  const Vec3d a(surface_.vertices[below]);
  const Vec3d b(surface_.vertices[above]);
  const double part = side_[below] / (static_cast<double>(side_[below]) - side_[above]);
  const Vec3d r = a + part * (b - a);
  const double middle = 0.5 * (r.x + r.y);
  return place_on_diagonal(Vec3f(Vec3d{middle, middle, r.z}));
}

// What met on the diagonal leaves some triangles without an area.
void DiagonalCut::add(std::size_t facet, std::span<const std::uint32_t> corners) {
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
    const Triangle t{corners[0], corners[k], corners[k + 1]};
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    result_.triangles.push_back(t);
    if (!surface_.materials.empty()) result_.materials.push_back(surface_.materials[facet]);
  }
}

TriMesh DiagonalCut::result() {
  for (std::size_t f = 0; f < surface_.triangles.size(); ++f) {
    const Triangle& t = surface_.triangles[f];
    if (std::ranges::none_of(t, [&](std::uint32_t v) { return side_[v] > 0; })) continue;
    std::vector<std::uint32_t> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = t[k];
      const std::uint32_t next = t[(k + 1) % 3];
      if (side_[v] >= 0) corners.push_back(place(v));
      if (side_[v] > 0 && side_[next] < 0) corners.push_back(cut_edge(v, next));
      if (side_[v] < 0 && side_[next] > 0) corners.push_back(cut_edge(next, v));
    }
    add(f, corners);
  }
  return std::move(result_);
}

}  // namespace

TriMesh below_diagonal(const TriMesh& surface, const Sides& sides, double spacing) {
  return DiagonalCut(surface, sides, spacing).result();
}

}  // namespace scarp
