#include "flux/sobol.h"

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

constexpr DirectionNumbers directions = direction_numbers();

// Each bit is flipped depending on all bits above it: on reversed bits that is a function in which
// information only moves upwards, made of products by even numbers and additions.
std::uint32_t owen_scramble(std::uint32_t x, std::uint32_t seed) {
  x = reverse_bits(x);
  x ^= x * 0x3D20ADEAU;
  x += seed;
  x *= (seed >> 16) | 1U;
  x ^= x * 0x05526C56U;
  x ^= x * 0x53A22864U;
  return reverse_bits(x);
}

}  // namespace

std::uint32_t reverse_bits(std::uint32_t x) {
  x = (x >> 16) | (x << 16);
  x = ((x & 0xFF00FF00U) >> 8) | ((x & 0x00FF00FFU) << 8);
  x = ((x & 0xF0F0F0F0U) >> 4) | ((x & 0x0F0F0F0FU) << 4);
  x = ((x & 0xCCCCCCCCU) >> 2) | ((x & 0x33333333U) << 2);
  return ((x & 0xAAAAAAAAU) >> 1) | ((x & 0x55555555U) << 1);
}

std::array<double, 4> ScrambledSobol::point(std::uint32_t index) const {
  std::array<std::uint32_t, 4> x{};
  for (unsigned bit = 0; index != 0; index >>= 1, ++bit) {
    const std::uint32_t mask = 0U - (index & 1U);
    for (std::size_t axis = 0; axis < 4; ++axis) x[axis] ^= directions[axis][bit] & mask;
  }
  std::array<double, 4> point{};
  for (std::size_t axis = 0; axis < 4; ++axis)
    point[axis] = (owen_scramble(x[axis], seeds_[axis]) + 0.5) * 0x1.0p-32;
  return point;
}

}  // namespace scarp
