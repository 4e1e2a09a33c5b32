#include "levelset/metrology/view_from_above.h"

#include <algorithm>
#include <cmath>

namespace scarp {

namespace {

using Place = ViewFromAbove::Place;

/// Height of a triangle at a place, borders included; nothing beside it, and of upright ones.
std::optional<double> height_at(const std::array<Vec3d, 3>& corners, const Place& place) {
  const auto doubled_area = [&](const Vec3d& a, const Vec3d& b) {
    return (a.x - place[0]) * (b.y - place[1]) - (b.x - place[0]) * (a.y - place[1]);
  };
  const auto& [a, b, c] = corners;
  const std::array<double, 3> weight{doubled_area(b, c), doubled_area(c, a), doubled_area(a, b)};
  const double sum = weight[0] + weight[1] + weight[2];
  // What gas lies above of is counter-clockwise.
  if (!(sum > 0) || weight[0] < 0 || weight[1] < 0 || weight[2] < 0) return std::nullopt;
  return (weight[0] * a.z + weight[1] * b.z + weight[2] * c.z) / sum;
}

}  // namespace

ViewFromAbove::ViewFromAbove(const TriMesh& surface)
    : surface_(surface), box_(bounding_box(surface)) {
  // About as many cells as facets, as long as they are wide.
  const std::array<double, 2> size{box_.upper.x - box_.lower.x, box_.upper.y - box_.lower.y};
  const double edge = std::sqrt(size[0] * size[1] /
                                std::max<double>(1, static_cast<double>(surface.triangles.size())));
  for (int axis = 0; axis < 2; ++axis) {
    if (edge > 0) cells_[axis] = static_cast<std::size_t>(std::clamp(size[axis] / edge, 1.0, 1e5));
  }

  const auto for_each_cell = [&](const auto& visit) {
    for (std::size_t f = 0; f < surface.triangles.size(); ++f) {
      if (!(area_vector(surface, f).z > 0)) continue;
      Box box;
      for (const Vec3d& r : corners(surface, f)) box.add(r);
      for (std::size_t i = cell(0, box.lower.x); i <= cell(0, box.upper.x); ++i)
        for (std::size_t j = cell(1, box.lower.y); j <= cell(1, box.upper.y); ++j)
          visit(i * cells_[1] + j, static_cast<std::uint32_t>(f));
    }
  };
  first_.assign(cells_[0] * cells_[1] + 1, 0);
  for_each_cell([&](std::size_t cell, std::uint32_t) { ++first_[cell + 1]; });
  for (std::size_t n = 1; n < first_.size(); ++n) first_[n] += first_[n - 1];
  facets_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for_each_cell([&](std::size_t cell, std::uint32_t f) { facets_[next[cell]++] = f; });
}

std::size_t ViewFromAbove::cell(int axis, double position) const {
  const double size = box_.upper[axis] - box_.lower[axis];
  const auto count = static_cast<double>(cells_[axis]);
  const double part = size > 0 ? (position - box_.lower[axis]) / size * count : 0;
  return static_cast<std::size_t>(std::clamp(part, 0.0, count - 1));
}

std::optional<SeenPoint> ViewFromAbove::at(const Place& place) const {
  if (surface_.triangles.empty()) return std::nullopt;
  const Place inside{std::clamp(place[0], box_.lower.x, box_.upper.x),
                     std::clamp(place[1], box_.lower.y, box_.upper.y)};
  const std::size_t here = cell(0, inside[0]) * cells_[1] + cell(1, inside[1]);
  std::optional<SeenPoint> seen;
  for (std::uint32_t n = first_[here]; n < first_[here + 1]; ++n) {
    const std::uint32_t f = facets_[n];
    const std::optional<double> height = height_at(corners(surface_, f), inside);
    if (height && (!seen || *height > seen->height)) {
      seen =
          SeenPoint{.height = *height,
                    .material = surface_.materials.empty() ? MaterialId{0} : surface_.materials[f]};
    }
  }
  return seen;
}

}  // namespace scarp
