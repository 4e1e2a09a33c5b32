#include <gtest/gtest.h>

#include <numbers>

#include "levelset/start/shapes.h"

namespace scarp {
namespace {

const Frame frame{.spacing = 2, .cells = {20, 10}};  // 40 nm by 20 nm

TEST(ShapesSize, WallsHaveTheirArea) {
  const Repeat two{.count = {2, 1}, .pitch = {15, 0}};
  const Repeat six{.count = {2, 3}, .pitch = {15, 5}};
  EXPECT_EQ(wall_area(frame, WaferShape{}), 0);
  EXPECT_EQ(wall_area(frame, TrenchShape{.width = 4, .cut = {.depth = 7}, .repeat = two}),
            4 * 20 * 7);
  EXPECT_EQ(wall_area(frame, FinShape{.width = 4, .height = 7, .along = 0}), 2 * 40 * 7);
  EXPECT_NEAR(wall_area(frame, HoleShape{.radius = 2, .cut = {.depth = 7}, .repeat = six}),
              6 * 2 * std::numbers::pi * 2 * 7, 1e-9);
}

TEST(ShapesSize, WallsOfMasksCountWithinTheDomain) {
  MaskShape mask{.thickness = 3, .outline = SlotOutline{.width = 4}};
  EXPECT_EQ(wall_area(frame, mask), 3 * 2 * 20);
  mask.outline = RectangleOutline{.size = {4, 6}};
  EXPECT_EQ(wall_area(frame, mask), 3 * 20);
  mask.outline = PolygonOutline{.loops = {{{-10, -8}, {1e6, -8}, {1e6, 1e6}, {-10, 1e6}}}};
  EXPECT_EQ(wall_area(frame, mask), 3 * (30 + 18));
}

}  // namespace
}  // namespace scarp
