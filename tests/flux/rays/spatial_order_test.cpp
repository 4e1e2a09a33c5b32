#include "flux/rays/spatial_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/flux/shapes.h"

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

std::uint32_t flight_key(Vec3f r, Vec3f u) {
  FlightStarts starts;
  starts.add({}, {1, 0, 0});
  starts.add(r, u);
  find_keys(starts);
  return starts.key[1];
}

// A place within an eighth of the domain along each axis counts less than the direction, and which
// eighth it is counts more.
TEST(FlightKey, PutsLargeCellsBeforeDirectionsBeforeSmallCells) {
  const Vec3f r{0.30F, 0.70F, 0.20F};
  const Vec3f same_cell{0.36F, 0.74F, 0.24F};
  const Vec3f next_cell{0.30F, 0.70F, 0.26F};
  EXPECT_LT(flight_key(r, {1, 1, 1}), flight_key(same_cell, {1, 1, 1}));
  EXPECT_LT(flight_key(same_cell, {1, 1, 1}), flight_key(r, {-1, 1, 1}));
  EXPECT_LT(flight_key(same_cell, {1, 1, 1}), flight_key(r, {3, 1, 1}));
  EXPECT_LT(flight_key(same_cell, {-1, -1, -1}), flight_key(next_cell, {1, 1, 1}));
}

// In each octant x or y may be longer than the other two components together, or neither.
TEST(FlightKey, TellsDirectionsNearAnAxisApart) {
  const Vec3f r{0.3F, 0.7F, 0.2F};
  EXPECT_EQ(flight_key(r, {3, 1, 1}), flight_key(r, {9, 1, 1}));
  EXPECT_NE(flight_key(r, {3, 1, 1}), flight_key(r, {1, 3, 1}));
  EXPECT_NE(flight_key(r, {1, 3, 1}), flight_key(r, {1, 1, 1}));
  EXPECT_LT(flight_key({1, 1, 1}, {-1, -1, -1}), 1U << 20);
}

template <class Key>
std::vector<std::uint32_t> by_the_library(const std::vector<Key>& keys) {
  std::vector<std::uint32_t> order(keys.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  return order;
}

TEST(SortedOrder, IsStable) {
  std::vector<std::uint32_t> keys;
  std::vector<std::uint64_t> long_keys;
  for (std::uint32_t i = 0; i < 5000; ++i) {
    keys.push_back((i * 2654435761U) >> 14 << 4);
    long_keys.push_back(std::uint64_t{keys.back()} << 20 | i % 7);
  }
  EXPECT_EQ(sorted_order(keys), by_the_library(keys));
  EXPECT_EQ(sorted_order(long_keys), by_the_library(long_keys));
  EXPECT_EQ(sorted_order(std::vector<std::uint32_t>(3)), (std::vector<std::uint32_t>{0, 1, 2}));
  EXPECT_TRUE(sorted_order(std::vector<std::uint32_t>()).empty());
}

TEST(SceneCells, TellCellsAndDirectionsApart) {
  const RayScene scene = scene_of(exact::trench(1));
  const SceneCells cells(scene, 2);
  const auto key = [&](Vec3d r) { return cells.key(r, 3); };
  EXPECT_EQ(key({0.1, 0.1, -3.9}), key({1.9, 1.9, -2.1}));
  EXPECT_LT(key({0.1, 0.1, -3.9}), key({0.1, 0.1, -1.9}));
  EXPECT_LT(key({0.1, 0.1, -0.1}), key({0.1, 2.1, -3.9}));
  EXPECT_LT(key({0.1, 7.9, -0.1}), key({2.1, 0.1, -3.9}));
  EXPECT_LT(cells.key({0.1, 0.1, -3.9}, 0), cells.key({0.1, 0.1, -3.9}, 5));
  EXPECT_EQ(SceneCells::direction(cells.key({0.1, 0.1, -3.9}, 5)), 5);
  EXPECT_LT(cells.key({scene.upper().x, scene.upper().y, scene.source_height()}, 5), cells.count());
  EXPECT_GE(cells.key({0, 0, scene.lowest()}, 0), 0U);
}

}  // namespace
}  // namespace scarp
