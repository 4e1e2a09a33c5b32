#pragma once

#include <array>
#include <cstddef>

#include "core/frame.h"

namespace scarp {

/// By how much to move a point along a lateral axis to reach it and, near a periodic side, its
/// image beyond that: what lies within limit of the image lies within limit of the point.
///
/// Mirror images are never nearer to a surface than the point itself.
struct ImageShifts {
  std::array<double, 3> shift{};
  std::size_t count = 1;

  const double* begin() const { return shift.data(); }
  const double* end() const { return shift.data() + count; }
};

inline ImageShifts image_shifts(const Frame& frame, int axis, double position, double limit) {
  ImageShifts found;
  if (frame.boundary[axis] == Boundary::periodic) {
    const Sides sides = frame.sides();
    if (position - sides.lower[axis] < limit) {
      found.shift[found.count++] = sides.width(axis);
    }
    if (sides.upper[axis] - position < limit) {
      found.shift[found.count++] = -sides.width(axis);
    }
  }
  return found;
}

}  // namespace scarp
