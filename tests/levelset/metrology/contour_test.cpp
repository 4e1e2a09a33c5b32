#include "levelset/metrology/contour.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/levelset/contours.h"

namespace scarp {
namespace {

Contour whole(ContourPoints points, double lateral, double height) {
  const Polyline line{.points = std::move(points)};
  return *find_contour(std::span(&line, 1), lateral, height, {-50, 50});
}

TEST(Contour, IsCutOffAtTheFields) {
  const Polyline line{.points = {{-90, 1}, {-10, 0}, {-8, -20}, {8, -20}, {10, 0}, {90, 1}}};
  const auto contour = find_contour(std::span(&line, 1), 0, -10, {-30, 50});
  ASSERT_TRUE(contour);
  EXPECT_EQ(contour->points().front(), (Contour::Point{-30, 0.25}));
  EXPECT_EQ(contour->points().back(), (Contour::Point{50, 0.5}));
  EXPECT_FALSE(find_contour(std::span(&line, 1), 20, -10, {-30, 50}));
  EXPECT_FALSE(find_contour(std::span(&line, 1), 0, -21, {-30, 50}));
}

TEST(Contour, TakesTheGapThatBelongsToTheMouth) {
  // A pocket beside the shaft, joined to it at the bottom.
  const Contour contour = whole({{-50, 0},
                                 {-6, 0},
                                 {-6, -30},
                                 {-9, -30},
                                 {-9, -10},
                                 {-30, -10},
                                 {-30, -40},
                                 {6, -40},
                                 {6, 0},
                                 {50, 0}},
                                0, -20);
  EXPECT_NEAR(contour.gap(-20)->width(), 12, 1e-12);
  EXPECT_NEAR(contour.gap(-35)->width(), 36, 1e-12);
  EXPECT_FALSE(contour.gap(1));
  EXPECT_EQ(contour.lowest()[1], -40);
  EXPECT_EQ(contour.floor(0), -40);
  EXPECT_EQ(contour.floor(20), 0);
}

TEST(Contour, WhatRisesFromTheFloorIsNoWall) {
  const Contour contour =
      whole(symmetric({{-20, 0}, {-12, -20}, {-12, -60}, {-9, -60}, {-3, -36}}), 0, -30);
  EXPECT_NEAR(contour.gap(-24)->width(), 24, 1e-12);
  for (const double height : {-35.0, -37.0, -50.0, -59.0}) {
    ASSERT_TRUE(contour.gap(height));
    EXPECT_NEAR(contour.gap(height)->left, -12, 1e-12);
    EXPECT_NEAR(contour.gap(height)->right, 12, 1e-12);
  }
  EXPECT_FALSE(contour.gap(-61));
  ASSERT_EQ(contour.left_wall(-55).size(), 2U);
  ASSERT_EQ(contour.right_wall(-55).size(), 2U);
  EXPECT_EQ(contour.left_wall(-55).back(), (Contour::Point{-12, -20}));
  EXPECT_EQ(contour.right_wall(-55).front(), (Contour::Point{12, -20}));
  // What rises above the mouth parts it.
  const Contour parted =
      whole(symmetric({{-20, 0}, {-12, -20}, {-12, -60}, {-9, -60}, {-3, -20}}), -8, -30);
  EXPECT_NEAR(parted.gap(-59)->right, -8.85, 1e-12);
}

TEST(Contour, WallsAreFittedByLeastSquares) {
  const Contour contour = whole(symmetric({{-20, 0}, {-10, -40}}), 0, -20);
  const Walls walls = sample_walls(contour, -8, -32, 1);
  const auto left = fit_wall(walls.heights, walls.left);
  ASSERT_TRUE(left);
  EXPECT_NEAR(left->slope, -0.25, 1e-12);
  EXPECT_NEAR(left->at_zero, -20, 1e-12);
  EXPECT_NEAR(left->deviation, 0, 1e-12);
}

TEST(Contour, ExtremesLieAtTheVertexOfAParabola) {
  ContourPoints left;
  for (int n = 0; n <= 40; ++n) left.push_back({-20 - 0.01 * n * (31 - n), -1.0 * n});
  const Contour contour = whole(symmetric(left), 0, -20);
  const auto found = widest(sample_walls(contour, -4, -40, 1));
  EXPECT_NEAR(found->height, -15.5, 0.01);
  EXPECT_NEAR(found->width, 2 * (20 + 0.01 * 15.5 * 15.5), 0.01);
  // Of what only narrows it lies at the end.
  const Contour cone = whole(symmetric({{-20, 0}, {-10, -40}}), 0, -20);
  EXPECT_NEAR(narrowest(sample_walls(cone, 0, -36, 1))->height, -36, 0.2);
}

TEST(Contour, FacetsEndAtASteeperWall) {
  const ContourPoints chamfer{{-40, 0}, {-20, 0}, {-13, -7}, {-13, -30}};
  EXPECT_NEAR(*facet_width(chamfer, 0, 1), 7, 1e-9);
  const ContourPoints pit{{-40, 0}, {-20, 0}, {0, -28}};
  EXPECT_FALSE(facet_width(pit, 0, 1));
  const ContourPoints square{{-40, 0}, {-20, 0}, {-20, -30}};
  EXPECT_EQ(*facet_width(square, 0, 1), 0);
}

TEST(Contour, ScallopsAreCountedOnEitherWallAndNotOnASmoothOne) {
  ContourPoints wall;
  for (int n = 0; n < 5; ++n) {
    const ContourPoints scallop = arc(0, -5.0 - 10 * n, 7, 180 - 45.58, 180 + 45.58);
    wall.insert(wall.end(), scallop.begin(), scallop.end());
  }
  const double amplitude = 7 - std::sqrt(49.0 - 25);
  const auto left = scallops(wall, -3, -47, 1);
  ASSERT_TRUE(left);
  EXPECT_NEAR(left->pitch, 10, 0.05);
  EXPECT_NEAR(left->amplitude, amplitude, 0.05);
  ContourPoints right;
  for (std::size_t n = wall.size(); n-- > 0;) right.push_back({-wall[n][0], wall[n][1]});
  EXPECT_NEAR(scallops(right, -3, -47, 1)->amplitude, amplitude, 0.05);
  ContourPoints smooth;
  for (int n = 0; n < 50; ++n) smooth.push_back({-8 - 0.1 * (n % 2), -1.0 * n});
  EXPECT_FALSE(scallops(smooth, 0, -50, 1));
}

TEST(Contour, DistanceIsThatToTheNearestLine) {
  const std::vector<Polyline> lines{{.points = {{0, 0}, {10, 0}}}, {.points = {{0, 5}, {10, 5}}}};
  const DistanceToLines distance(lines);
  EXPECT_EQ(distance({4, 2}), 2);
  EXPECT_EQ(distance({4, 3.5}), 1.5);
  EXPECT_EQ(DistanceToLines({lines.data(), 1})({13, 4}), 5);
}

// A line of many points is looked at in stretches, some of which are left out.
TEST(Contour, DistanceToALongLineIsThatToItsNearestSegment) {
  Polyline circle;
  constexpr int count = 1000;
  for (int n = 0; n <= count; ++n) {
    const double angle = 2 * std::numbers::pi * n / count;
    circle.points.push_back({10 * std::cos(angle), 10 * std::sin(angle)});
  }
  const DistanceToLines distance({&circle, 1});
  const double sagitta = 10 * (1 - std::cos(std::numbers::pi / count));
  for (int n = 0; n < 360; ++n) {
    const double angle = n * std::numbers::pi / 180;
    for (const double radius : {0.0, 3.0, 9.9, 10.1, 25.0}) {
      EXPECT_NEAR(distance({radius * std::cos(angle), radius * std::sin(angle)}),
                  std::abs(radius - 10), 1.001 * sagitta);
    }
  }
}

}  // namespace
}  // namespace scarp
