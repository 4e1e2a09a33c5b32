#include "flux/sobol.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <vector>

namespace scarp {
namespace {

ScrambledSobol sequence(std::uint32_t seed) {
  return ScrambledSobol(
      {seed * 2654435761U + 1, seed * 40503U + 77, seed ^ 0xDEADBEEFU, ~seed * 97});
}

// In a net each elementary box of `points` times the fair volume holds as many points.
// Source: Sobol 1967; t = 1 and 2 for two and three of the polynomials of higher degree, and points
// = 2^t.
void expect_fair_boxes(const ScrambledSobol& sobol, const std::vector<std::uint32_t>& numbers,
                       const std::vector<unsigned>& axes, std::uint32_t points) {
  const auto boxes = static_cast<unsigned>(numbers.size()) / points;
  const unsigned m = std::countr_zero(boxes);
  ASSERT_EQ(1U << m, boxes);
  std::vector<unsigned> bits(axes.size());
  const auto of_split = [&](auto&& self, std::size_t axis, unsigned left) -> void {
    if (axis + 1 < axes.size()) {
      for (bits[axis] = 0; bits[axis] <= left; ++bits[axis]) self(self, axis + 1, left - bits[axis]);
      return;
    }
    bits[axis] = left;
    std::map<std::vector<int>, std::uint32_t> count;
    for (const std::uint32_t number : numbers) {
      const auto x = sobol.point(number);
      std::vector<int> box;
      for (std::size_t k = 0; k < axes.size(); ++k)
        box.push_back(static_cast<int>(x[axes[k]] * (1U << bits[k])));
      ++count[box];
    }
    EXPECT_EQ(count.size(), boxes) << ::testing::PrintToString(bits);
    for (const auto& [box, of_box] : count)
      EXPECT_EQ(of_box, points) << ::testing::PrintToString(bits);
  };
  of_split(of_split, 0, m);
}

std::vector<std::uint32_t> first_numbers(std::uint32_t count) {
  std::vector<std::uint32_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0U);
  return numbers;
}

TEST(ScrambledSobol, FillsElementaryBoxesEvenly) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    const ScrambledSobol sobol = sequence(seed);
    for (unsigned axis = 0; axis < 4; ++axis)
      expect_fair_boxes(sobol, first_numbers(256), {axis}, 1);
    expect_fair_boxes(sobol, first_numbers(256), {0, 1}, 2);
    expect_fair_boxes(sobol, first_numbers(256), {0, 2}, 4);
    expect_fair_boxes(sobol, first_numbers(256), {0, 1, 2, 3}, 32);
  }
}

TEST(NumberInShare, TellsEachNumberOnce) {
  std::set<std::uint32_t> numbers;
  for (std::uint32_t index = 0; index < 100; ++index) {
    for (std::size_t share = 0; share < share_count; ++share)
      numbers.insert(number_in_share(share, index));
    EXPECT_EQ(numbers.size(), (index + 1) * share_count);
    EXPECT_EQ(*numbers.rbegin(), numbers.size() - 1);
  }
}

// The points of a share are a net of their own, and so are those of half of the shares, of a
// quarter, and of two neighbours.
TEST(NumberInShare, SharesAreFairThemselvesAndTogether) {
  const ScrambledSobol sobol = sequence(3);
  for (const std::uint32_t shares : {1U, 2U, 4U, 8U}) {
    for (std::uint32_t first = 0; first < share_count; first += shares) {
      std::vector<std::uint32_t> numbers;
      for (std::uint32_t share = first; share < first + shares; ++share)
        for (std::uint32_t index = 0; index < 256 / shares; ++index)
          numbers.push_back(number_in_share(share, index));
      for (unsigned axis = 0; axis < 4; ++axis) expect_fair_boxes(sobol, numbers, {axis}, 8);
      expect_fair_boxes(sobol, numbers, {0, 1}, 8);
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
