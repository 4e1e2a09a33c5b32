#include "flux/sobol.h"

#include <bit>
#include <cstddef>

namespace scarp {

namespace {

using DirectionNumbers = std::array<std::array<std::uint32_t, 32>, 4>;

// Primitive polynomials 1, x + 1, x^2 + x + 1, x^3 + x + 1 and the first numbers of new-joe-kuo-6.
constexpr DirectionNumbers direction_numbers() {
  struct Polynomial {
    unsigned degree;
    unsigned inner;  // coefficients between the first and the last
    std::array<std::uint32_t, 3> first;
  };
  constexpr std::array<Polynomial, 3> polynomials{
      {{1, 0, {1, 0, 0}}, {2, 1, {1, 3, 0}}, {3, 1, {1, 3, 1}}}};
  DirectionNumbers v{};
  for (unsigned bit = 0; bit < 32; ++bit) v[0][bit] = 1U << (31 - bit);
  for (std::size_t axis = 1; axis < 4; ++axis) {
    const auto& [degree, inner, first] = polynomials[axis - 1];
    for (unsigned bit = 0; bit < 32; ++bit) {
      if (bit < degree) {
        v[axis][bit] = first[bit] << (31 - bit);
        continue;
      }
      v[axis][bit] = v[axis][bit - degree] ^ (v[axis][bit - degree] >> degree);
      for (unsigned k = 1; k < degree; ++k)
        if ((inner >> (degree - 1 - k)) & 1U) v[axis][bit] ^= v[axis][bit - k];
    }
  }
  return v;
}

// The sum of the direction numbers of the bits of each value of a byte, by place of the byte.
using Axes [[gnu::vector_size(16)]] = std::uint32_t;
constexpr std::size_t byte_count = 4;
using ByteTable = std::array<std::array<std::array<std::uint32_t, 4>, 256>, byte_count>;

constexpr ByteTable byte_table() {
  constexpr DirectionNumbers directions = direction_numbers();
  ByteTable table{};
  for (std::size_t byte = 0; byte < byte_count; ++byte) {
    for (unsigned value = 1; value < 256; ++value) {
      const unsigned lowest = static_cast<unsigned>(std::countr_zero(value));
      for (std::size_t axis = 0; axis < 4; ++axis)
        table[byte][value][axis] =
            table[byte][value & (value - 1)][axis] ^ directions[axis][8 * byte + lowest];
    }
  }
  return table;
}

alignas(16) constexpr ByteTable sums = byte_table();

template <class Word>
Word reversed(Word x) {
  x = (x >> 16) | (x << 16);
  x = ((x & 0xFF00FF00U) >> 8) | ((x & 0x00FF00FFU) << 8);
  x = ((x & 0xF0F0F0F0U) >> 4) | ((x & 0x0F0F0F0FU) << 4);
  x = ((x & 0xCCCCCCCCU) >> 2) | ((x & 0x33333333U) << 2);
  return ((x & 0xAAAAAAAAU) >> 1) | ((x & 0x55555555U) << 1);
}

// Each bit is flipped depending on all bits above it: on reversed bits that is a function in which
// information only moves upwards, made of products by even numbers and additions.
Axes owen_scramble(Axes x, Axes seed) {
  x = reversed(x);
  x ^= x * 0x3D20ADEAU;
  x += seed;
  x *= (seed >> 16) | 1U;
  x ^= x * 0x05526C56U;
  x ^= x * 0x53A22864U;
  return reversed(x);
}

}  // namespace

std::uint32_t reverse_bits(std::uint32_t x) { return reversed(x); }

std::array<double, 4> ScrambledSobol::point(std::uint32_t index) const {
  Axes x{};
  for (std::size_t byte = 0; index != 0; index >>= 8, ++byte)
    x ^= std::bit_cast<Axes>(sums[byte][index & 255U]);
  x = owen_scramble(x, std::bit_cast<Axes>(seeds_));
  std::array<double, 4> point{};
  for (std::size_t axis = 0; axis < 4; ++axis) point[axis] = (x[axis] + 0.5) * 0x1.0p-32;
  return point;
}

}  // namespace scarp
