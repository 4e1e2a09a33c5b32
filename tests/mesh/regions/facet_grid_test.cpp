#include "mesh/regions/facet_grid.h"

#include <gtest/gtest.h>

namespace scarp {
namespace {

constexpr double clearance = 0.02;

/// Over the square of the unit from (x, y), three different vertices from the first number on.
PlacedTriangle triangle_at(std::uint32_t first, const Vec3d& r) {
  return {{first, first + 1, first + 2}, {r, r + Vec3d{1, 0, 0}, r + Vec3d{0, 1, 0}}};
}

void expect_collision(const PlacedTriangle& a, const PlacedTriangle& b, bool wanted) {
  EXPECT_EQ(collide(a, b, clearance), wanted);
  EXPECT_EQ(collide(b, a, clearance), wanted);
}

TEST(Collide, SheetsOnEachOther) {
  const PlacedTriangle lower = triangle_at(0, {0, 0, 120});
  for (const double z : {0.0, 1e-9, 1e-6, 0.01}) {
    SCOPED_TRACE(z);
    expect_collision(lower, triangle_at(3, {0.2, 0.2, 120 + z}), true);
    expect_collision(lower, triangle_at(3, {2, 0.2, 120 + z}), false);
  }
  expect_collision(lower, triangle_at(3, {0.2, 0.2, 120.03}), false);
}

// Extracted surfaces have heights in single precision.
TEST(Collide, CrossingsWithinRounding) {
  const PlacedTriangle floor{{0, 1, 2}, {Vec3d{-10, -20, 0}, {10, 0, 0}, {0, 10, 1e-6}}};
  expect_collision(floor, {{3, 4, 5}, {Vec3d{0, 0.5, -1e-6}, {1, 0.5, 8}, {0, 6, 8}}}, true);
  expect_collision(floor, {{2, 4, 5}, {Vec3d{0, 10, 1e-6}, {0, 0.5, -1e-6}, {4, 0.5, 8}}}, true);
  expect_collision(floor, {{2, 4, 5}, {Vec3d{0, 10, 1e-6}, {0, 0.5, 0.5}, {4, 0.5, 8}}}, false);
}

TEST(Collide, EdgesPastEachOther) {
  const PlacedTriangle flat{{0, 1, 2}, {Vec3d{0, 0, 0}, {2, 0, 0}, {1, -2, 0}}};
  for (const double gap : {0.01, 0.03}) {
    SCOPED_TRACE(gap);
    expect_collision(flat, {{3, 4, 5}, {Vec3d{1, gap, -1}, {1, gap, 1}, {1, 3, 0}}},
                     gap < clearance);
  }
}

TEST(Collide, NeighboursDoNot) {
  // Around a vertex in a plane; at an edge; folded onto each other.
  const Vec3d o{0, 0, 0};
  const PlacedTriangle a{{0, 1, 2}, {o, {1, 0, 0}, {0, 1, 0}}};
  expect_collision(a, {{0, 3, 4}, {o, {-1, 0, 0}, {0, -1, 0}}}, false);
  expect_collision(a, {{0, 2, 3}, {o, {0, 1, 0}, {-1, 0, 0}}}, false);
  expect_collision(a, {{0, 2, 3}, {o, {0, 1, 0}, {1, 0.2, 0.01}}}, true);
  expect_collision(a, a, true);
}

}  // namespace
}  // namespace scarp
