#include "levelset/openings.h"

#include <gtest/gtest.h>

#include <cmath>

#include "contours.h"
#include "levelset/extract_surface.h"

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
