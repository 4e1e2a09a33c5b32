#include "flux/sampling/sobol.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <set>
#include <vector>

namespace scarp {
namespace {

ScrambledSobol sequence(std::uint32_t seed) {
  return ScrambledSobol(
      {seed * 2654435761U + 1, seed * 40503U + 77, seed ^ 0xDEADBEEFU, ~seed * 97});
}

using Point = std::array<double, 4>;

// Each box whose sides are powers of 1/2 and whose fair part is so many of the points holds them.
void expect_fair_boxes(const std::vector<Point>& points, const std::vector<std::size_t>& axes,
                       std::size_t points_per_box) {
  const std::size_t boxes = points.size() / points_per_box;
  std::vector<int> bits(axes.size());
  const auto split = [&](auto&& self, std::size_t axis, int left) -> void {
    if (axis + 1 < axes.size()) {
      for (bits[axis] = 0; bits[axis] <= left; ++bits[axis])
        self(self, axis + 1, left - bits[axis]);
      return;
    }
    bits[axis] = left;
    std::map<std::vector<int>, std::size_t> found;
    for (const Point& point : points) {
      std::vector<int> box;
      for (std::size_t k = 0; k < axes.size(); ++k)
        box.push_back(static_cast<int>(std::ldexp(point[axes[k]], bits[k])));
      ++found[box];
    }
    EXPECT_EQ(found.size(), boxes) << ::testing::PrintToString(bits);
    for (const auto& [box, count] : found)
      EXPECT_EQ(count, points_per_box) << ::testing::PrintToString(bits);
  };
  split(split, 0, std::countr_zero(boxes));
}

// Every axis, and the first two together, hold one point in each box of the volume of one; all four
// eight in each that is as large as eight (t = 3).
TEST(ScrambledSobol, FillsElementaryBoxesEvenly) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    const ScrambledSobol sobol = sequence(seed);
    std::vector<Point> points;
    for (std::uint32_t i = 0; i < 256; ++i) points.push_back(sobol.point(i));
    for (std::size_t axis = 0; axis < 4; ++axis) expect_fair_boxes(points, {axis}, 1);
    expect_fair_boxes(points, {0, 1}, 1);
    expect_fair_boxes(points, {0, 1, 2, 3}, 8);
  }
}

// The first points of a share are a net of their own, and so are those of 2, 4, 8 and 16 shares in
// a row: together they have a fifth coordinate (t = 5, and 3 for the first two axes).
TEST(ScrambledSobol, SharesAreFairThemselvesAndTogether) {
  const ScrambledSobol sobol = sequence(3);
  for (const std::size_t shares : {1U, 2U, 4U, 8U, 16U}) {
    for (std::size_t first = 0; first < share_count; first += shares) {
      std::vector<Point> points;
      for (std::size_t share = first; share < first + shares; ++share)
        for (std::uint32_t index = 0; index < 256 / shares; ++index)
          points.push_back(sobol.point_of_share(share, index));
      for (std::size_t axis = 0; axis < 4; ++axis) expect_fair_boxes(points, {axis}, 1U << axis);
      expect_fair_boxes(points, {0, 1, 2, 3}, 32);
    }
  }
}

TEST(ScrambledSobol, SharesHoldDifferentPoints) {
  const ScrambledSobol sobol = sequence(3);
  std::set<double> first_axis;
  for (std::uint32_t index = 0; index < 256; ++index)
    for (std::size_t share = 0; share < share_count; ++share)
      first_axis.insert(std::floor(sobol.point_of_share(share, index)[0] * 4096));
  EXPECT_EQ(first_axis.size(), 4096U);
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
