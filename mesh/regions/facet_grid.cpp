#include "mesh/regions/facet_grid.h"

#include <algorithm>
#include <cmath>

#include "core/triangle_tree.h"

namespace scarp {

namespace {

Box box_of(const std::array<Vec3d, 3>& corners) {
  Box box;
  for (const Vec3d& r : corners) box.add(r);
  return box;
}

/// Cosine of the angle at which facets at an edge count as folded onto each other: 3 degrees.
constexpr double folded = 0.9986;

/// Six times that of a tetrahedron.
double volume(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
  return dot(b - a, cross(c - a, d - a));
}

/// Where a triangle has its other vertex, seen along an edge and across it.
Vec3d across(const Vec3d& from, const Vec3d& to, const Vec3d& r) {
  const Vec3d u = normalized(to - from);
  const Vec3d d = r - from;
  return normalized(d - dot(d, u) * u);
}

double distance_to(const Vec3d& r, const std::array<Vec3d, 3>& t) {
  return closest_on_triangle(r, t).distance;
}

/// Between two segments, from p to q and from a to b.
double distance_between(const Vec3d& p, const Vec3d& q, const Vec3d& a, const Vec3d& b) {
  const Vec3d u = q - p;
  const Vec3d w = b - a;
  const double uu = dot(u, u);
  const double ww = dot(w, w);
  const double uw = dot(u, w);
  const double up = dot(u, p - a);
  const double wp = dot(w, p - a);
  const double parallel = uu * ww - uw * uw;
  double s = parallel > 0 ? std::clamp((uw * wp - ww * up) / parallel, 0.0, 1.0) : 0;
  const double t = std::clamp((uw * s + wp) / ww, 0.0, 1.0);
  s = std::clamp((uw * t - up) / uu, 0.0, 1.0);
  return length(p + s * u - a - t * w);
}

/// Whether the segment from p to q comes nearer to a triangle than the clearance.
bool is_near(const Vec3d& p, const Vec3d& q, const std::array<Vec3d, 3>& t, double clearance) {
  for (std::size_t n = 0; n < 3; ++n)
    if (distance_between(p, q, t[n], t[(n + 1) % 3]) < clearance) return true;
  return distance_to(p, t) < clearance || distance_to(q, t) < clearance || pierces(p, q, t);
}

}  // namespace

template <class F>
void FacetGrid::for_each_cell(const Box& box, const F& do_it) const {
  constexpr std::int64_t offset = 1 << 20;  // cells have 21 bits along each axis
  std::array<std::int64_t, 3> lower{};
  std::array<std::int64_t, 3> upper{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<std::size_t>(axis);
    lower[n] = static_cast<std::int64_t>(std::floor(box.lower[axis] / cell_)) + offset;
    upper[n] = static_cast<std::int64_t>(std::floor(box.upper[axis] / cell_)) + offset;
  }
  for (std::int64_t k = lower[2]; k <= upper[2]; ++k)
    for (std::int64_t j = lower[1]; j <= upper[1]; ++j)
      for (std::int64_t i = lower[0]; i <= upper[0]; ++i)
        do_it(static_cast<Key>((k << 42) | (j << 21) | i));
}

void FacetGrid::add(std::uint32_t facet, const std::array<Vec3d, 3>& corners) {
  for_each_cell(box_of(corners), [&](Key key) { cells_[key].push_back(facet); });
}

void FacetGrid::remove(std::uint32_t facet, const std::array<Vec3d, 3>& corners) {
  for_each_cell(box_of(corners), [&](Key key) {
    std::vector<std::uint32_t>& facets = cells_[key];
    const auto found = std::ranges::find(facets, facet);
    if (found == facets.end()) return;
    *found = facets.back();
    facets.pop_back();
  });
}

void FacetGrid::near(const Box& box, std::vector<std::uint32_t>& facets) const {
  facets.clear();
  for_each_cell(box, [&](Key key) {
    const auto found = cells_.find(key);
    if (found != cells_.end())
      facets.insert(facets.end(), found->second.begin(), found->second.end());
  });
  std::ranges::sort(facets);
  facets.erase(std::unique(facets.begin(), facets.end()), facets.end());
}

bool pierces(const Vec3d& p, const Vec3d& q, const std::array<Vec3d, 3>& t) {
  const double above = volume(t[0], t[1], t[2], p);
  const double below = volume(t[0], t[1], t[2], q);
  // In one plane rounding alone gives signs.
  constexpr double rounding = 1e-12;
  const Vec3d n = cross(t[1] - t[0], t[2] - t[0]);
  const double least = rounding * dot(n, n);
  if (!(above * below < 0) || above * above < least * dot(p - t[0], p - t[0]) ||
      below * below < least * dot(q - t[0], q - t[0]))
    return false;
  const double a = volume(p, q, t[0], t[1]);
  const double b = volume(p, q, t[1], t[2]);
  const double c = volume(p, q, t[2], t[0]);
  return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
}

bool collide(const PlacedTriangle& a, const PlacedTriangle& b, double clearance) {
  std::array<bool, 3> a_is_shared{};
  std::array<bool, 3> b_is_shared{};
  int shared = 0;
  for (std::size_t n = 0; n < 3; ++n) {
    for (std::size_t m = 0; m < 3; ++m) {
      if (a.v[n] != b.v[m]) continue;
      a_is_shared[n] = true;
      b_is_shared[m] = true;
      ++shared;
    }
  }
  if (shared == 3) return true;
  const auto first = [](const std::array<bool, 3>& marks, bool wanted) {
    return static_cast<std::size_t>(std::ranges::find(marks, wanted) - marks.begin());
  };
  if (shared == 2) {
    const std::size_t n = first(a_is_shared, false);
    const std::size_t m = first(b_is_shared, false);
    const Vec3d& from = a.r[(n + 1) % 3];
    const Vec3d& to = a.r[(n + 2) % 3];
    return dot(across(from, to, a.r[n]), across(from, to, b.r[m])) > folded;
  }
  if (shared == 1) {
    const std::size_t n = first(a_is_shared, true);
    const std::size_t m = first(b_is_shared, true);
    return is_near(a.r[(n + 1) % 3], a.r[(n + 2) % 3], b.r, clearance) ||
           is_near(b.r[(m + 1) % 3], b.r[(m + 2) % 3], a.r, clearance);
  }
  for (std::size_t n = 0; n < 3; ++n) {
    if (is_near(a.r[n], a.r[(n + 1) % 3], b.r, clearance)) return true;
    if (is_near(b.r[n], b.r[(n + 1) % 3], a.r, clearance)) return true;
  }
  return false;
}

}  // namespace scarp
