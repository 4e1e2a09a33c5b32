#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/vec3.h"

namespace scarp {

/// Signed distance to a solid (negative inside) and its gradient.
///
/// What is known of a composed solid at a point is its nearest surface only: value may be too large
/// where another one takes its place. bound, the larger or smaller of the parts' values, never is.
struct Distance {
  double value = 0;
  Vec3d normal;
  double bound = value;  ///< of the sign of value, and in magnitude at most the distance
};

inline Distance complement(const Distance& a) { return {-a.value, -a.normal, -a.bound}; }

/// Distance to the common part of two solids: exact where their surfaces are flat, also outside the
/// edge in which they meet, where the larger of the two values would be too small.
inline Distance intersect(Distance a, Distance b) {
  if (a.value < b.value) {
    std::swap(a, b);
  }
  a.bound = std::max(a.bound, b.bound);
  const double cosine = dot(a.normal, b.normal);
  // Value of b at the foot of the perpendicular on the surface of a.
  const double above_b = b.value - a.value * cosine;
  const double sine_square = 1 - cosine * cosine;
  if (a.value <= 0 || above_b <= 0 || sine_square < 1e-9) {
    return a;
  }
  const Vec3d from_edge =
      ((a.value - b.value * cosine) / sine_square) * a.normal + (above_b / sine_square) * b.normal;
  const double value = length(from_edge);
  return {value, from_edge / value, a.bound};
}

inline Distance unite(const Distance& a, const Distance& b) {
  return complement(intersect(complement(a), complement(b)));
}

}  // namespace scarp
