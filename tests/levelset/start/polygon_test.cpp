#include "levelset/start/polygon.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace scarp {
namespace {

using testing::HasSubstr;

// Wide enough that no images come near, except across x where that is narrow.
const Frame frame{.spacing = 1, .cells = {160, 160}};
const Frame narrow{.spacing = 1, .cells = {40, 160}};
const Frame periodic{
    .spacing = 1, .cells = {40, 160}, .boundary = {Boundary::periodic, Boundary::periodic}};

Loop square(double x, double y, double half) {
  return {{x - half, y - half}, {x + half, y - half}, {x + half, y + half}, {x - half, y + half}};
}

using Rule = PolygonOutline::Rule;

double area_of(const PolygonOutline& outline, const Frame& in = frame) {
  return area(domain_loops(in, outline));
}

TEST(Polygon, AreasFollowTheRule) {
  const std::vector<Loop> nested{square(0, 0, 10), square(1, 0, 5)};
  EXPECT_DOUBLE_EQ(area_of({nested}), 400 - 100);
  EXPECT_DOUBLE_EQ(area_of({nested, Rule::any}), 400);
  const std::vector<Loop> overlapping{square(0, 0, 5), square(6, 3, 5)};
  EXPECT_NEAR(area_of({overlapping, Rule::any}), 200 - 4 * 7, 1e-12);
}

TEST(Polygon, TheDirectionOfALoopDoesNotMatter) {
  Loop backwards = square(2, 3, 4);
  std::reverse(backwards.begin(), backwards.end());
  EXPECT_DOUBLE_EQ(area_of({{backwards}}), 64);
  EXPECT_DOUBLE_EQ(area_of({{backwards, square(6, 3, 4)}, Rule::any}), 64 + 32);
}

TEST(Polygon, AbuttingPolygonsBecomeOne) {
  const std::vector<Loop> all =
      domain_loops(frame, {{square(-4, 0, 4), square(4, 0, 4)}, Rule::any});
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].size(), 4U);
  EXPECT_DOUBLE_EQ(area(all), 128);
}

TEST(Polygon, AKeyholeBecomesAHole) {
  // A square with a square hole, joined to it by a cut that is passed twice.
  const Loop keyhole{{-8, -8}, {0, -8}, {0, -4}, {-4, -4}, {-4, 4}, {4, 4},
                     {4, -4},  {0, -4}, {0, -8}, {8, -8},  {8, 8},  {-8, 8}};
  const std::vector<Loop> loops = domain_loops(frame, {{keyhole}, Rule::any});
  EXPECT_EQ(loops.size(), 2U);
  EXPECT_DOUBLE_EQ(area(loops), 256 - 64);
  EXPECT_THAT(polygon_fault(std::vector<Loop>{keyhole}).value_or("none"), HasSubstr("edge"));
}

TEST(Polygon, CornersThatTouchStayTwoLoops) {
  const std::vector<Loop> loops =
      domain_loops(frame, {{square(-3, -3, 3), square(3, 3, 3)}, Rule::any});
  EXPECT_EQ(loops.size(), 2U);
  EXPECT_DOUBLE_EQ(area(loops), 72);
}

TEST(Polygon, SidesMirrorOrRepeatWhatTheyCut) {
  // The domain ends at x = 20: half of the square is left, and its image joins it.
  EXPECT_DOUBLE_EQ(area_of({{square(20, 0, 5)}}, narrow), 100);
  // Beyond the reach of images nothing is kept: at 24 spacings from the sides.
  EXPECT_DOUBLE_EQ(area_of({{square(0, 0, 500)}}), 208 * 208);
  // What lies beyond a side comes back on the other one; both have copies outside.
  EXPECT_DOUBLE_EQ(area_of({{square(20, 0, 5)}}, periodic), 2 * 100);
  EXPECT_EQ(domain_loops(periodic, {{square(20, 0, 5), square(-20, 0, 5)}, Rule::any}).size(), 2U);
}

TEST(Polygon, ANarrowDomainHasImagesOfImages) {
  const Frame two_cells{.spacing = 1, .cells = {160, 2}};
  // A strip across all of it goes on to the reach of images, 24 spacings either way.
  EXPECT_DOUBLE_EQ(area_of({{square(0, 0, 10)}}, two_cells), 20 * 50);
}

TEST(Polygon, OfALayoutWhatLiesBesideTheDomainStaysOutside) {
  // One that touches the side, one over it, and one that is drawn by hand.
  EXPECT_TRUE(domain_loops(periodic, {{square(25, 0, 5)}, Rule::any}).empty());
  EXPECT_DOUBLE_EQ(area_of({{square(24, 0, 5)}, Rule::any}, periodic), 2 * 100);
  EXPECT_DOUBLE_EQ(area_of({{square(40, 0, 3)}}, periodic), 3 * 36);
}

TEST(Polygon, OutsideTheDomainNothingIsLeft) {
  EXPECT_TRUE(domain_loops(frame, {{square(90, 0, 5)}}).empty());
}

TEST(Polygon, RandomUnionsHaveTheAreaThatIsCounted) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-14, 14);
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<Loop> triangles(12);
    for (Loop& triangle : triangles) {
      triangle = {{place(random), place(random)},
                  {place(random), place(random)},
                  {place(random), place(random)}};
    }
    const auto surrounds = [](const Loop& loop, double x, double y) {
      bool odd = false;
      for (std::size_t p = 0; p < 3; ++p) {
        const Point2& a = loop[p];
        const Point2& b = loop[(p + 1) % 3];
        if ((a[1] > y) == (b[1] > y)) continue;
        odd = odd != (x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
      }
      return odd;
    };
    int any = 0;
    int odd = 0;
    constexpr int n = 280;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        const double x = -14 + 28 * (i + 0.5) / n;
        const double y = -14 + 28 * (j + 0.5) / n;
        int count = 0;
        for (const Loop& triangle : triangles) count += surrounds(triangle, x, y) ? 1 : 0;
        any += count > 0 ? 1 : 0;
        odd += count % 2;
      }
    }
    const double cell = 28.0 * 28.0 / (n * n);
    EXPECT_NEAR(area_of({triangles, Rule::any}), any * cell, 1.0) << trial;
    EXPECT_NEAR(area_of({triangles, Rule::even_odd}), odd * cell, 1.5) << trial;
  }
}

/// Two combs of steep teeth, one from below and one from above; each tooth has the area of a
/// triangle.
TEST(Polygon, ManyLongEdgesHaveTheirArea) {
  constexpr int teeth = 2000;
  const auto comb = [](double foot, double tip) {
    Loop loop;
    for (int n = 0; n < teeth; ++n) {
      loop.push_back({-8 + 16.0 * n / teeth, foot});
      loop.push_back({-8 + 16.0 * (n + 0.5) / teeth, tip});
    }
    loop.push_back({8, foot});
    return loop;
  };
  EXPECT_NEAR(area_of({{comb(-7, 5)}, Rule::any}), 0.5 * 16 * 12, 1e-2);
  EXPECT_NEAR(area_of({{comb(-7, 5), comb(7, 6)}, Rule::any}), 0.5 * 16 * 13, 1e-2);
}

std::string fault_of(const std::vector<Loop>& loops) {
  return polygon_fault(loops).value_or("none");
}

TEST(Polygon, FaultsNameTheEdges) {
  EXPECT_EQ(fault_of({square(0, 0, 5)}), "none");
  EXPECT_EQ(fault_of({{{0, 0}, {4, 4}, {4, 0}, {0, 4}}}),
            "edge 0 and edge 2 cross or touch; write holes and islands as polygons of their own");
  EXPECT_THAT(fault_of({square(0, 0, 5), square(4, 4, 5)}),
              HasSubstr("polygon 0 edge 1 and polygon 1 edge 0 cross or touch"));
  EXPECT_THAT(fault_of({square(0, 0, 5), square(10, 0, 5)}), HasSubstr("cross or touch"));
  EXPECT_THAT(fault_of({{{0, 0}, {5, 0}, {2, 0}, {2, 4}}}),
              HasSubstr("edge 0 and edge 1 lie on each other"));
  EXPECT_THAT(fault_of({{{0, 0}, {5, 0}, {5, 0}, {2, 4}}}),
              HasSubstr("points 1 and 2 are the same"));
  EXPECT_THAT(fault_of({{{0, 0}, {5, 0}}}), HasSubstr("has 2 points"));
  EXPECT_THAT(fault_of({{{0, 0}, {5, 0}, {2, NAN}}}), HasSubstr("point 2 is not finite"));
  EXPECT_THAT(fault_of({}), HasSubstr("no polygon"));
}

TEST(Polygon, NeighboursInARowAreNoFault) {
  EXPECT_EQ(fault_of({{{0, 0}, {2, 0}, {5, 0}, {2, 4}}}), "none");
}

TEST(Polygon, WallsCloserThanTwoSpacingsAreFound) {
  const std::vector<Loop> close =
      domain_loops(frame, {{square(-5, 0, 4.5), square(5.5, 0, 4.5)}, Rule::any});
  EXPECT_THAT(thin_feature(frame, close, 2).value_or("none"), HasSubstr(" nm are 1.5 nm apart; "));
  EXPECT_FALSE(thin_feature(frame, close, 1.4).has_value());
}

TEST(Polygon, WallsThatTouchAreNamedWhereTheyDo) {
  const Loop bow_tie{{-6, -6}, {6, 6}, {6, -6}, {-6, 6}};
  EXPECT_EQ(thin_feature(frame, domain_loops(frame, {{bow_tie}, Rule::any}), 2).value_or("none"),
            "walls at (0, 0) nm touch or cross; let shapes overlap, or keep walls 2 nm apart");
}

}  // namespace
}  // namespace scarp
