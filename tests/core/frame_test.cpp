#include "core/frame.h"

#include <gtest/gtest.h>

namespace scarp {
namespace {

TEST(Frame, FirstAndLastNodeLieOnTheSides) {
  const Frame frame{.spacing = 0.3, .cells = {7, 10}, .boundary = {Boundary::periodic, {}}};
  const Sides sides = frame.sides();
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_EQ(sides.lower[axis], frame.node_position(axis, 0));
    EXPECT_EQ(sides.upper[axis], frame.node_position(axis, frame.cells[axis]));
    EXPECT_DOUBLE_EQ(sides.width(axis), frame.cells[axis] * 0.3);
  }
  EXPECT_EQ(sides.boundary[0], Boundary::periodic);
  EXPECT_DOUBLE_EQ(sides.area(), 2.1 * 3);
}

TEST(Frame, IsAntisymmetricToTheLastBit) {
  for (const int cells : {7, 10, 101}) {
    const Frame frame{.spacing = 0.1, .cells = {cells, cells}};
    for (int i = 0; i <= cells; ++i) {
      EXPECT_EQ(frame.node_position(0, i), -frame.node_position(0, cells - i));
    }
  }
}

TEST(Frame, CountsHeightsFromTheWafer) {
  const Frame frame{.spacing = 0.5, .cells = {4, 4}};
  EXPECT_EQ(frame.node_position(2, 0), 0);
  EXPECT_EQ(frame.node_position(2, -3), -1.5);
}

TEST(Frame, VariesAlongYInSpaceAlone) {
  const Frame space{.spacing = 0.5, .cells = {4, 4}, .boundary = {Boundary::periodic, {}}};
  const Frame slice{.spacing = 0.5, .cells = {4, 1}, .two_dimensional = true};
  const Frame around{
      .spacing = 0.5, .cells = {4, 1}, .two_dimensional = true, .axisymmetric = true};

  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_TRUE(space.varies_along(axis));
    EXPECT_EQ(slice.varies_along(axis), axis != 1);
    EXPECT_EQ(around.varies_along(axis), axis != 1);
  }
  EXPECT_EQ(space.own_nodes(0), 4);
  EXPECT_EQ(space.own_nodes(1), 5);
  EXPECT_EQ(slice.own_nodes(0), 5);
  EXPECT_EQ(slice.own_nodes(1), 1);
  EXPECT_EQ(slice.in_section({1, 2, 3}), (Vec3d{1, 0, 3}));
  EXPECT_EQ(space.in_section({1, 2, 3}), (Vec3d{1, 2, 3}));
  EXPECT_TRUE(space.is_square() && !slice.is_square());
  EXPECT_TRUE(slice.is_slice() && !around.is_slice() && !space.is_slice());
}

TEST(Frame, IsRevolvedIntoOneThatIsAsWideEitherWay) {
  const Frame around{
      .spacing = 0.5, .cells = {4, 1}, .two_dimensional = true, .axisymmetric = true};
  EXPECT_EQ(around.revolved(), (Frame{.spacing = 0.5, .cells = {4, 4}}));
}

}  // namespace
}  // namespace scarp
