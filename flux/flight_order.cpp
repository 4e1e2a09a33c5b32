#include "flux/flight_order.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace scarp {

namespace {

constexpr unsigned cell_bits = 6;
constexpr unsigned pass_bits = 11;
constexpr std::uint32_t bucket_count = 1U << pass_bits;

// Bit k of the six goes to bit 3k.
std::uint32_t spread(std::uint32_t x) {
  x = (x | (x << 8)) & 0x0300FU;
  x = (x | (x << 4)) & 0x030C3U;
  return (x | (x << 2)) & 0x09249U;
}

std::uint32_t cell(double unit) {
  constexpr double cells = 1U << cell_bits;
  return static_cast<std::uint32_t>(std::clamp(unit * cells, 0.0, cells - 1));
}

}  // namespace

std::uint32_t flight_key(Vec3d r_unit, Vec3d u) {
  const std::uint32_t octant = (u.x < 0 ? 1U : 0U) | (u.y < 0 ? 2U : 0U) | (u.z < 0 ? 4U : 0U);
  const std::uint32_t place =
      spread(cell(r_unit.x)) | (spread(cell(r_unit.y)) << 1) | (spread(cell(r_unit.z)) << 2);
  return (place << 3) | octant;
}

std::vector<std::uint32_t> sorted_order(const std::vector<std::uint32_t>& keys) {
  std::vector<std::uint32_t> order(keys.size());
  std::vector<std::uint32_t> sorted(keys.size());
  for (std::uint32_t i = 0; i < keys.size(); ++i) order[i] = i;
  for (unsigned shift = 0; shift < 2 * pass_bits; shift += pass_bits) {
    std::array<std::uint32_t, bucket_count + 1> first{};
    for (const std::uint32_t key : keys) ++first[((key >> shift) & (bucket_count - 1)) + 1];
    for (std::size_t b = 0; b < bucket_count; ++b) first[b + 1] += first[b];
    for (const std::uint32_t i : order)
      sorted[first[(keys[i] >> shift) & (bucket_count - 1)]++] = i;
    std::swap(order, sorted);
  }
  return order;
}

}  // namespace scarp
