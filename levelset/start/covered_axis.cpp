#include "levelset/start/covered_axis.h"

#include <algorithm>

namespace scarp {

double reach_beyond_sides(const Frame& frame, const RectangleOutline& rectangle, int axis,
                          double growth) {
  const Sides sides = frame.sides();
  const double half = 0.5 * rectangle.size[axis] + std::min(growth, 0.0) - rectangle.corner_radius;
  if (frame.boundary[axis] == Boundary::periodic) return half - 0.5 * sides.width(axis);
  const double centre = rectangle.centre[axis];
  return std::min(sides.lower[axis] - (centre - half), centre + half - sides.upper[axis]);
}

std::optional<int> covered_axis(const Frame& frame, const RectangleOutline& rectangle,
                                double growth) {
  for (const int axis : {0, 1}) {
    const double slack = 1e-9 * frame.sides().width(axis);
    if (rectangle.repeat.count[axis] == 1 &&
        reach_beyond_sides(frame, rectangle, axis, growth) >= -slack)
      return axis;
  }
  return std::nullopt;
}

}  // namespace scarp
