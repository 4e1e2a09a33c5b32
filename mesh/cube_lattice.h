#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "core/tri_mesh.h"

namespace scarp {

/// Cubes of one size that cover a box, numbered with x fastest.
class CubeLattice {
 public:
  /// Of no box.
  CubeLattice() = default;

  /// Cubes of the given size, larger ones if that needs more than 128 along an axis; shifted
  /// against the box by a part of their size in [0, 1). The box must not be empty.
  CubeLattice(const Box& box, double size, double shift) {
    constexpr double most_per_axis = 127;
    const Vec3d extent = box.upper - box.lower;
    const double longest = std::max({extent.x, extent.y, extent.z});
    size = std::max({size, longest / most_per_axis, 1e-300});
    per_size_ = 1 / size;
    const double offset = shift * size;
    origin_ = box.lower - Vec3d{offset, offset, offset};
    for (int axis = 0; axis < 3; ++axis) {
      count_[axis] = static_cast<std::uint32_t>((box.upper[axis] - origin_[axis]) * per_size_) + 1;
    }
  }

  std::uint32_t count() const { return count_[0] * count_[1] * count_[2]; }

  /// The cube of a place; the nearest one for places outside the box.
  std::uint32_t of(Vec3d r) const {
    return (index(r, 2) * count_[1] + index(r, 1)) * count_[0] + index(r, 0);
  }

 private:
  std::uint32_t index(Vec3d r, int axis) const {
    const double cubes = (r[axis] - origin_[axis]) * per_size_;
    if (!(cubes > 0)) return 0;
    return cubes < count_[axis] ? static_cast<std::uint32_t>(cubes) : count_[axis] - 1;
  }

  double per_size_ = 1;
  Vec3d origin_;
  std::array<std::uint32_t, 3> count_{};
};

}  // namespace scarp
