#pragma once

#include <cstdint>
#include <vector>

#include "core/vec3.h"

namespace scarp {

/// A number by which flights that start close together in similar directions follow each other.
///
/// r_unit: place in the unit cube.
std::uint32_t flight_key(Vec3d r_unit, Vec3d u);

/// Indices in the order of the keys, equal keys in their own order. Keys are below flight_key_end.
/// Cost: two passes over the keys.
std::vector<std::uint32_t> sorted_order(const std::vector<std::uint32_t>& keys);

inline constexpr std::uint32_t flight_key_end = 1U << 21;

}  // namespace scarp
