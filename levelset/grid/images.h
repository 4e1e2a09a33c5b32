#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/frame.h"

namespace scarp {

/// Where a point is seen from beyond a periodic side.
struct Image {
  Vec3d r;
  double beyond = 0;  ///< how far it lies outside the domain
};

/// The images of a point across periodic sides: what lies within a distance of an image lies within
/// that of the point. Mirror images are never nearer to a surface than the point itself.
struct Images {
  std::array<Image, 8> images{};
  std::size_t count = 0;

  const Image* begin() const { return images.data(); }
  const Image* end() const { return images.data() + count; }

  /// Whether anything in the domain may lie within a distance of one of them.
  bool reach(double distance) const {
    return std::any_of(begin(), end(), [&](const Image& each) { return each.beyond <= distance; });
  }
};

/// Those that lie less than limit outside the domain.
inline Images images_of(const Frame& frame, Vec3d r, double limit) {
  struct Shift {
    double by = 0;
    double beyond = 0;
  };
  const Sides sides = frame.sides();
  std::array<std::array<Shift, 3>, 2> shifts{};
  std::array<std::size_t, 2> counts{1, 1};
  for (int axis = 0; axis < 2; ++axis) {
    if (frame.boundary[axis] != Boundary::periodic) continue;
    const double above = r[axis] - sides.lower[axis];
    const double below = sides.upper[axis] - r[axis];
    if (above < limit) shifts[axis][counts[axis]++] = {sides.width(axis), above};
    if (below < limit) shifts[axis][counts[axis]++] = {-sides.width(axis), below};
  }
  Images found;
  for (std::size_t n = 1; n < counts[0] * counts[1]; ++n) {
    const Shift& x = shifts[0][n / counts[1]];
    const Shift& y = shifts[1][n % counts[1]];
    found.images[found.count++] = {r + Vec3d{x.by, y.by, 0}, std::max(x.beyond, y.beyond)};
  }
  return found;
}

}  // namespace scarp
