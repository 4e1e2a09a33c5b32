#include "levelset/start/region.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "levelset/start/polygon.h"

namespace scarp {
namespace {

using Combination = RegionGrid::Combination;

const Frame frame{.spacing = 1, .cells = {160, 160}};
const RegionGrid grid = region_grid(frame);
const Loop around = box_loop({-100, -100}, {100, 100});

Loop square(double x, double y, double half) {
  return box_loop({x - half, y - half}, {x + half, y + half});
}

/// 20 x 20 less its upper right quarter.
const Loop corner_piece{{-10, -10}, {10, -10}, {10, 0}, {0, 0}, {0, 10}, {-10, 10}};

double sized_area(const std::vector<Loop>& loops, const Sizing& sizing) {
  return area(grid.sized(loops, around, sizing));
}

TEST(Region, CombinesTwoRegions) {
  const std::vector<Loop> a{square(0, 0, 10)};
  const std::vector<Loop> b{square(10, 10, 10)};
  EXPECT_DOUBLE_EQ(area(grid.combined(a, b, Combination::sum)), 700);
  EXPECT_DOUBLE_EQ(area(grid.combined(a, b, Combination::difference)), 300);
  EXPECT_DOUBLE_EQ(area(grid.combined(a, b, Combination::intersection)), 100);
}

TEST(Region, UnitesLoopsThatCrossThemselves) {
  const std::vector<Loop> bowtie{{{-10, -10}, {10, 10}, {10, -10}, {-10, 10}}, square(0, 0, 1)};
  // Two triangles, and what of the square lies in neither.
  EXPECT_NEAR(area(grid.united(bowtie)), 200 + 2, 1e-9);
}

TEST(Region, HasPartsWithTheirHoles) {
  const auto ring = grid.combined({square(0, 0, 10)}, {square(0, 0, 6)}, Combination::difference);
  const auto all = grid.combined(ring, {square(0, 0, 3), square(30, 0, 5)}, Combination::sum);
  const auto parts = grid.parts(all);
  ASSERT_EQ(parts.size(), 3U);
  std::multiset<double> areas;
  for (const auto& part : parts) areas.insert(area(part));
  EXPECT_EQ(areas, (std::multiset<double>{36, 100, 400 - 144}));
}

TEST(Region, GrowsWithSharpOrRoundCorners) {
  const double round = std::numbers::pi * 9;
  EXPECT_NEAR(sized_area({square(0, 0, 10)}, {.grow = 3}), 26 * 26, 1e-9);
  EXPECT_NEAR(sized_area({square(0, 0, 10)}, {.grow = 3, .is_round = true}), 400 + 4 * 60 + round,
              0.003 * round);
  // The inner corner stays sharp either way; five outer ones.
  EXPECT_NEAR(sized_area({corner_piece}, {.grow = 3}), 26 * 26 - 100, 1e-9);
  EXPECT_NEAR(sized_area({corner_piece}, {.grow = 3, .is_round = true}),
              26 * 26 - 100 - 5 * (9 - round / 4), 0.003 * round);
}

TEST(Region, ShrinksWithSharpOrRoundCorners) {
  EXPECT_NEAR(sized_area({square(0, 0, 10)}, {.grow = -3}), 14 * 14, 1e-9);
  EXPECT_NEAR(sized_area({square(0, 0, 10)}, {.grow = -3, .is_round = true}), 14 * 14, 1e-9);
  EXPECT_NEAR(sized_area({corner_piece}, {.grow = -3}), 14 * 14 - 100, 1e-9);
  // Of the inner corner the outside is what grows.
  EXPECT_NEAR(sized_area({corner_piece}, {.grow = -3, .is_round = true}),
              14 * 14 - 100 + 9 - std::numbers::pi * 9 / 4, 0.02);
  EXPECT_TRUE(grid.sized({square(0, 0, 10)}, around, {.grow = -10}).empty());
}

TEST(Region, CornersSharperThanRightAnglesAreRoundWhenTheyGrow) {
  const Loop wedge{{0, 0}, {40, -4}, {40, 4}};
  for (const Loop& loop : grid.sized({wedge}, around, {.grow = 2}))
    for (const Point2& r : loop) EXPECT_GE(r[0], -2.0001);
}

TEST(Region, CornersBecomeArcs) {
  const double lost = (4 - std::numbers::pi) * 16;  // of four corners
  EXPECT_NEAR(sized_area({square(0, 0, 10)}, {.corner_radius = 4}), 400 - lost, 0.01 * lost);
  EXPECT_NEAR(sized_area({corner_piece}, {.corner_radius = 4}), 300 - lost, 0.01 * lost);
  const auto framed =
      grid.combined({square(0, 0, 30)}, {square(0, 0, 10)}, Combination::difference);
  EXPECT_NEAR(sized_area(framed, {.corner_radius = 4}), 3600 - 400, 0.01 * lost);
}

TEST(Region, ArcsAreRoundToAHundredthOfASpacing) {
  for (const double radius : {0.7, 4.0, 9.5}) {
    const auto rounded = grid.sized({square(0, 0, 10)}, around, {.corner_radius = radius});
    ASSERT_EQ(rounded.size(), 1U);
    const double centre = 10 - radius;
    for (std::size_t p = 0; p < rounded[0].size(); ++p) {
      const Point2& a = rounded[0][p];
      const Point2& b = rounded[0][(p + 1) % rounded[0].size()];
      for (const double s : {0.0, 0.5}) {
        const double x = std::abs(a[0] + s * (b[0] - a[0]));
        const double y = std::abs(a[1] + s * (b[1] - a[1]));
        const double distance = x > centre && y > centre
                                    ? std::hypot(x - centre, y - centre) - radius
                                    : std::max(x, y) - 10;
        EXPECT_NEAR(distance, 0, 0.01);
      }
    }
  }
}

/// Points of loops, in an order of their own.
std::multiset<Point2> points_of(const std::vector<Loop>& loops, double side) {
  std::multiset<Point2> points;
  for (const Loop& loop : loops)
    for (const Point2& r : loop) points.insert({side * r[0], r[1]});
  return points;
}

TEST(Region, AMirroredRegionHasMirroredArcs) {
  const Loop some{{-20, -13.3}, {17.1, -15}, {23, 4.7}, {6, 2}, {-4.4, 19}};
  Loop mirrored = some;
  for (Point2& r : mirrored) r[0] = -r[0];
  std::reverse(mirrored.begin(), mirrored.end());
  for (const Sizing& sizing : {Sizing{.grow = 3.3}, Sizing{.grow = 3.3, .is_round = true},
                               Sizing{.grow = -2.1, .is_round = true}}) {
    EXPECT_EQ(points_of(grid.sized({some}, around, sizing), 1),
              points_of(grid.sized({mirrored}, around, sizing), -1));
  }
}

double distance_to(const Point2& r, const Point2& a, const Point2& b) {
  const Point2 u{b[0] - a[0], b[1] - a[1]};
  const double s = std::clamp(
      ((r[0] - a[0]) * u[0] + (r[1] - a[1]) * u[1]) / (u[0] * u[0] + u[1] * u[1]), 0.0, 1.0);
  return std::hypot(r[0] - a[0] - s * u[0], r[1] - a[1] - s * u[1]);
}

bool holds(const std::vector<Loop>& loops, const Point2& r) {
  bool inside = false;
  for (const Loop& loop : loops) {
    for (std::size_t p = 0; p < loop.size(); ++p) {
      const Point2& a = loop[p];
      const Point2& b = loop[(p + 1) % loop.size()];
      if ((a[1] > r[1]) != (b[1] > r[1]) &&
          r[0] < a[0] + (r[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
        inside = !inside;
    }
  }
  return inside;
}

/// Negative inside.
double signed_distance(const std::vector<Loop>& loops, const Point2& r) {
  double distance = 1e9;
  for (const Loop& loop : loops)
    for (std::size_t p = 0; p < loop.size(); ++p)
      distance = std::min(distance, distance_to(r, loop[p], loop[(p + 1) % loop.size()]));
  return holds(loops, r) ? -distance : distance;
}

TEST(Region, RandomOnesGrowByTheirDistance) {
  std::mt19937 random(1);
  const auto between = [&](double lower, double upper) {
    return lower + (upper - lower) * (static_cast<double>(random() % 100000) / 100000);
  };
  for (int seed = 0; seed < 60; ++seed) {
    std::vector<Loop> drawn;
    for (int n = 0; n < 4; ++n) {
      Loop& loop = drawn.emplace_back();
      for (int p = 0; p < 5; ++p) loop.push_back({between(-40, 40), between(-40, 40)});
    }
    const std::vector<Loop> region = grid.united(drawn);
    const double grow = between(-4, 8);
    const std::vector<Loop> sized = grid.sized(region, around, {.grow = grow, .is_round = true});
    for (int n = 0; n < 200; ++n) {
      const Point2 r{between(-60, 60), between(-60, 60)};
      const double away = signed_distance(region, r) - grow;
      if (std::abs(away) > 0.01) EXPECT_EQ(holds(sized, r), away < 0) << "seed " << seed;
    }
  }
}

TEST(Region, SizingActsOnWhatTheDomainShows) {
  using Rule = PolygonOutline::Rule;
  const Frame narrow{.spacing = 1, .cells = {40, 160}};
  Frame periodic = narrow;
  periodic.boundary[0] = Boundary::periodic;
  // A line that ends on the sides is endless there.
  const Loop line = box_loop({-20, -10}, {20, 10});
  for (const Frame& each : {narrow, periodic}) {
    const PolygonOutline shrunk{{line}, Rule::even_odd, {.grow = -3, .corner_radius = 2}};
    EXPECT_NEAR(area(domain_loops(each, shrunk)), (40 + 48) * 14, 1e-6);
  }
  // A square across a periodic side grows on both.
  const PolygonOutline grown{{square(20, 0, 5)}, Rule::any, {.grow = 2}};
  EXPECT_NEAR(area(domain_loops(periodic, grown)), 2 * 14 * 14, 1e-6);
}

TEST(Region, CountsWhatASizingLeavesNothingOf) {
  const auto losses = [&](const std::vector<Loop>& loops, const Sizing& sizing) {
    return sizing_losses(frame, {loops, PolygonOutline::Rule::even_odd, sizing});
  };
  const std::vector<Loop> loops{square(0, 0, 20), square(0, 0, 4), square(50, 0, 3),
                                square(-50, 0, 9)};
  const SizingLosses shrunk = losses(loops, {.grow = -4});
  EXPECT_EQ(shrunk.shapes, 3U);
  EXPECT_EQ(shrunk.vanished, 1U);
  EXPECT_EQ(shrunk.closed, 0U);
  const SizingLosses grown = losses(loops, {.grow = 5});
  EXPECT_EQ(grown.vanished, 0U);
  EXPECT_EQ(grown.gaps, 2U);
  EXPECT_EQ(grown.closed, 1U);
  const SizingLosses rounded = losses(loops, {.corner_radius = 5});
  EXPECT_EQ(rounded.vanished, 1U);
  EXPECT_EQ(rounded.closed, 1U);
}

}  // namespace
}  // namespace scarp
