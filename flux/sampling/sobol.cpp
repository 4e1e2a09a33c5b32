#include "flux/sampling/sobol.h"

#include <bit>
#include <cstddef>

namespace scarp {

namespace {

using DirectionNumbers = std::array<std::uint32_t, 32>;

struct Polynomial {
  unsigned degree;
  unsigned inner;  // coefficients between the first and the last
  std::array<std::uint32_t, 3> first;
};

constexpr DirectionNumbers direction_numbers(const Polynomial& polynomial) {
  const auto& [degree, inner, first] = polynomial;
  DirectionNumbers v{};
  for (unsigned bit = 0; bit < 32; ++bit) {
    if (bit < degree || degree == 0) {
      v[bit] = (degree == 0 ? 1 : first[bit]) << (31 - bit);
      continue;
    }
    v[bit] = v[bit - degree] ^ (v[bit - degree] >> degree);
    for (unsigned k = 1; k < degree; ++k)
      if ((inner >> (degree - 1 - k)) & 1U) v[bit] ^= v[bit - k];
  }
  return v;
}

// The first primitive polynomials with the first numbers of new-joe-kuo-6.
constexpr Polynomial one{0, 0, {}};
constexpr Polynomial x_1{1, 0, {1}};
constexpr Polynomial x2_x_1{2, 1, {1, 3}};
constexpr Polynomial x3_x_1{3, 1, {1, 3, 1}};
constexpr Polynomial x3_x2_1{3, 2, {1, 1, 1}};

using Polynomials = std::array<Polynomial, 4>;
constexpr Polynomials of_points{one, x_1, x2_x_1, x3_x_1};
constexpr Polynomials of_shares{x_1, x2_x_1, x3_x_1, x3_x2_1};

// The sum of the direction numbers of the bits of each value of a byte, by place of the byte.
using Axes [[gnu::vector_size(16)]] = std::uint32_t;
constexpr std::size_t byte_count = 4;
using ByteTable = std::array<std::array<std::array<std::uint32_t, 4>, 256>, byte_count>;

constexpr ByteTable byte_table(const Polynomials& polynomials) {
  std::array<DirectionNumbers, 4> directions{};
  for (std::size_t axis = 0; axis < 4; ++axis)
    directions[axis] = direction_numbers(polynomials[axis]);
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

alignas(16) constexpr ByteTable sums_of_points = byte_table(of_points);
alignas(16) constexpr ByteTable sums_of_shares = byte_table(of_shares);

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

std::array<double, 4> scrambled_point(const ByteTable& sums, std::uint32_t number,
                                      const std::array<std::uint32_t, 4>& seeds) {
  Axes x{};
  for (std::size_t byte = 0; number != 0; number >>= 8, ++byte)
    x ^= std::bit_cast<Axes>(sums[byte][number & 255U]);
  x = owen_scramble(x, std::bit_cast<Axes>(seeds));
  std::array<double, 4> point{};
  for (std::size_t axis = 0; axis < 4; ++axis) point[axis] = (x[axis] + 0.5) * 0x1.0p-32;
  return point;
}

}  // namespace

std::uint32_t reverse_bits(std::uint32_t x) { return reversed(x); }

std::array<double, 4> ScrambledSobol::point(std::uint32_t index) const {
  return scrambled_point(sums_of_points, index, seeds_);
}

// The polynomial one makes the share: that coordinate begins with the number's last bits in
// reverse.
std::array<double, 4> ScrambledSobol::point_of_share(std::size_t share, std::uint32_t index) const {
  static_assert(share_count == 16);
  const std::uint32_t remainder = reversed(static_cast<std::uint32_t>(share)) >> 28;
  return scrambled_point(sums_of_shares, index * 16 + remainder, seeds_);
}

}  // namespace scarp
