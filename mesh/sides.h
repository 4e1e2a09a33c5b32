#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/frame.h"
#include "core/tri_mesh.h"
#include "core/vec3.h"

namespace scarp {

/// Which of the lateral sides a vertex lies on: bit 2 axis for the lower, 2 axis + 1 for the upper
/// one, bit 4 for the diagonal.
using SideMask = std::uint8_t;

constexpr SideMask on_diagonal = 1U << 4;

/// Whether the coordinate along axis is given by a side.
constexpr bool fixes(SideMask mask, int axis) { return (mask >> (2 * axis) & 3) != 0; }

/// Whether x = y is given.
constexpr bool fixes_diagonal(SideMask mask) { return (mask & on_diagonal) != 0; }

/// A vertex where two sides meet.
constexpr bool is_corner(SideMask mask) {
  return (fixes(mask, 0) ? 1 : 0) + (fixes(mask, 1) ? 1 : 0) + (fixes_diagonal(mask) ? 1 : 0) > 1;
}

/// The part of a direction along the sides that a vertex lies on.
constexpr Vec3d along_sides(SideMask mask, Vec3d v) {
  if (is_corner(mask)) return {0, 0, v.z};
  for (int axis = 0; axis < 2; ++axis)
    if (fixes(mask, axis)) v[axis] = 0;
  if (fixes_diagonal(mask)) v.x = v.y = 0.5 * (v.x + v.y);
  return v;
}

/// The sides of a mesh that has no domain: those of its bounding box in x and y.
inline Sides sides_of(const TriMesh& mesh) {
  const Box box = bounding_box(mesh);
  Sides sides;
  for (int axis = 0; axis < 2; ++axis) {
    sides.lower[axis] = box.lower[axis];
    sides.upper[axis] = box.upper[axis];
  }
  return sides;
}

/// Tells which vertices lie on the sides of the domain, and which between them. Sides without a
/// width are no sides.
class SidePlanes {
 public:
  explicit SidePlanes(const Sides& sides) : has_diagonal_(sides.diagonal) {
    for (int axis = 0; axis < 2; ++axis) {
      if (!(sides.width(axis) > 0)) continue;
      // Coordinates are floats: a side may be off its own rounding by as much.
      tolerance_[axis] = 1e-6 * sides.width(axis);
      const std::size_t lower = axis == 0 ? 0 : 2;
      position_[lower] = sides.lower[axis];
      position_[lower + 1] = sides.upper[axis];
    }
  }

  SideMask mask(Vec3d r) const {
    SideMask mask = 0;
    for (int side = 0; side < 4; ++side) {
      const int axis = side / 2;
      if (tolerance_[axis] > 0 && std::abs(r[axis] - position_[side]) <= tolerance_[axis]) {
        mask = static_cast<SideMask>(mask | 1U << side);
      }
    }
    // Meshes are cut there, and lie exactly on it.
    if (has_diagonal_ && r.x == r.y) mask |= on_diagonal;
    return mask;
  }

  /// Whether a place is on or between the sides.
  bool hold(Vec3d r) const {
    for (int axis = 0; axis < 2; ++axis) {
      if (!(tolerance_[axis] > 0)) continue;
      const std::size_t lower = axis == 0 ? 0 : 2;
      if (r[axis] < position_[lower] - tolerance_[axis]) return false;
      if (r[axis] > position_[lower + 1] + tolerance_[axis]) return false;
    }
    return !has_diagonal_ || r.y <= r.x + tolerance_[0];
  }

 private:
  std::array<double, 4> position_{};
  std::array<double, 2> tolerance_{};
  bool has_diagonal_;
};

}  // namespace scarp
