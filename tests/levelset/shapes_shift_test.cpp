// Start geometries at positions between nodes: walls, mouth and depth do not depend on where the
// nodes are.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "levelset/cross_section.h"
#include "levelset/extract_surface.h"
#include "levelset/shapes.h"

namespace scarp {
namespace {

struct Opening {
  double left = 0;
  double right = 0;
  double depth = 0;
  double width() const { return right - left; }
};

/// Where the wall stands on average: what lies between the wall and x = 0, over the height.
Opening measure(const Layers& layers, double y, double lower, double upper) {
  const std::vector<Polyline> lines = cross_section(extract_surface(layers), 1, y);
  Opening opening;
  for (const Polyline& line : lines) {
    for (std::size_t p = 1; p < line.points.size(); ++p) {
      auto [x0, z0] = line.points[p - 1];
      auto [x1, z1] = line.points[p];
      opening.depth = std::max({opening.depth, -z0, -z1});
      const double from = std::clamp(z0, lower, upper);
      const double to = std::clamp(z1, lower, upper);
      if (from == to) continue;
      const double middle = x0 + (0.5 * (from + to) - z0) / (z1 - z0) * (x1 - x0);
      const double share = std::abs(to - from) / (upper - lower);
      (middle < 0 ? opening.left : opening.right) += share * middle;
    }
  }
  return opening;
}

/// Mean wall position in the middle part, the mouth and the depth, at 16 positions of the centre
/// and of the floor.
template <class MakeShape>
void expect_no_spread(const MakeShape& shape, double wall, double mouth, double depth) {
  const Frame frame{.spacing = 1, .cells = {48, 24}};
  double spread = 0;
  for (int n = 0; n < 16; ++n) {
    const double shift = n / 16.0;
    const Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{}, shape(shift)});
    const Opening middle = measure(layers, 0.25, -0.7 * depth, -0.3 * depth);
    const Opening top = measure(layers, 0.25, -1, 0);
    for (const double error :
         {middle.left - (shift - wall), middle.right - (shift + wall), top.width() - mouth,
          measure(layers, 0.25, -1, 0).depth - (depth + shift)}) {
      EXPECT_LT(std::abs(error), 0.05) << "offset " << shift;
      spread = std::max(spread, std::abs(error));
    }
  }
  testing::Test::RecordProperty("largest_error_cells", std::to_string(spread));
}

TEST(ShiftedShapes, ATrenchIsTheSameAtEveryOffset) {
  expect_no_spread(
      [](double shift) {
        TrenchShape trench{.width = 15.3, .centre = shift};
        trench.cut.depth = 18 + shift;
        return Shape(trench);
      },
      7.65, 15.3, 18);
}

TEST(ShiftedShapes, ATaperedTrenchIsTheSameAtEveryOffset) {
  for (const double taper : {0.07, -0.07}) {
    expect_no_spread(
        [&](double shift) {
          TrenchShape trench{.width = 15.3, .centre = shift};
          trench.cut.depth = 18 + shift;
          trench.cut.taper = taper;
          return Shape(trench);
        },
        7.65 - 9 * std::tan(taper), 15.3 - std::tan(taper), 18);
  }
}

TEST(ShiftedShapes, AHoleIsTheSameAtEveryOffset) {
  expect_no_spread(
      [](double shift) {
        HoleShape hole{.radius = 8.2, .centre = {shift, 0.25}};
        hole.cut.depth = 18 + shift;
        return Shape(hole);
      },
      8.2, 16.4, 18);
}

TEST(ShiftedShapes, APolygonMaskIsTheSameAtEveryOffset) {
  const Frame frame{.spacing = 1, .cells = {48, 24}};
  for (int n = 0; n < 16; ++n) {
    const double shift = n / 16.0;
    const PolygonOutline box{
        .loops = {{{shift - 7.65, -6}, {shift + 7.65, -6}, {shift + 7.65, 6}, {shift - 7.65, 6}}}};
    const Layers layers = build_layers(
        frame, std::vector<Shape>{WaferShape{},
                                  MaskShape{.material = 1, .thickness = 10, .outline = box}});
    const Opening opening = measure(layers, 0.25, 2, 8);
    EXPECT_NEAR(opening.left, shift - 7.65, 0.05);
    EXPECT_NEAR(opening.right, shift + 7.65, 0.05);
  }
}

}  // namespace
}  // namespace scarp
