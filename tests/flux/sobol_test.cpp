#include "flux/sobol.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

namespace scarp {
namespace {

ScrambledSobol sequence(std::uint32_t seed) {
  return ScrambledSobol(
      {seed * 2654435761U + 1, seed * 40503U + 77, seed ^ 0xDEADBEEFU, ~seed * 97});
}

// Every axis, and the first two together, divide 2^m points evenly over boxes of volume 2^-m.
TEST(ScrambledSobol, FillsElementaryBoxesWithOnePointEach) {
  constexpr unsigned m = 8;
  constexpr std::uint32_t count = 1U << m;
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    const ScrambledSobol sobol = sequence(seed);
    for (std::size_t axis = 0; axis < 4; ++axis) {
      std::set<int> cells;
      for (std::uint32_t i = 0; i < count; ++i)
        cells.insert(static_cast<int>(sobol.point(i)[axis] * count));
      EXPECT_EQ(cells.size(), count) << axis;
    }
    for (unsigned bits = 0; bits <= m; ++bits) {
      std::set<std::pair<int, int>> cells;
      for (std::uint32_t i = 0; i < count; ++i) {
        const auto x = sobol.point(i);
        cells.insert(
            {static_cast<int>(x[0] * (1U << bits)), static_cast<int>(x[1] * (1U << (m - bits)))});
      }
      EXPECT_EQ(cells.size(), count) << bits;
    }
  }
}

// Over many scramblings each point is uniform, and the error of a mean behaves: a smooth function
// is integrated far better than by independent numbers.
TEST(ScrambledSobol, IsUniformAndSpread) {
  constexpr int seeds = 2000;
  constexpr std::uint32_t count = 16;
  double mean_of_one = 0;
  double mean = 0;
  double squares = 0;
  for (std::uint32_t seed = 1; seed <= seeds; ++seed) {
    const ScrambledSobol sobol = sequence(seed);
    mean_of_one += sobol.point(5)[2] / seeds;
    double sum = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto x = sobol.point(i);
      sum += x[0] * x[1] / count;
    }
    mean += sum / seeds;
    squares += (sum - 0.25) * (sum - 0.25) / seeds;
  }
  const double independent = (1.0 / 9 - 1.0 / 16) / count;
  EXPECT_NEAR(mean_of_one, 0.5, 5 * std::sqrt(1.0 / 12 / seeds));
  EXPECT_NEAR(mean, 0.25, 5 * std::sqrt(squares / seeds));
  EXPECT_LT(squares, independent / 20);
}

TEST(ReverseBits, TurnsTheWordAround) {
  EXPECT_EQ(reverse_bits(1), 0x80000000U);
  EXPECT_EQ(reverse_bits(0x12345678U), 0x1E6A2C48U);
}

}  // namespace
}  // namespace scarp
