#include "flux/spatial_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace scarp {
namespace {

TEST(MainDirection, IsTheNearestAxis) {
  EXPECT_EQ(main_direction({1, 0, 0}), 0);
  EXPECT_EQ(main_direction({-0.8, 0.5, 0.2}), 1);
  EXPECT_EQ(main_direction({0.1, 0.9, -0.3}), 2);
  EXPECT_EQ(main_direction({0, -1, 0}), 3);
  EXPECT_EQ(main_direction({0.3, 0.3, 0.9}), 4);
  EXPECT_EQ(main_direction({0, 0, -1}), 5);
}

// The curve walks through one half of the cube along z before the other, then y, then x.
TEST(CurveKey, FollowsNestedHalves) {
  EXPECT_LT(curve_key({0.9, 0.9, 0.4}, 0), curve_key({0.1, 0.1, 0.6}, 0));
  EXPECT_LT(curve_key({0.9, 0.4, 0.1}, 0), curve_key({0.1, 0.6, 0.1}, 0));
  EXPECT_LT(curve_key({0.9, 0.9, 0.9}, 0), curve_key({0.1, 0.1, 0.1}, 1));
  EXPECT_NE(curve_key({0.5, 0.5, 0.5}, 0), curve_key({0.5 + 0x1p-16, 0.5, 0.5}, 0));
  EXPECT_EQ(curve_key({1, 1, 1}, 0), (std::uint64_t{1} << 48) - 1);
}

// A place within an eighth of the domain along each axis counts less than the direction, and which
// eighth it is counts more.
TEST(FlightKey, PutsLargeCellsBeforeDirectionsBeforeSmallCells) {
  const Vec3d r{0.30, 0.70, 0.20};
  const Vec3d same_cell{0.36, 0.74, 0.24};
  const Vec3d next_cell{0.30, 0.70, 0.26};
  EXPECT_LT(flight_key(r, {1, 1, 1}), flight_key(same_cell, {1, 1, 1}));
  EXPECT_LT(flight_key(same_cell, {1, 1, 1}), flight_key(r, {-1, 1, 1}));
  EXPECT_LT(flight_key(same_cell, {1, 1, 1}), flight_key(r, {3, 1, 1}));
  EXPECT_LT(flight_key(same_cell, {-1, -1, -1}), flight_key(next_cell, {1, 1, 1}));
}

// In each octant x or y may be longer than the other two components together, or neither.
TEST(FlightKey, TellsDirectionsNearAnAxisApart) {
  const Vec3d r{0.3, 0.7, 0.2};
  EXPECT_EQ(flight_key(r, {3, 1, 1}), flight_key(r, {9, 1, 1}));
  EXPECT_NE(flight_key(r, {3, 1, 1}), flight_key(r, {1, 3, 1}));
  EXPECT_NE(flight_key(r, {1, 3, 1}), flight_key(r, {1, 1, 1}));
  EXPECT_LT(flight_key({1, 1, 1}, {-1, -1, -1}), 1U << 20);
}

TEST(SortedOrder, IsStable) {
  std::vector<std::uint32_t> keys;
  for (std::uint32_t i = 0; i < 5000; ++i) keys.push_back((i * 2654435761U) >> 14 << 4);
  std::vector<std::uint32_t> expected(keys.size());
  std::iota(expected.begin(), expected.end(), 0U);
  std::stable_sort(expected.begin(), expected.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  EXPECT_EQ(sorted_order(keys), expected);
}

}  // namespace
}  // namespace scarp
