#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/vec3.h"
#include "flux/rays/ray_scene.h"

namespace scarp {

/// The axis direction nearest to n: 0 to 5 for +x, -x, +y, -y, +z, -z.
int main_direction(Vec3d n);

/// A number by which places of one main direction follow each other along a Z-shaped curve, 2^-16
/// of the unit cube fine.
std::uint64_t curve_key(Vec3d r_unit, int direction);

/// Starts of some flights, each component by itself, and numbers below 2^20 by which those that
/// start close together in similar directions follow each other.
struct FlightStarts {
  static constexpr std::size_t most = 64;

  std::array<std::array<float, most>, 3> r;  ///< in the unit cube
  std::array<std::array<float, most>, 3> u;
  std::array<std::uint32_t, most> key;
  std::size_t count = 0;

  void add(Vec3f place, Vec3f direction) {
    for (int axis = 0; axis < 3; ++axis) {
      r[static_cast<std::size_t>(axis)][count] = place[axis];
      u[static_cast<std::size_t>(axis)][count] = direction[axis];
    }
    ++count;
  }
};

/// Fills in the keys.
void find_keys(FlightStarts& starts);

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
