#include "mesh/surface_fault.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "mesh/sides.h"

namespace scarp {

namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// A bit for each side that a vertex lies on.
std::uint8_t sides_at(const Vec3f& r, const Sides& sides) {
  std::uint8_t found = 0;
  for (int axis = 0; axis < 2; ++axis) {
    if (r[axis] == static_cast<float>(sides.lower[axis])) found |= 1U << (2 * axis);
    if (r[axis] == static_cast<float>(sides.upper[axis])) found |= 2U << (2 * axis);
  }
  if (sides.diagonal && r.x == r.y) found |= on_diagonal;
  return found;
}

/// A number for each edge; the finalizer of splitmix64 (Steele et al. 2014).
std::uint64_t number_of(std::uint32_t lower, std::uint32_t upper) {
  std::uint64_t x = (std::uint64_t{lower} << 32 | upper) + 0x9e3779b97f4a7c15U;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31);
}

class Checker {
 public:
  Checker(const TriMesh& mesh, const Sides& sides) : mesh_(mesh) {
    on_sides_.reserve(mesh.vertices.size());
    for (const Vec3f& r : mesh.vertices) on_sides_.push_back(sides_at(r, sides));
  }

  /// Every edge that is met once each way adds nothing, so the sum of all is zero without a fault;
  /// with one it is zero by chance once in 2^64.
  bool is_closed() const {
    std::uint64_t sum = 0;
    for_each_edge([&](std::uint32_t a, std::uint32_t b) {
      sum += a < b ? number_of(a, b) : 0 - number_of(b, a);
    });
    return sum == 0;
  }

  SurfaceFault first_open_edge() const {
    std::map<Edge, int> balance;
    for_each_edge([&](std::uint32_t a, std::uint32_t b) {
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    });
    const auto open = std::ranges::find_if(balance, [](const auto& e) { return e.second != 0; });
    const auto [a, b] = open->first;
    return {"the facets of an edge do not close the surface",
            0.5 * (Vec3d(mesh_.vertices[a]) + Vec3d(mesh_.vertices[b]))};
  }

 private:
  template <class Visit>
  void for_each_edge(const Visit& visit) const {
    for (const Triangle& corners : mesh_.triangles) {
      for (int c = 0; c < 3; ++c) {
        const std::uint32_t a = corners[c];
        const std::uint32_t b = corners[(c + 1) % 3];
        if ((on_sides_[a] & on_sides_[b]) == 0) visit(a, b);
      }
    }
  }

  const TriMesh& mesh_;
  std::vector<std::uint8_t> on_sides_;
};

}  // namespace

std::optional<SurfaceFault> surface_fault(const TriMesh& mesh, const Sides& sides) {
  for (const Vec3f& r : mesh.vertices) {
    const Vec3d place(r);
    if (!std::isfinite(place.x + place.y + place.z))
      return SurfaceFault{"a vertex is not finite", place};
  }
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const Vec3d twice = area_vector(mesh, f);
    if (twice.x == 0 && twice.y == 0 && twice.z == 0)
      return SurfaceFault{"a facet has no area", Vec3d(mesh.vertices[mesh.triangles[f][0]])};
  }
  const Checker checker(mesh, sides);
  if (checker.is_closed()) return std::nullopt;
  return checker.first_open_edge();
}

}  // namespace scarp
