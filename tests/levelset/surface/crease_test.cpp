// What is read from phi where the surface has edges and corners.

#include "levelset/surface/crease.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "levelset/grid/level_set.h"

namespace scarp {
namespace {

constexpr double slope = 0.7;

/// A slope of 0.7 by some part of x and y; -0.3 at the nodes where that part is 0 and z is 0.
LevelSet sloping(const std::function<double(Vec3d)>& along) {
  const Frame frame{.spacing = 1, .cells = {16, 16}};
  const auto distance = [&](Vec3d r) {
    return (r.z + slope * along(r) - 0.3) / std::hypot(1, slope);
  };
  return {frame, distance, -20, 20};
}

// The node of the grid in the middle of the domain.
constexpr std::array<int, 3> middle{8, 8, 0};

TEST(CutNormal, IsUprightOnARidge) {
  const LevelSet ridge = sloping([](Vec3d r) { return std::abs(r.x); });
  const Vec3d normal = cut_normal(ridge.band(), middle, 2);
  EXPECT_EQ(normal.x, 0);
  EXPECT_EQ(normal.y, 0);
  EXPECT_EQ(normal.z, 1);
}

// Of two slopes that are each other's image across x = y neither is better.
TEST(CutNormal, IsItsOwnImageWhereTheSurfaceIs) {
  const LevelSet pit = sloping([](Vec3d r) { return std::max(r.x, r.y); });
  const Vec3d normal = cut_normal(pit.band(), middle, 2);
  EXPECT_GT(normal.x, 0.2);
  EXPECT_EQ(normal.x, normal.y);
}

// Off the plane of symmetry there is no doubt.
TEST(CutNormal, IsThatOfTheFaceBesideACrease) {
  const LevelSet ridge = sloping([](Vec3d r) { return std::abs(r.x); });
  const Vec3d normal = cut_normal(ridge.band(), {10, 8, -1}, 2);
  EXPECT_NEAR(normal.x, slope / std::hypot(1, slope), 1e-6);
  EXPECT_NEAR(normal.z, 1 / std::hypot(1, slope), 1e-6);
}

}  // namespace
}  // namespace scarp
