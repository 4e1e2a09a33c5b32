#include "levelset/operations/necks.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace scarp {
namespace {

std::vector<double> found(std::vector<float> clearance, double thickness) {
  const int count = static_cast<int>(clearance.size());
  const NodeBox box{.count = {1, 1}, .lowest = 0, .highest = count - 1};
  return shutting_thicknesses(
      box, std::move(clearance), [](int, int) { return 0; }, thickness, 1);
}

// Columns from the bottom up; gas at the upper end is joined to the source.
TEST(Necks, ShutWhereTheyAreNarrowestOnTheWayUp) {
  using Thicknesses = std::vector<double>;
  EXPECT_EQ(found({1, 2, 3, 4, 5, 6}, 10), Thicknesses{});
  EXPECT_EQ(found({1, 5, 2, 8, 9}, 10), Thicknesses{2});
  EXPECT_EQ(found({1, 5, 2, 8, 9}, 1.5), Thicknesses{});
  EXPECT_EQ(found({9, 2, 7, 4, 8}, 10), (Thicknesses{2, 4}));
  // The outer neck shuts first, and nothing goes on behind it.
  EXPECT_EQ(found({9, 4, 7, 2, 8}, 10), Thicknesses{2});
  // Less than half a spacing wider is no room.
  EXPECT_EQ(found({5, 4.6F, 8}, 10), Thicknesses{});
  // Closed gas is none.
  EXPECT_EQ(found({5, 0, 8, 9}, 10), Thicknesses{});
}

// A pocket whose neck lies across a side that repeats.
TEST(Necks, LieAcrossSidesAsWell) {
  const NodeBox box{.count = {6, 1}, .lowest = 0, .highest = 1};
  std::vector<float> clearance(box.size(), 0);
  for (const auto& [i, value] : {std::pair(0, 3.0F), {1, 6.0F}, {5, 7.0F}, {4, 8.0F}})
    clearance[box.index(i, 0, 0)] = value;
  clearance[box.index(4, 0, 1)] = 9;
  const auto wrapped = [](int axis, int index) { return axis == 0 ? (index + 6) % 6 : 0; };
  EXPECT_EQ(shutting_thicknesses(box, clearance, wrapped, 10, 1), std::vector<double>{3});
  const auto mirrored = [](int axis, int index) {
    return axis == 0 ? std::clamp(std::abs(index), 0, 5) : 0;
  };
  EXPECT_EQ(shutting_thicknesses(box, clearance, mirrored, 10, 1), std::vector<double>{});
}

}  // namespace
}  // namespace scarp
