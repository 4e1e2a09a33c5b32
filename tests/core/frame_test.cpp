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

}  // namespace
}  // namespace scarp
