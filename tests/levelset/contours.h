#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "core/frame.h"
#include "levelset/grid/level_set.h"

namespace scarp {

/// The surface of a solid in a cross-section: points from left to right, the solid below; in
/// spacings.
using ContourPoints = std::vector<std::array<double, 2>>;

/// Signed distance to an contour that goes on level at both ends.
inline double distance_to(const ContourPoints& contour, double x, double z) {
  double squared = 1e300;
  bool is_solid = false;
  ContourPoints all{{-1e4, contour.front()[1]}};
  all.insert(all.end(), contour.begin(), contour.end());
  all.push_back({1e4, contour.back()[1]});
  for (std::size_t n = 1; n < all.size(); ++n) {
    const auto& [x0, z0] = all[n - 1];
    const auto& [x1, z1] = all[n];
    const double dx = x1 - x0;
    const double dz = z1 - z0;
    const double along = (x - x0) * dx + (z - z0) * dz;
    const double t = std::clamp(along / (dx * dx + dz * dz), 0.0, 1.0);
    squared = std::min(squared, std::pow(x - x0 - t * dx, 2) + std::pow(z - z0 - t * dz, 2));
    // Straight up from the point: an odd number of crossings is inside.
    if ((x0 <= x) != (x1 <= x)) is_solid ^= z0 + (x - x0) / (x1 - x0) * (z1 - z0) > z;
  }
  return (is_solid ? -1 : 1) * std::sqrt(squared);
}

/// Points of an arc about a centre, both ends included; angles in degrees.
inline ContourPoints arc(double x, double z, double radius, double from, double to) {
  constexpr int parts = 24;
  ContourPoints points;
  for (int n = 0; n <= parts; ++n) {
    const double angle = (from + (to - from) * n / parts) * std::numbers::pi / 180;
    points.push_back({x + radius * std::cos(angle), z + radius * std::sin(angle)});
  }
  return points;
}

/// A left side, from the field to the middle of the floor, and its mirror image.
inline ContourPoints symmetric(ContourPoints left) {
  for (std::size_t n = left.size(); n-- > 0;) left.push_back({-left[n][0], left[n][1]});
  return left;
}

/// The level set of the solid below an contour that is shifted by offsets in x and z, in spacings.
inline LevelSet solid_below(const Frame& frame, const ContourPoints& contour,
                            std::array<double, 2> shift = {}) {
  const double h = frame.spacing;
  double lowest = 1e300;
  double highest = -1e300;
  for (const auto& [x, z] : contour) {
    lowest = std::min(lowest, z);
    highest = std::max(highest, z);
  }
  return {frame,
          [=](Vec3d r) { return h * distance_to(contour, r.x / h - shift[0], r.z / h - shift[1]); },
          h * (lowest + shift[1] - 5), h * (highest + shift[1] + 5)};
}

}  // namespace scarp
