#include "levelset/start/line_cut.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "levelset/metrology/cross_section.h"
#include "levelset/operations/layer_steps.h"

namespace scarp {
namespace {

/// 200 nm along x.
const Frame flat_section{.spacing = 1, .cells = {200, 1}, .two_dimensional = true};

Frame flat_periodic_section() {
  Frame frame = flat_section;
  frame.boundary[0] = Boundary::periodic;
  return frame;
}

LineCut slanted_line(double angle, Point2 middle = {0, 0}) {
  return {.middle = middle, .along = {std::cos(angle), std::sin(angle)}};
}

using Strips = std::vector<std::array<double, 2>>;

/// Left and right ends, from the left.
Strips strips(const Outline& outline, const LineCut& line, const Frame& frame = flat_section) {
  Strips found;
  for (const Loop& loop : cut_outline(frame, outline, line).loops)
    found.push_back({loop[0][0], loop[2][0]});
  return found;
}

void expect_strips(const Strips& found, const Strips& wanted) {
  ASSERT_EQ(found.size(), wanted.size());
  for (std::size_t n = 0; n < wanted.size(); ++n) {
    EXPECT_NEAR(found[n][0], wanted[n][0], 1e-4);
    EXPECT_NEAR(found[n][1], wanted[n][1], 1e-4);
  }
}

TEST(LineCut, MeetsCirclesInTheirChords) {
  const CircleOutline circle{.radius = 50, .centre = {20, 30}};
  expect_strips(strips(circle, {}), {{20 - 40, 20 + 40}});
  expect_strips(strips(circle, {.middle = {0, 90}, .along = {1, 0}}), {});
  // Through the centre, whichever way.
  expect_strips(strips(circle, slanted_line(0.7, {20, 30})), {{-50, 50}});
}

TEST(LineCut, MeetsSlotsAtAnAngle) {
  const SlotOutline slot{.width = 30, .centre = 5, .along = 1, .repeat = {{3, 1}, {60, 0}}};
  expect_strips(strips(slot, {}), {{-70, -40}, {-10, 20}, {50, 80}});
  const double stretch = 1 / std::cos(0.6);
  const SlotOutline one{.width = 30, .along = 1};
  expect_strips(strips(one, slanted_line(0.6)), {{-15 * stretch, 15 * stretch}});
  // Along it, all or nothing.
  expect_strips(strips(one, {.along = {0, 1}}), {{-100, 100}});
  expect_strips(strips(one, {.middle = {20, 0}, .along = {0, 1}}), {});
}

TEST(LineCut, MeetsRectanglesWithTheirCorners) {
  const RectangleOutline box{.size = {80, 60}, .corner_radius = 20};
  expect_strips(strips(box, {}), {{-40, 40}});
  // At y = 25 the corners are cut off: centres at (20, 10), 15 away.
  const double chord = 20 + std::sqrt(400 - 225);
  expect_strips(strips(box, {.middle = {0, 25}}), {{-chord, chord}});
  const double diagonal = std::hypot(20, 10);
  const double angle = std::atan2(10, 20);
  expect_strips(strips(box, slanted_line(angle)), {{-diagonal - 20, diagonal + 20}});
}

TEST(LineCut, MeetsPolygonsWithHolesAndSizing) {
  PolygonOutline ring{{box_loop({-60, -60}, {60, 60}), box_loop({-20, -20}, {20, 20})}};
  expect_strips(strips(ring, {}), {{-60, -20}, {20, 60}});
  const double root = std::numbers::sqrt2;
  expect_strips(strips(ring, slanted_line(std::numbers::pi / 4)),
                {{-60 * root, -20 * root}, {20 * root, 60 * root}});
  ring.sizing.grow = 5;
  expect_strips(strips(ring, {.middle = {0, 17}}), {{-65, 65}});
  expect_strips(strips(ring, {.middle = {0, 10}}), {{-65, -15}, {15, 65}});
}

TEST(LineCut, RoundCornersAreMetWhereTheyAre) {
  const PolygonOutline square{
      {box_loop({-60, -60}, {60, 60})}, PolygonOutline::Rule::even_odd, {.corner_radius = 30}};
  const double chord = 30 + std::sqrt(900 - 400);
  const Strips found = strips(square, {.middle = {0, 50}});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0][1], chord, 0.02);
  EXPECT_NEAR(found[0][0], -chord, 0.02);
}

TEST(LineCut, EndsCutOrRepeatWhatReachesBeyond) {
  const CircleOutline circle{.radius = 30, .centre = {90, 0}};
  expect_strips(strips(circle, {}), {{60, 100}});
  expect_strips(strips(circle, {}, flat_periodic_section()), {{-100, -80}, {60, 100}});
  const PolygonOutline box{{box_loop({60, -5}, {120, 5})}};
  expect_strips(strips(box, {}), {{60, 100}});
  expect_strips(strips(box, {}, flat_periodic_section()), {{-100, -80}, {60, 100}});
}

TEST(LineCut, HolesBecomeTrenches) {
  HoleShape hole{.radius = 30, .repeat = {{2, 2}, {80, 60}}};
  hole.cut.depth = 40;
  // One row of them is met off its axis.
  const auto shapes = cut_shape(flat_section, hole, {.middle = {0, 12}});
  ASSERT_EQ(shapes.size(), 2U);
  const auto& left = std::get<TrenchShape>(shapes[0]);
  EXPECT_NEAR(left.centre, -40, 1e-9);
  EXPECT_NEAR(left.width, 48, 1e-9);
  EXPECT_EQ(left.cut.depth, 40);
}

TEST(LineCut, TrenchesAreWiderAndLessSteepAtAnAngle) {
  TrenchShape trench{.width = 30};
  trench.cut = {.depth = 20, .taper = 0.1};
  const auto shapes = cut_shape(flat_section, trench, slanted_line(1));
  const auto& met = std::get<TrenchShape>(shapes.at(0));
  EXPECT_NEAR(met.width, 30 / std::cos(1.0), 1e-9);
  EXPECT_NEAR(std::tan(met.cut.taper), std::tan(0.1) / std::cos(1.0), 1e-9);
}

double volume_of_shapes(const std::vector<Shape>& shapes, std::size_t layer) {
  std::vector<Shape> all{WaferShape{.material = 0}};
  all.insert(all.end(), shapes.begin(), shapes.end());
  return material_volumes(build_layers(flat_section, all)).at(layer);
}

TEST(LineCut, ATrenchWhoseMiddleLiesBeyondAnEndIsHalfThere) {
  HoleShape hole{.radius = 50, .centre = {120, 0}};
  hole.cut.depth = 40;
  EXPECT_NEAR(volume_of_shapes(cut_shape(flat_section, hole, {}), 0), -30 * 40, 5);
}

TEST(LineCut, AlongATrenchAllIsCut) {
  TrenchShape trench{.width = 30, .along = 0};
  trench.cut.depth = 40;
  EXPECT_NEAR(volume_of_shapes(cut_shape(flat_section, trench, {}), 0), -200 * 40, 1);
  EXPECT_TRUE(cut_shape(flat_section, trench, {.middle = {0, 16}}).empty());
}

TEST(LineCut, RidgesAndMasksBecomeFilmsOfTheirWidths) {
  const FinShape fin{.material = 1, .width = 30, .height = 20, .centre = 0, .along = 1};
  EXPECT_NEAR(volume_of_shapes(cut_shape(flat_section, fin, slanted_line(0.8)), 1),
              20 * 30 / std::cos(0.8), 1);
  MaskShape mask{.material = 1,
                 .thickness = 20,
                 .outlines = MaskShape::Outlines::opening,
                 .outline = CircleOutline{.radius = 50, .centre = {20, 30}}};
  EXPECT_NEAR(volume_of_shapes(cut_shape(flat_section, mask, {}), 1), 20 * (200 - 80), 1);
  // Missed, an opening leaves all of the mask, and resist nothing.
  EXPECT_NEAR(volume_of_shapes(cut_shape(flat_section, mask, {.middle = {0, 90}}), 1), 20 * 200, 1);
  mask.outlines = MaskShape::Outlines::resist;
  EXPECT_TRUE(cut_shape(flat_section, mask, {.middle = {0, 90}}).empty());
}

TEST(LineCut, WallsOfStripsAreAsFarAsTheyLook) {
  const MaskShape mask{.material = 1,
                       .thickness = 20,
                       .outlines = MaskShape::Outlines::resist,
                       .outline = CircleOutline{.radius = 50, .centre = {20, 30}}};
  std::vector<Shape> shapes = cut_shape(flat_section, mask, {});
  shapes.insert(shapes.begin(), WaferShape{.material = 0});
  const Layers layers = build_layers(flat_section, shapes);
  for (const double x : {-22.5, -20.0, -17.5, 57.5, 60.0, 62.5})
    EXPECT_NEAR(layers.top().distance({x, 0, 10}), std::abs(x - 20) - 40, 0.01) << x;
}

/// Whether the line is in a random layout, at many points against what was cut.
TEST(LineCut, StripsAreWhatAPointwiseLookFinds) {
  for (int seed = 0; seed < 40; ++seed) {
    std::uint64_t state = 977 + 131 * static_cast<std::uint64_t>(seed);
    const auto between = [&](double lower, double upper) {
      state = state * 6364136223846793005U + 1442695040888963407U;
      return lower + (upper - lower) * static_cast<double>(state >> 40) / 16777216.0;
    };
    std::vector<Loop> boxes;
    for (int n = 0; n < 6; ++n) {
      const Point2 lower{between(-90, 60), between(-90, 60)};
      boxes.push_back(box_loop(lower, {lower[0] + between(5, 40), lower[1] + between(5, 40)}));
    }
    const LineCut line = slanted_line(between(0, 6.28), {between(-20, 20), between(-20, 20)});
    const Strips found = strips(PolygonOutline{boxes, PolygonOutline::Rule::any}, line);
    for (double x = -99.7; x < 100; x += 0.37) {
      const auto [px, py] = line.at(x);
      const bool inside = std::ranges::any_of(boxes, [&, px = px, py = py](const Loop& box) {
        return box[0][0] < px && px < box[2][0] && box[0][1] < py && py < box[2][1];
      });
      const bool is_found = std::ranges::any_of(
          found, [&](const auto& strip) { return strip[0] < x && x < strip[1]; });
      const bool is_near_end = std::ranges::any_of(found, [&](const auto& strip) {
        return std::min(std::abs(strip[0] - x), std::abs(strip[1] - x)) < 0.01;
      });
      if (is_near_end) continue;
      EXPECT_EQ(inside, is_found) << "seed " << seed << " at " << x;
    }
  }
}

}  // namespace
}  // namespace scarp
