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

const Frame plane_frame{.spacing = 1, .cells = {160, 160}};
const RegionGrid fine_grid = region_grid(plane_frame);
const Loop wide_box = box_loop({-100, -100}, {100, 100});

Loop square_at(double x, double y, double half) {
  return box_loop({x - half, y - half}, {x + half, y + half});
}

/// 20 x 20 less its upper right quarter.
const Loop corner_piece{{-10, -10}, {10, -10}, {10, 0}, {0, 0}, {0, 10}, {-10, 10}};

double sized_area(const std::vector<Loop>& loops, const Sizing& sizing) {
  return area(fine_grid.sized(loops, wide_box, sizing));
}

TEST(Region, CombinesTwoRegions) {
  const std::vector<Loop> a{square_at(0, 0, 10)};
  const std::vector<Loop> b{square_at(10, 10, 10)};
  EXPECT_DOUBLE_EQ(area(fine_grid.combined(a, b, Combination::sum)), 700);
  EXPECT_DOUBLE_EQ(area(fine_grid.combined(a, b, Combination::difference)), 300);
  EXPECT_DOUBLE_EQ(area(fine_grid.combined(a, b, Combination::intersection)), 100);
}

TEST(Region, UnitesLoopsThatCrossThemselves) {
  const std::vector<Loop> bowtie{{{-10, -10}, {10, 10}, {10, -10}, {-10, 10}}, square_at(0, 0, 1)};
  // Two triangles, and what of the square lies in neither.
  EXPECT_NEAR(area(fine_grid.united(bowtie)), 200 + 2, 1e-9);
}

TEST(Region, HasPartsWithTheirHoles) {
  const auto ring =
      fine_grid.combined({square_at(0, 0, 10)}, {square_at(0, 0, 6)}, Combination::difference);
  const auto all =
      fine_grid.combined(ring, {square_at(0, 0, 3), square_at(30, 0, 5)}, Combination::sum);
  const auto parts = fine_grid.parts(all);
  ASSERT_EQ(parts.size(), 3U);
  std::multiset<double> areas;
  for (const auto& part : parts) areas.insert(area(part));
  EXPECT_EQ(areas, (std::multiset<double>{36, 100, 400 - 144}));
}

TEST(Region, GrowsWithSharpOrRoundCorners) {
  const double round = std::numbers::pi * 9;
  EXPECT_NEAR(sized_area({square_at(0, 0, 10)}, {.grow = 3}), 26 * 26, 1e-9);
  EXPECT_NEAR(sized_area({square_at(0, 0, 10)}, {.grow = 3, .is_round = true}),
              400 + 4 * 60 + round, 0.003 * round);
  // The inner corner stays sharp either way; five outer ones.
  EXPECT_NEAR(sized_area({corner_piece}, {.grow = 3}), 26 * 26 - 100, 1e-9);
  EXPECT_NEAR(sized_area({corner_piece}, {.grow = 3, .is_round = true}),
              26 * 26 - 100 - 5 * (9 - round / 4), 0.003 * round);
}

TEST(Region, ShrinksWithSharpOrRoundCorners) {
  EXPECT_NEAR(sized_area({square_at(0, 0, 10)}, {.grow = -3}), 14 * 14, 1e-9);
  EXPECT_NEAR(sized_area({square_at(0, 0, 10)}, {.grow = -3, .is_round = true}), 14 * 14, 1e-9);
  EXPECT_NEAR(sized_area({corner_piece}, {.grow = -3}), 14 * 14 - 100, 1e-9);
  // Of the inner corner the outside is what grows.
  EXPECT_NEAR(sized_area({corner_piece}, {.grow = -3, .is_round = true}),
              14 * 14 - 100 + 9 - std::numbers::pi * 9 / 4, 0.02);
  EXPECT_TRUE(fine_grid.sized({square_at(0, 0, 10)}, wide_box, {.grow = -10}).empty());
}

TEST(Region, CornersSharperThanRightAnglesAreRoundWhenTheyGrow) {
  const Loop wedge{{0, 0}, {40, -4}, {40, 4}};
  for (const Loop& loop : fine_grid.sized({wedge}, wide_box, {.grow = 2}))
    for (const Point2& r : loop) EXPECT_GE(r[0], -2.0001);
}

TEST(Region, CornersBecomeArcs) {
  const double lost = (4 - std::numbers::pi) * 16;  // of four corners
  EXPECT_NEAR(sized_area({square_at(0, 0, 10)}, {.corner_radius = 4}), 400 - lost, 0.01 * lost);
  EXPECT_NEAR(sized_area({corner_piece}, {.corner_radius = 4}), 300 - lost, 0.01 * lost);
  const auto framed =
      fine_grid.combined({square_at(0, 0, 30)}, {square_at(0, 0, 10)}, Combination::difference);
  EXPECT_NEAR(sized_area(framed, {.corner_radius = 4}), 3600 - 400, 0.01 * lost);
}

TEST(Region, ArcsAreRoundToAHundredthOfASpacing) {
  for (const double radius : {0.7, 4.0, 9.5}) {
    const auto rounded =
        fine_grid.sized({square_at(0, 0, 10)}, wide_box, {.corner_radius = radius});
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

TEST(Region, SizingLeavesNoCrumbs) {
  const Loop some{{-20, -13.3}, {17.1, -15}, {23, 4.7}, {6, 2}, {-4.4, 19}};
  for (const double radius : {0.3, 1.0, 3.0}) {
    for (const Loop& loop : {some, corner_piece}) {
      const auto rounded =
          fine_grid.sized({loop}, wide_box, {.grow = 1, .is_round = true, .corner_radius = radius});
      EXPECT_EQ(rounded.size(), 1U) << radius;
    }
  }
}

TEST(Region, AMirroredRegionHasMirroredArcs) {
  const Loop some{{-20, -13.3}, {17.1, -15}, {23, 4.7}, {6, 2}, {-4.4, 19}};
  Loop mirrored = some;
  for (Point2& r : mirrored) r[0] = -r[0];
  std::reverse(mirrored.begin(), mirrored.end());
  for (const Sizing& sizing : {Sizing{.grow = 3.3}, Sizing{.grow = 3.3, .is_round = true},
                               Sizing{.grow = -2.1, .is_round = true}}) {
    EXPECT_EQ(points_of(fine_grid.sized({some}, wide_box, sizing), 1),
              points_of(fine_grid.sized({mirrored}, wide_box, sizing), -1));
  }
}

double distance_to_line(const Point2& r, const Point2& a, const Point2& b) {
  const Point2 u{b[0] - a[0], b[1] - a[1]};
  const double s = std::clamp(
      ((r[0] - a[0]) * u[0] + (r[1] - a[1]) * u[1]) / (u[0] * u[0] + u[1] * u[1]), 0.0, 1.0);
  return std::hypot(r[0] - a[0] - s * u[0], r[1] - a[1] - s * u[1]);
}

bool surrounds(const std::vector<Loop>& loops, const Point2& r) {
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
double distance_to_region(const std::vector<Loop>& loops, const Point2& r) {
  double distance = 1e9;
  for (const Loop& loop : loops)
    for (std::size_t p = 0; p < loop.size(); ++p)
      distance = std::min(distance, distance_to_line(r, loop[p], loop[(p + 1) % loop.size()]));
  return surrounds(loops, r) ? -distance : distance;
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
    const std::vector<Loop> region = fine_grid.united(drawn);
    const double grow = between(-4, 8);
    const std::vector<Loop> sized =
        fine_grid.sized(region, wide_box, {.grow = grow, .is_round = true});
    for (int n = 0; n < 200; ++n) {
      const Point2 r{between(-60, 60), between(-60, 60)};
      const double away = distance_to_region(region, r) - grow;
      if (std::abs(away) < 0.01) continue;
      EXPECT_EQ(surrounds(sized, r), away < 0) << "seed " << seed;
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
  const PolygonOutline grown{{square_at(20, 0, 5)}, Rule::any, {.grow = 2}};
  EXPECT_NEAR(area(domain_loops(periodic, grown)), 2 * 14 * 14, 1e-6);
}

TEST(Region, CountsWhatASizingLeavesNothingOf) {
  const auto losses = [&](const std::vector<Loop>& loops, const Sizing& sizing) {
    return sizing_losses(plane_frame, {loops, PolygonOutline::Rule::even_odd, sizing});
  };
  const std::vector<Loop> loops{square_at(0, 0, 20), square_at(0, 0, 4), square_at(50, 0, 3),
                                square_at(-50, 0, 9)};
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
