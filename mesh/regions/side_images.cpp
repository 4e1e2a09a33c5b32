#include "mesh/regions/side_images.h"

#include <map>
#include <utility>

namespace scarp {

SideImages::SideImages(const RegionMesh& mesh) {
  for (int axis = 0; axis < 2; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    if (!mesh.is_periodic[a] || !sides_match(mesh, axis)) continue;
    std::vector<std::uint32_t>& others = others_[a];
    others.assign(mesh.vertices.size(), none);
    std::map<std::pair<double, double>, std::uint32_t> lower;
    const auto place = [&](std::uint32_t v) {
      return std::pair(mesh.vertices[v][1 - axis], mesh.vertices[v].z);
    };
    for (std::uint32_t v = 0; v < others.size(); ++v)
      if (mesh.vertices[v][axis] == mesh.lower[a]) lower[place(v)] = v;
    for (std::uint32_t v = 0; v < others.size(); ++v) {
      if (mesh.vertices[v][axis] != mesh.upper[a]) continue;
      const auto other = lower.find(place(v));
      if (other == lower.end()) continue;
      others[v] = other->second;
      others[other->second] = v;
    }
  }
}

unsigned SideImages::count(std::uint32_t v) const {
  unsigned count = 1;
  for (const std::vector<std::uint32_t>& others : others_)
    if (!others.empty() && others[v] != none) count *= 2;
  return count;
}

SideImages::Axes SideImages::axes_of(std::uint32_t v, unsigned n) const {
  Axes axes{};
  for (std::size_t a = 0; a < 2; ++a) {
    if (others_[a].empty() || others_[a][v] == none) continue;
    axes[a] = n % 2 == 1;
    n /= 2;
  }
  return axes;
}

std::uint32_t SideImages::across(std::uint32_t v, const Axes& axes) const {
  for (std::size_t a = 0; a < 2 && v != none; ++a)
    if (axes[a]) v = others_[a][v];
  return v;
}

std::uint32_t SideImages::image(std::uint32_t v, unsigned n) const {
  return across(v, axes_of(v, n));
}

std::uint32_t SideImages::opposite(std::uint32_t v, int side) const {
  const auto a = static_cast<std::size_t>(side / 2);
  return side < 0 || a > 1 || others_[a].empty() ? none : others_[a][v];
}

}  // namespace scarp
