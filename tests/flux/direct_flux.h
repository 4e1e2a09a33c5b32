#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/vec3.h"

namespace scarp::exact {

/// The flux of a power cosine source on a trench of width 20 with its opening at z = 0, at a place
/// with normal n, if all particles stick.
///
/// Seen along the trench the source is c_n cos^n(angle).
inline double direct_trench_flux(Vec3d r, Vec3d n, double power) {
  const double c = std::exp(std::lgamma(power / 2 + 1) - std::lgamma((power + 1) / 2)) /
                   std::sqrt(std::numbers::pi);
  if (std::abs(n.x) > 0.5) {
    const double z = -r.z / 20;
    return c / power * (1 - std::pow(z / std::sqrt(z * z + 1), power));
  }
  const double from = std::atan((-10 - r.x) / -r.z);
  const double to = std::atan((10 - r.x) / -r.z);
  constexpr int steps = 400;
  double sum = 0;
  for (int i = 0; i < steps; ++i)
    sum += std::pow(std::cos(from + (to - from) * (i + 0.5) / steps), power);
  return c * sum * (to - from) / steps;
}

/// The same in a round hole of diameter 20, averaged over the bottom, for a cosine source.
inline double direct_hole_bottom_flux(double aspect_ratio) {
  const double x = 2 + 4 * aspect_ratio * aspect_ratio;
  return (x - std::sqrt(x * x - 4)) / 2;
}

}  // namespace scarp::exact
