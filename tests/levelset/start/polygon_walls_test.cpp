#include "levelset/start/polygon_walls.h"

#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <vector>

namespace scarp {
namespace {

PolygonWalls walls(const std::vector<Loop>& loops, const WallHeights& heights) {
  const Frame frame{.spacing = 1, .cells = {60, 60}};
  const double growth = (heights.top - heights.foot) * std::tan(heights.slope);
  return {frame, domain_loops(frame, {loops}, growth), heights};
}

TEST(PolygonWalls, ARectangleHasTheDistanceOfItsSidesAndEdges) {
  const PolygonWalls box = walls({{{-10, -6}, {10, -6}, {10, 6}, {-10, 6}}}, {.foot = 0, .top = 9});
  EXPECT_NEAR(box({0, 0, 4}).value, -6, 1e-12);
  EXPECT_NEAR(box({13, 0, 4}).value, 3, 1e-12);
  EXPECT_NEAR(box({13, 10, 4}).value, 5, 1e-12);
  EXPECT_NEAR(box({9, 5.5, 4}).value, -0.5, 1e-12);
  // Above the rim it is the distance to the rim, with the sign of the side.
  EXPECT_NEAR(box({13, 0, 13}).value, 5, 1e-12);
  EXPECT_NEAR(box({7, 0, 13}).value, -5, 1e-12);
  EXPECT_NEAR(box({13, 10, 4}).normal.x, 0.6, 1e-12);
}

TEST(PolygonWalls, TaperedWallsKeepTheirSharpCorners) {
  const double slope = 0.2;
  const PolygonWalls box =
      walls({{{-10, -10}, {10, -10}, {10, 10}, {-10, 10}}}, {.foot = 0, .top = 9, .slope = slope});
  // The corner at height 6, and a point off a wall along its normal.
  const double wide = 10 + 6 * std::tan(slope);
  EXPECT_NEAR(box({wide, wide, 6}).value, 0, 1e-12);
  EXPECT_NEAR(box({wide + 2 * std::cos(slope), 0, 6 - 2 * std::sin(slope)}).value, 2, 1e-12);
  EXPECT_NEAR(box({wide - 2 * std::cos(slope), 0, 6 + 2 * std::sin(slope)}).value, -2, 1e-12);
  EXPECT_NEAR(box({wide - 2 * std::cos(slope), 0, 6 + 2 * std::sin(slope)}).normal.z,
              -std::sin(slope), 1e-12);
}

TEST(PolygonWalls, AHoleIsOutside) {
  const PolygonWalls ring =
      walls({{{-14, -14}, {14, -14}, {14, 14}, {-14, 14}}, {{-6, -6}, {6, -6}, {6, 6}, {-6, 6}}},
            {.foot = 0, .top = 9});
  EXPECT_NEAR(ring({0, 0, 4}).value, 6, 1e-12);
  EXPECT_NEAR(ring({9, 0, 4}).value, -3, 1e-12);
  EXPECT_NEAR(ring({7, 7, 4}).value, -std::sqrt(2), 1e-12);
}

// Upright walls are looked up in squares around the nodes of the domain, elsewhere in a tree of
// all; with a foot that goes on below, in the tree alone. All are the same to the last bit.
TEST(PolygonWalls, SquaresOfNodesKnowTheNearestWalls) {
  const std::vector<Loop> loops{{{-15, -12}, {12, -14}, {3, 2}, {14, 15}, {-9, 11}},
                                {{-8, -8}, {-8, -5}, {-6, -5}, {-6, -8}},
                                {{-4, -8}, {-4, -5}, {-2.5, -5}, {-2.5, -8}},
                                {{17, 0}, {19, 0}, {19, 2}, {17, 2}}};
  const WallHeights heights{.foot = 0, .top = 9};
  const PolygonWalls here({.spacing = 1, .cells = {60, 60}}, loops, heights);
  const PolygonWalls elsewhere({.spacing = 1, .cells = {2, 2}}, loops, heights);
  int near = 0;
  for (double x = -30; x < 30; x += 0.73) {
    for (double y = -30; y < 30; y += 0.71) {
      if (std::abs(x) < 3 && std::abs(y) < 3) continue;
      for (const double z : {-7.0, 0.0, 4.3, 9.0, 13.4}) {
        const Distance by_square = here({x, y, z});
        const Distance by_tree = elsewhere({x, y, z});
        if (std::abs(by_tree.value) == 12) continue;  // the sign is known in the domain alone
        ++near;
        ASSERT_EQ(by_square.value, by_tree.value) << x << ' ' << y << ' ' << z;
        ASSERT_EQ(by_square.normal, by_tree.normal) << x << ' ' << y << ' ' << z;
      }
    }
  }
  EXPECT_GT(near, 10000);
}

// Where each loop looked at the walls of all before it, this took nine seconds.
TEST(PolygonWalls, TenThousandLoopsAreBuiltAtOnce) {
  std::vector<Loop> loops;
  for (int i = 0; i < 100; ++i) {
    for (int j = 0; j < 100; ++j) {
      const double x = 4 * i - 200;
      const double y = 4 * j - 200;
      loops.push_back({{x, y}, {x + 2, y}, {x + 2, y + 2}, {x, y + 2}});
    }
  }
  const Frame frame{.spacing = 1, .cells = {400, 400}};
  const std::clock_t start = std::clock();
  const PolygonWalls squares(frame, loops, {.foot = 0, .top = 9});
  EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 2);
  EXPECT_NEAR(squares({1.5, 1, 4}).value, -0.5, 1e-12);
  EXPECT_NEAR(squares({3, 1, 4}).value, 1, 1e-12);
}

TEST(PolygonWalls, FarFromAllWallsTheSignIsRight) {
  const std::vector<Loop> loops{{{-26, -26}, {26, -26}, {26, 26}, {-26, 26}}};
  // Walls that lean over the middle of look-up cells.
  for (const double slope : {0.0, -0.5, 0.1}) {
    const PolygonWalls all = walls(loops, {.foot = 0, .top = 30, .slope = slope});
    for (double x = -29.3; x <= 29; x += 1.7) {
      for (double z = 1; z < 30; z += 4) {
        const double growth = z * std::tan(slope);
        const bool inside = std::abs(x) < 26 + growth;
        EXPECT_EQ(all({x, 0, z}).value < 0, inside) << x << ' ' << z << ' ' << slope;
      }
    }
  }
}

TEST(PolygonWalls, BelowTheFootTheyGoStraightDown) {
  const PolygonWalls box = walls({{{-10, -10}, {10, -10}, {10, 10}, {-10, 10}}},
                                 {.foot = 0, .top = 9, .lowest = -20, .slope = 0.3});
  EXPECT_NEAR(box({12, 0, -10}).value, 2, 1e-12);
  EXPECT_NEAR(box({8, 0, -10}).value, -2, 1e-12);
}

TEST(PolygonWalls, TheSlopeIsOneAlmostEverywhere) {
  const PolygonWalls shape = walls({{{-15, -12}, {12, -14}, {3, 2}, {14, 15}, {-9, 11}}},
                                   {.foot = 0, .top = 9, .slope = 0.2});
  for (double x = -18; x < 18; x += 1.37) {
    for (double y = -18; y < 18; y += 1.31) {
      const Vec3d r{x, y, 4.2};
      const Distance here = shape(r);
      if (std::abs(here.value) > 4 || std::abs(here.value) < 1e-3) continue;
      // The foot of the perpendicular lies on the surface.
      EXPECT_NEAR(shape(r - here.value * here.normal).value, 0, 1e-9) << x << ' ' << y;
    }
  }
}

}  // namespace
}  // namespace scarp
