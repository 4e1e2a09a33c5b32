#pragma once

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
std::uint32_t flight_key(Vec3d r_unit, Vec3d u);

/// Indices in the order of the keys, equal keys in their own order.
/// Cost: two passes over the keys.
std::vector<std::uint32_t> sorted_order(const std::vector<std::uint32_t>& keys);

/// The order in which count flights should be flown: consecutive ones meet the same cells of the
/// scene, which are then in the cache. ray_at(i) is the i-th ray.
template <class RayAt>
std::vector<std::uint32_t> flight_order(const RayScene& scene, std::size_t count,
                                        const RayAt& ray_at) {
  const Vec3d size{scene.upper().x, scene.upper().y, scene.source_height() - scene.lowest()};
  std::vector<std::uint32_t> keys(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Ray& ray = ray_at(i);
    keys[i] = flight_key({ray.r.x / size.x, ray.r.y / size.y, (ray.r.z - scene.lowest()) / size.z},
                         ray.u);
  }
  return sorted_order(keys);
}

}  // namespace scarp
