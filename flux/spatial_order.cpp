#include "flux/spatial_order.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>

namespace scarp {

namespace {

constexpr unsigned pass_bits = 11;
constexpr std::uint32_t bucket_count = 1U << pass_bits;

// Bit k of sixteen goes to bit 3k.
constexpr std::uint64_t spread(std::uint64_t x) {
  x = (x | (x << 16)) & 0x0000FF0000FFU;
  x = (x | (x << 8)) & 0x00F00F00F00FU;
  x = (x | (x << 4)) & 0x0C30C30C30C3U;
  return (x | (x << 2)) & 0x249249249249U;
}

// The cell of the unit interval that a number is in, of 2^bits.
std::uint32_t cell_of(double unit, unsigned bits) {
  const std::int32_t cells = std::int32_t{1} << bits;
  const auto cell = static_cast<std::int32_t>(unit * cells);
  return static_cast<std::uint32_t>(std::clamp(cell, 0, cells - 1));
}

// Of five bits.
constexpr std::uint32_t short_bits = 5;
constexpr std::array<std::uint16_t, 1U << short_bits> spread_bits = [] {
  std::array<std::uint16_t, 1U << short_bits> table{};
  for (std::uint32_t x = 0; x < table.size(); ++x) table[x] = static_cast<std::uint16_t>(spread(x));
  return table;
}();

}  // namespace

int main_direction(Vec3d n) {
  const Vec3d size{std::abs(n.x), std::abs(n.y), std::abs(n.z)};
  const int axis = size.z >= size.x && size.z >= size.y ? 2 : size.x >= size.y ? 0 : 1;
  return 2 * axis + (n[axis] < 0 ? 1 : 0);
}

std::uint64_t curve_key(Vec3d r_unit, int direction) {
  constexpr unsigned bits = 16;
  return (static_cast<std::uint64_t>(direction) << (3 * bits)) | spread(cell_of(r_unit.x, bits)) |
         (spread(cell_of(r_unit.y, bits)) << 1) | (spread(cell_of(r_unit.z, bits)) << 2);
}

// Large cells first, then 32 directions, then small cells: what flies from about the same place in
// about the same direction arrives at about the same place.
std::uint32_t flight_key(Vec3d r_unit, Vec3f u) {
  constexpr unsigned small_bits = 2;  // of a place; the three others are of the large cell
  constexpr unsigned direction_bits = 5;
  const Vec3f size{std::abs(u.x), std::abs(u.y), std::abs(u.z)};
  const float half = 0.5F * (size.x + size.y + size.z);
  const auto bit = [](bool is_set, unsigned place) { return std::uint32_t{is_set} << place; };
  const std::uint32_t direction = bit(std::signbit(u.x), 0) | bit(std::signbit(u.y), 1) |
                                  bit(std::signbit(u.z), 2) | bit(size.x > half, 3) |
                                  bit(size.y > half, 4);
  const auto along = [](double unit) {
    return std::uint32_t{spread_bits[cell_of(unit, short_bits)]};
  };
  const std::uint32_t cell = along(r_unit.x) | (along(r_unit.y) << 1) | (along(r_unit.z) << 2);
  const std::uint32_t large = cell >> (3 * small_bits);
  const std::uint32_t small = cell & ((1U << (3 * small_bits)) - 1);
  return (((large << direction_bits) | direction) << (3 * small_bits)) | small;
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
