#include "levelset/metrology/openings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "levelset/start/shapes.h"
#include "levelset/surface/extract_surface.h"
#include "tests/levelset/contours.h"

namespace scarp {
namespace {

constexpr Frame strip{.spacing = 1, .cells = {60, 1}, .two_dimensional = true};

OpeningMap map_of(const Frame& frame, const LevelSet& solid) {
  const TriMesh surface = extract_surface(solid);
  return {ViewFromAbove(surface), frame};
}

OpeningMap map_below(const ContourPoints& contour, std::array<double, 2> shift = {}) {
  return map_of(strip, solid_below(strip, contour, shift));
}

TEST(OpeningMap, ARidgePartsOpeningsWhereItRisesToMoreThanHalfOfTheShallowerOne) {
  const auto count = [&](double ridge) {
    return map_below({{-20, 0},
                      {-20, -30},
                      {-2, -30},
                      {-2, ridge},
                      {4, ridge},
                      {4, -20},
                      {18, -20},
                      {18, 0}})
        .openings()
        .size();
  };
  EXPECT_EQ(count(-8.5), 2U);
  EXPECT_EQ(count(-11.5), 1U);
}

TEST(OpeningMap, WhatIsShallowIsNone) {
  const auto count = [](double depth) {
    return map_below({{-5, 0}, {-5, -depth}, {6, -depth}, {6, 0}}, {0.4, 0.3}).openings().size();
  };
  EXPECT_EQ(count(1.9), 0U);
  EXPECT_EQ(count(2.1), 1U);
}

TEST(OpeningMap, ADepthOfExactlyTwoSpacingsMakesAnOpening) {
  const Layers layers = build_layers(
      strip, std::vector<Shape>{WaferShape{}, TrenchShape{.width = 8, .cut = {.depth = 2}}});
  EXPECT_EQ(map_of(strip, layers.top()).openings().size(), 1U);
}

// By whole nodes a triangle's middle was up to a quarter of a spacing off.
TEST(OpeningMap, AnOpeningLiesInTheMiddleOfItsAreaWhereverTheNodesAre) {
  const Frame frame{.spacing = 1, .cells = {40, 40}};
  for (const double shift : {0.0, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9}) {
    // From the middle a height of 6 and 3 to the sides.
    const LevelSet solid(
        frame,
        [&](Vec3d r) {
          const double x = r.x - shift;
          const double y = r.y - 0.7 * shift;
          const double side = 0.5 * std::sqrt(3.0);
          const double inside = std::min({3 + y, 3 - side * x - 0.5 * y, 3 + side * x - 0.5 * y});
          return std::max(r.z - 0.3, std::min(inside, r.z + 12));
        },
        -18, 6);
    const OpeningMap map = map_of(frame, solid);
    ASSERT_EQ(map.openings().size(), 1U);
    EXPECT_NEAR(map.openings()[0].centre[0], shift, 0.05) << shift;
    EXPECT_NEAR(map.openings()[0].centre[1], 0.7 * shift, 0.05) << shift;
  }
}

// A trench at x = -12 and a hole at x = 12 whose edge lies between two rows of nodes.
TEST(OpeningMap, BetweenTwoRowsOfNodesAnOpeningOnEitherOfThemCounts) {
  const Frame frame{.spacing = 1, .cells = {60, 40}};
  const LevelSet solid(
      frame,
      [](Vec3d r) {
        const double trench = 4 - std::abs(r.x + 12);
        const double hole = 6.3 - std::hypot(r.x - 12, r.y);
        return std::max(r.z - 0.3, std::min(std::max(trench, hole), r.z + 12));
      },
      -18, 6);
  const OpeningMap map = map_of(frame, solid);
  ASSERT_EQ(map.openings().size(), 2U);
  ASSERT_TRUE(map.openings()[0].through[1]);
  // Nodes of the hole end at y = 6: between 6 and 7 the field still ends half-way to it.
  EXPECT_NEAR(map.row(0, 0, 6.5)->right_field, map.row(0, 0, 6)->right_field, 1e-9);
  EXPECT_NEAR(map.row(0, 0, -6.5)->right_field, map.row(0, 0, -6)->right_field, 1e-9);
  EXPECT_GT(map.row(0, 0, 7.5)->right_field, 8);
}

TEST(OpeningMap, FieldsEndHalfWayToATrenchThatAFilmHasPlugged) {
  const ContourPoints wide{{-20, 0}, {-20, -20}, {-6, -20}, {-6, 0}};
  ContourPoints both = wide;
  both.insert(both.end(), {{14, 0}, {14, -20}, {18, -20}, {18, 0}});
  const TriMesh film = extract_surface(solid_below(strip, wide, {0, 3}));
  const TriMesh wafer = extract_surface(solid_below(strip, both));
  const ViewFromAbove above(film);
  const ViewFromAbove below(wafer);
  const std::array<const ViewFromAbove*, 1> lower{&below};
  EXPECT_NEAR(OpeningMap(above, strip, lower).row(0, 0, 0)->right_field, 4, 0.6);
  EXPECT_GT(OpeningMap(above, strip).row(0, 0, 0)->right_field, 15);
}

TEST(OpeningMap, FieldsLieHalfWayToTheNextOpening) {
  const OpeningMap map =
      map_below({{-20, 0}, {-20, -10}, {-12, -10}, {-12, 0}, {4, 0}, {4, -25}, {14, -25}, {14, 0}});
  ASSERT_EQ(map.openings().size(), 2U);
  const OpeningRow left = *map.row(0, 0, 0);
  EXPECT_NEAR(left.centre, -16, 0.5);
  EXPECT_NEAR(left.left_field, -30, 0.5);  // to its mirror image
  EXPECT_NEAR(left.right_field, -4, 0.5);
  const OpeningRow right = *map.row(1, 0, 0);
  EXPECT_NEAR(right.left_field, -4, 0.5);
  EXPECT_NEAR(right.right_field, 30, 0.5);
  EXPECT_EQ(map.openings()[0].through, (std::array<bool, 2>{false, true}));
}

// A slot along the diagonal in which nodes touch at corners alone, as in an acute corner.
TEST(OpeningMap, NodesThatTouchAtCornersAreOneOpening) {
  const Frame frame{.spacing = 1, .cells = {30, 30}};
  const LevelSet slot(
      frame,
      [](Vec3d r) {
        const double inside =
            std::min(0.6 - std::abs(r.x - r.y) / std::sqrt(2.0), 8 - std::hypot(r.x, r.y));
        return std::max(r.z - 0.3, std::min(inside, r.z + 12));
      },
      -18, 6);
  EXPECT_EQ(map_of(frame, slot).openings().size(), 1U);
}

TEST(OpeningMap, AHoleOverPeriodicSidesIsOne) {
  Frame frame{.spacing = 1, .cells = {30, 24}};
  frame.boundary = {Boundary::periodic, Boundary::periodic};
  const auto hole = [&](double x, double y) {
    return LevelSet(
        frame,
        [=](Vec3d r) {
          const double dx = std::remainder(r.x - x, 30);
          const double dy = std::remainder(r.y - y, 24);
          return std::max(r.z - 0.3, std::min(6 - std::hypot(dx, dy), r.z + 12));
        },
        -18, 6);
  };
  for (const auto& [x, y] : {std::pair{14.0, -11.0}, {0.0, 0.0}, {-15.0, 12.0}}) {
    const OpeningMap map = map_of(frame, hole(x, y));
    ASSERT_EQ(map.openings().size(), 1U);
    EXPECT_EQ(map.openings()[0].through, (std::array<bool, 2>{false, false}));
    EXPECT_NEAR(std::remainder(map.openings()[0].centre[0] - x, 30), 0, 0.3);
    EXPECT_NEAR(std::remainder(map.openings()[0].centre[1] - y, 24), 0, 0.3);
    EXPECT_TRUE(map.row(0, 0, map.openings()[0].centre[1]));
    EXPECT_FALSE(map.row(0, 0, map.openings()[0].centre[1] + 9));
  }
}

}  // namespace
}  // namespace scarp
