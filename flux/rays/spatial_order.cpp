#include "flux/rays/spatial_order.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>

#include "core/vector_kernel.h"

namespace scarp {

namespace {

constexpr unsigned pass_bits = 11;
constexpr std::uint32_t bucket_count = 1U << pass_bits;

// Bit k of sixteen goes to bit 3k.
std::uint64_t spread(std::uint64_t x) {
  x = (x | (x << 16)) & 0x0000FF0000FFU;
  x = (x | (x << 8)) & 0x00F00F00F00FU;
  x = (x | (x << 4)) & 0x0C30C30C30C3U;
  return (x | (x << 2)) & 0x249249249249U;
}

// The same of five.
inline std::uint32_t spread_few(std::uint32_t x) {
  x = (x | (x << 8)) & 0x100FU;
  x = (x | (x << 4)) & 0x10C3U;
  return (x | (x << 2)) & 0x1249U;
}

// The cell of the unit interval that a number is in, of 2^bits.
template <class Number>
inline std::int32_t cell_of(Number unit, unsigned bits) {
  const std::int32_t cells = std::int32_t{1} << bits;
  const auto cell = static_cast<std::int32_t>(unit * static_cast<Number>(cells));
  const std::int32_t at_least = cell < 0 ? 0 : cell;
  return at_least < cells ? at_least : cells - 1;
}

}  // namespace

int main_direction(Vec3d n) {
  const Vec3d size{std::abs(n.x), std::abs(n.y), std::abs(n.z)};
  const int axis = size.z >= size.x && size.z >= size.y ? 2 : size.x >= size.y ? 0 : 1;
  return 2 * axis + (n[axis] < 0 ? 1 : 0);
}

std::uint64_t curve_key(Vec3d r_unit, int direction) {
  constexpr unsigned bits = 16;
  const auto along = [](double unit) {
    return spread(static_cast<std::uint64_t>(cell_of(unit, bits)));
  };
  return (static_cast<std::uint64_t>(direction) << (3 * bits)) | along(r_unit.x) |
         (along(r_unit.y) << 1) | (along(r_unit.z) << 2);
}

// Large cells first, then 32 directions, then small cells: what flies from about the same place in
// about the same direction arrives at about the same place.
SCARP_WIDE_KERNEL void find_keys(FlightStarts& starts) {
  constexpr unsigned bits = 5;        // of a place
  constexpr unsigned small_bits = 2;  // of them, within a large cell
  constexpr unsigned direction_bits = 5;
  for (std::size_t k = 0; k < starts.count; ++k) {
    std::uint32_t cell = 0;
    std::uint32_t direction = 0;
    float size = 0;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const float along = starts.u[axis][k];
      size += std::abs(along);
      direction |= (along < 0 ? 1U : 0U) << axis;
      cell |= spread_few(static_cast<std::uint32_t>(cell_of(starts.r[axis][k], bits))) << axis;
    }
    for (unsigned axis = 0; axis < 2; ++axis)
      direction |= (2 * std::abs(starts.u[axis][k]) > size ? 1U : 0U) << (3 + axis);
    const std::uint32_t large = cell >> (3 * small_bits);
    const std::uint32_t small = cell & ((1U << (3 * small_bits)) - 1);
    starts.key[k] = (((large << direction_bits) | direction) << (3 * small_bits)) | small;
  }
}

SceneCells::SceneCells(const RayScene& scene, double width) : width_(width) {
  const Vec3d lower{0, 0, scene.lowest()};
  const Vec3d upper{scene.upper().x, scene.upper().y, scene.source_height()};
  for (int axis = 0; axis < 3; ++axis) {
    const auto cell_of = [&](double r) { return static_cast<std::int64_t>(std::floor(r / width)); };
    const auto a = static_cast<std::size_t>(axis);
    first_[a] = cell_of(lower[axis]);
    size_[a] = cell_of(upper[axis]) + 1 - first_[a];
  }
}

std::uint64_t SceneCells::key(Vec3d r, int direction) const {
  std::int64_t cell = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const auto place = static_cast<std::int64_t>(std::floor(r[axis] / width_));
    cell = cell * size_[a] + std::clamp(place - first_[a], std::int64_t{0}, size_[a] - 1);
  }
  return static_cast<std::uint64_t>(cell) * direction_count + static_cast<std::uint64_t>(direction);
}

std::uint64_t SceneCells::count() const {
  return static_cast<std::uint64_t>(size_[0] * size_[1] * size_[2]) * direction_count;
}

template <class Key>
std::vector<std::uint32_t> sorted_order(const std::vector<Key>& keys) {
  std::vector<std::uint32_t> order(keys.size());
  std::vector<std::uint32_t> sorted(keys.size());
  for (std::uint32_t i = 0; i < keys.size(); ++i) order[i] = i;
  const Key largest = keys.empty() ? 0 : *std::ranges::max_element(keys);
  const auto bits = static_cast<unsigned>(std::bit_width(largest));
  for (unsigned shift = 0; shift < bits; shift += pass_bits) {
    std::array<std::uint32_t, bucket_count + 1> first{};
    for (const Key key : keys) ++first[((key >> shift) & (bucket_count - 1)) + 1];
    for (std::size_t b = 0; b < bucket_count; ++b) first[b + 1] += first[b];
    for (const std::uint32_t i : order)
      sorted[first[(keys[i] >> shift) & (bucket_count - 1)]++] = i;
    std::swap(order, sorted);
  }
  return order;
}

template std::vector<std::uint32_t> sorted_order(const std::vector<std::uint32_t>& keys);
template std::vector<std::uint32_t> sorted_order(const std::vector<std::uint64_t>& keys);

}  // namespace scarp
