#include <algorithm>
#include <cmath>
#include <numbers>

#include "levelset/start/shapes.h"

namespace scarp {

namespace {

double copies(const Repeat& repeat) {
  return static_cast<double>(repeat.count[0]) * repeat.count[1];
}

/// Lengths of walls seen from above. Units: nm.
double perimeter(const Sides& sides, const SlotOutline& s) {
  return 2 * sides.width(s.along) * copies(s.repeat);
}
double perimeter(const Sides&, const CircleOutline& s) {
  return 2 * std::numbers::pi * s.radius * copies(s.repeat);
}
double perimeter(const Sides&, const RectangleOutline& s) {
  return 2 * (s.size[0] + s.size[1]) * copies(s.repeat);
}
/// Only of edges in the domain, and no longer than it.
double perimeter(const Sides& sides, const PolygonOutline& s) {
  double sum = 0;
  for (const Loop& loop : s.loops) {
    for (std::size_t p = 0; p < loop.size(); ++p) {
      const Point2& a = loop[p];
      const Point2& b = loop[(p + 1) % loop.size()];
      std::array<double, 2> within{};
      for (std::size_t axis = 0; axis < 2; ++axis) {
        within[axis] = std::min(std::max(a[axis], b[axis]), sides.upper[axis]) -
                       std::max(std::min(a[axis], b[axis]), sides.lower[axis]);
      }
      if (within[0] >= 0 && within[1] >= 0) sum += std::max(within[0], within[1]);
    }
  }
  return sum;
}

double walls(const Sides& sides, const TrenchShape& s) {
  if (s.is_everywhere) return 0;
  return 2 * sides.width(s.along) * copies(s.repeat) * s.cut.depth;
}
double walls(const Sides&, const HoleShape& s) {
  return 2 * std::numbers::pi * s.radius * copies(s.repeat) * s.cut.depth;
}
double walls(const Sides& sides, const FinShape& s) {
  return 2 * sides.width(s.along) * copies(s.repeat) * s.height;
}
double walls(const Sides& sides, const MaskShape& s) {
  return s.thickness *
         std::visit([&](const auto& outline) { return perimeter(sides, outline); }, s.outline);
}
double walls(const Sides&, const WaferShape&) { return 0; }
double walls(const Sides&, const LayerShape&) { return 0; }
double walls(const Sides&, const StackShape&) { return 0; }
double walls(const Sides&, const MeshShape&) { return 0; }
double walls(const Sides&, const ProfileShape&) { return 0; }

}  // namespace

double wall_area(const Frame& frame, const Shape& shape) {
  const Sides sides = frame.sides();
  return std::visit([&](const auto& s) { return walls(sides, s); }, shape);
}

}  // namespace scarp
