#include "levelset/metrology/opening_names.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "levelset/surface/extract_surface.h"

namespace scarp {
namespace {

/// Units: spacings.
struct Hole {
  double x = 0;
  double y = 0;
  double radius = 4;
};

constexpr double hole_period = 40;

Frame hole_frame(Boundary boundary) {
  return {.spacing = 1, .cells = {40, 40}, .boundary = {boundary, boundary}};
}

/// Holes 12 deep; over periodic sides the whole of them.
OpeningMap map_of_holes(const std::vector<Hole>& holes, Boundary boundary = Boundary::reflective) {
  const auto gap = [&](double a, double b) {
    return boundary == Boundary::periodic ? std::remainder(a - b, hole_period) : a - b;
  };
  const Frame frame = hole_frame(boundary);
  const LevelSet solid(
      frame,
      [&](Vec3d r) {
        double inside = -100;
        for (const Hole& hole : holes)
          inside = std::max(inside, hole.radius - std::hypot(gap(r.x, hole.x), gap(r.y, hole.y)));
        return std::max(r.z - 0.3, std::min(inside, r.z + 12));
      },
      -18, 6);
  const TriMesh surface = extract_surface(solid);
  return {ViewFromAbove(surface), frame};
}

using Numbers = std::vector<std::size_t>;

constexpr Hole left_hole{-9, 0};
constexpr Hole right_hole{9, 0};

TEST(OpeningMap, ColumnsGoByPlacesThatDifferByASpacing) {
  const OpeningMap map = map_of_holes({{-10.3, 10}, {-9.7, -10}, {10.3, -10}, {9.7, 10}});
  ASSERT_EQ(map.openings().size(), 4U);
  for (const std::size_t n : {0U, 2U}) {
    EXPECT_LT(map.openings()[n].centre[1], 0);
    EXPECT_GT(map.openings()[n + 1].centre[1], 0);
  }
}

TEST(OpeningMap, WidthsAreThoseOfTheBoxAroundWholeOpenings) {
  const OpeningMap map = map_of_holes({{0, 0, 5}, {-20, 0, 5}});
  for (const Opening& each : map.openings())
    for (const double width : each.width) EXPECT_NEAR(width, 10, 1.5);
}

TEST(OpeningNames, StayWhereCentresMove) {
  OpeningNames names;
  EXPECT_EQ(names.add(map_of_holes({{-10, -10}, {-10, 10}, {10, -10}, {10, 10}})),
            (Numbers{0, 1, 2, 3}));
  // By place the second and the fourth one would now come before the others.
  EXPECT_EQ(names.add(map_of_holes({{-9, -10}, {-11, 10}, {11, -10}, {9, 10}})),
            (Numbers{1, 0, 3, 2}));
}

TEST(OpeningNames, OnPeriodicSidesStayWithTheirPlace) {
  OpeningNames names;
  for (const double x : {20.0, 20.4, 19.6, 21.2, 18.8, -19.0, 20.0}) {
    EXPECT_EQ(names.add(map_of_holes({{0, 0}, {x, 0}}, Boundary::periodic)).size(), 2U);
    ASSERT_EQ(names.known().size(), 2U) << x;
    EXPECT_NEAR(names.known()[0].place[0], -20, 1.5) << x;
    EXPECT_NEAR(names.known()[1].place[0], 0, 0.1) << x;
  }
}

TEST(OpeningMap, OneOnAPeriodicSideLiesAtTheLowerOne) {
  for (const double x : {-20.0, -19.8, 19.8, 20.0, 20.2}) {
    const OpeningMap map = map_of_holes({{x, x}}, Boundary::periodic);
    for (const double centre : map.openings().at(0).centre) EXPECT_NEAR(centre, -20, 0.5) << x;
  }
}

TEST(OpeningNames, WhatOpensLaterGetsANewOneAndWhatComesBackItsOwn) {
  OpeningNames names;
  EXPECT_EQ(names.add(map_of_holes({right_hole})), (Numbers{0}));
  EXPECT_EQ(names.add(map_of_holes({left_hole, right_hole})), (Numbers{1, 0}));
  EXPECT_EQ(names.add(map_of_holes({right_hole})), (Numbers{0}));
  EXPECT_EQ(names.add(map_of_holes({})), (Numbers{}));
  EXPECT_EQ(names.add(map_of_holes({left_hole})), (Numbers{1}));
  EXPECT_EQ(names.add(map_of_holes({left_hole, right_hole, {0, 14}})), (Numbers{1, 2, 0}));
}

TEST(OpeningNames, WhatMergesGetsANewOneAndItsPartsTheirOwnAgain) {
  OpeningNames names;
  const OpeningMap apart = map_of_holes({left_hole, right_hole});
  const OpeningMap merged = map_of_holes({{-9, 0, 10}, {9, 0, 10}});
  ASSERT_EQ(merged.openings().size(), 1U);
  EXPECT_EQ(names.add(apart), (Numbers{0, 1}));
  for (int again = 0; again < 2; ++again) {
    EXPECT_EQ(names.add(merged), (Numbers{2}));
    EXPECT_EQ(names.add(apart), (Numbers{0, 1}));
  }
}

// Though one that has been gone for a while was at the same place.
TEST(OpeningNames, WhatMergesIsNoneThatComesBack) {
  OpeningNames names;
  EXPECT_EQ(names.add(map_of_holes({{0, 0, 4}})), (Numbers{0}));
  EXPECT_EQ(names.add(map_of_holes({})), (Numbers{}));
  EXPECT_EQ(names.add(map_of_holes({{-13, 0}, {13, 0}})), (Numbers{1, 2}));
  EXPECT_EQ(names.add(map_of_holes({{-9, 0, 10}, {9, 0, 10}})), (Numbers{3}));
}

TEST(OpeningNames, WhatFallsApartGetsNewOnesAndMergedTheOldOne) {
  OpeningNames names;
  const OpeningMap merged = map_of_holes({{-9, 0, 10}, {9, 0, 10}});
  EXPECT_EQ(names.add(merged), (Numbers{0}));
  for (int again = 0; again < 2; ++again) {
    EXPECT_EQ(names.add(map_of_holes({left_hole, right_hole})), (Numbers{1, 2}));
    EXPECT_EQ(names.add(merged), (Numbers{0}));
  }
  // In another way.
  EXPECT_EQ(names.add(map_of_holes({{-12, 0}, {0, 0}, {12, 0}})), (Numbers{3, 4, 5}));
}

TEST(OpeningNames, WhatIsSmallBesideAnOpeningDoesNotTakeItsNumber) {
  OpeningNames names;
  const OpeningMap both = map_of_holes({{-13, 0, 1.5}, {0, 0, 9}});
  const OpeningMap merged = map_of_holes({{-13, 0, 2}, {0, 0, 12}});
  ASSERT_EQ(both.openings().size(), 2U);
  EXPECT_EQ(names.add(map_of_holes({{0, 0, 9}})), (Numbers{0}));
  EXPECT_EQ(names.add(both), (Numbers{1, 0}));
  ASSERT_EQ(merged.openings().size(), 1U);
  EXPECT_EQ(names.add(merged), (Numbers{0}));
  EXPECT_EQ(names.add(both), (Numbers{1, 0}));
}

TEST(OpeningNames, GoWithWhatMovesBesideItself) {
  OpeningNames names;
  EXPECT_EQ(names.add(map_of_holes({{-9, 0, 2}, right_hole})), (Numbers{0, 1}));
  EXPECT_EQ(names.add(map_of_holes({{-4, 0, 2}, right_hole})), (Numbers{0, 1}));
  EXPECT_EQ(names.add(map_of_holes({{-4, 12, 2}, right_hole})), (Numbers{2, 1}));
}

TEST(OpeningNames, GoThroughNumbers) {
  OpeningNames names;
  names.add(map_of_holes({left_hole, right_hole}));
  names.add(map_of_holes({{-9, 0, 10}, {9, 0, 10}}));
  const std::vector<double> numbers = numbers_of(names);
  std::optional<OpeningNames> read = opening_names_of(numbers);
  ASSERT_TRUE(read);
  EXPECT_EQ(numbers_of(*read), numbers);
  const OpeningMap next = map_of_holes({left_hole, right_hole, {0, 14}});
  EXPECT_EQ(read->add(next), names.add(next));
}

TEST(OpeningNames, NumbersThatAreNotWholeAreNone) {
  OpeningNames names;
  names.add(map_of_holes({left_hole, right_hole}));
  names.add(map_of_holes({{-9, 0, 10}, {9, 0, 10}}));
  std::vector<double> numbers = numbers_of(names);
  EXPECT_FALSE(opening_names_of(std::span(numbers).first(numbers.size() - 1)));
  numbers[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(opening_names_of(numbers));
  // A part that is none of them, and a list that is longer than any file.
  EXPECT_FALSE(opening_names_of(std::vector<double>{0, 0, 1, 1, 1, 0}));
  EXPECT_TRUE(opening_names_of(std::vector<double>{0, 0, 1, 1, 0, 0}));
  EXPECT_FALSE(opening_names_of(std::vector<double>{0, 0, 1, 0, 4e9}));
  EXPECT_FALSE(opening_names_of(std::vector<double>{0, 0, 1, -1, 0}));
}

}  // namespace
}  // namespace scarp
