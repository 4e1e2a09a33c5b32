#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/vec3.h"
#include "flux/ray_scene.h"

namespace scarp {

/// The axis direction nearest to n: 0 to 5 for +x, -x, +y, -y, +z, -z.
int main_direction(Vec3d n);

/// A number by which places of one main direction follow each other along a Z-shaped curve, 2^-16
/// of the unit cube fine.
std::uint64_t curve_key(Vec3d r_unit, int direction);

/// A number below 2^20 by which flights that start close together in similar directions follow each
/// other.
///
/// r_unit: place in the unit cube.
std::uint32_t flight_key(Vec3d r_unit, Vec3f u);

/// Cubic cells that fill the space below a scene's source, with places by main direction in each.
class SceneCells {
 public:
  SceneCells(const RayScene& scene, double width);

  /// A number by which what has the same main direction is together with its like in its cell, and
  /// cells follow each other along z, then y, then x.
  std::uint64_t key(Vec3d r, int direction) const;
  static int direction(std::uint64_t key) { return static_cast<int>(key % direction_count); }
  /// Keys are below it.
  std::uint64_t count() const;

 private:
  static constexpr std::uint64_t direction_count = 6;

  double width_;
  std::array<std::int64_t, 3> first_{};
  std::array<std::int64_t, 3> size_{};
};

/// Indices in the order of the keys, equal keys in their own order.
///
/// Shape: keys of 32 or 64 bits.
/// Cost: a pass over the keys for each 11 bits of the largest.
template <class Key>
std::vector<std::uint32_t> sorted_order(const std::vector<Key>& keys);

}  // namespace scarp
