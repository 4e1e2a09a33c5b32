// Start geometries at positions between nodes: walls, mouth and depth do not depend on where the
// nodes are.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "levelset/metrology/cross_section.h"
#include "levelset/operations/layer_steps.h"
#include "levelset/start/shapes.h"
#include "levelset/surface/extract_surface.h"

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

const Frame wrapped{
    .spacing = 1, .cells = {80, 60}, .boundary = {Boundary::periodic, Boundary::periodic}};

PolygonOutline diamond(double x, double y, PolygonOutline::Rule rule) {
  return {.loops = {{{x - 23.3, y}, {x, y - 26.2}, {x + 23.3, y}, {x, y + 26.2}},
                    {{x - 4, y - 4}, {x + 4, y - 4}, {x + 4, y + 4}, {x - 4, y + 4}}},
          .rule = rule};
}

Shape box(double x, double y) {
  TriMesh mesh;
  for (const double cz : {-6.3, 8.4}) {
    for (const double cy : {-21.6, 21.6}) {
      for (const double cx : {-27.4, 27.4}) mesh.vertices.emplace_back(Vec3d{x + cx, y + cy, cz});
    }
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return MeshShape{.mesh = std::make_shared<const TriMesh>(mesh), .material = 1};
}

struct Movable {
  const char* name;
  std::function<Shape(double x, double y)> at;
};

std::vector<Movable> movable_shapes() {
  const Cut cut{.depth = 7.3, .taper = 0.1};
  const auto mask = [](Outline outline) {
    return Shape(
        MaskShape{.material = 1, .thickness = 6.2, .taper = -0.1, .outline = std::move(outline)});
  };
  using Rule = PolygonOutline::Rule;
  return {
      {"trench",
       [=](double x, double) { return TrenchShape{.width = 55.7, .centre = x, .cut = cut}; }},
      {"hole",
       [=](double x, double y) {
         return HoleShape{.radius = 24.3, .centre = {x, y}, .cut = cut};
       }},
      {"holes",
       [=](double x, double y) {
         return HoleShape{.radius = 9.3,
                          .centre = {x, y},
                          .cut = cut,
                          .repeat = {.count = {3, 2}, .pitch = {24, 28}}};
       }},
      {"fin",
       [=](double x, double) {
         return FinShape{.material = 1, .width = 47.7, .height = 20, .centre = x, .taper = 0.1};
       }},
      {"slot", [=](double x, double) { return mask(SlotOutline{.width = 45.7, .centre = x}); }},
      {"circle",
       [=](double x, double y) {
         return mask(CircleOutline{.radius = 22.3, .centre = {x, y}});
       }},
      {"rectangle",
       [=](double x, double y) {
         return mask(RectangleOutline{.size = {51.3, 40.6}, .centre = {x, y}, .corner_radius = 5});
       }},
      {"polygon", [=](double x, double y) { return mask(diamond(x, y, Rule::even_odd)); }},
      {"layout", [=](double x, double y) { return mask(diamond(x, y, Rule::any)); }},
      {"mesh", box},
  };
}

std::vector<double> volumes_at(const Movable& movable, double x, double y) {
  return material_volumes(
      build_layers(wrapped, std::vector<Shape>{WaferShape{}, movable.at(x, y)}));
}

TEST(ShiftedShapes, OverPeriodicSidesAndCornersNothingIsLost) {
  for (const Movable& movable : movable_shapes()) {
    const std::vector<double> inside = volumes_at(movable, 0, 0);
    const std::array<std::array<double, 2>, 4> centres{{{39, 0}, {0, -29}, {39, 29}, {-17, 13}}};
    const bool is_row = std::string(movable.name) == "holes";  // all copies are in the domain
    for (const auto& [x, y] : centres) {
      const std::vector<double> there =
          volumes_at(movable, is_row ? std::round(0.3 * x) : x, is_row ? std::round(0.4 * y) : y);
      ASSERT_EQ(there.size(), inside.size());
      for (std::size_t m = 0; m < inside.size(); ++m) {
        EXPECT_NEAR(there[m], inside[m], 1e-6 * std::abs(inside[m]))
            << movable.name << " at " << x << ", " << y;
      }
    }
  }
}

TEST(ShiftedShapes, WhatIsTooLongToRepeatIsRefused) {
  const PolygonOutline strip{.loops = {{{0, 0}, {90000, 0}, {90000, 9}, {0, 9}}}};
  const std::vector<Shape> shapes{WaferShape{},
                                  MaskShape{.material = 1, .thickness = 6, .outline = strip}};
  const std::vector<ShapeProblem> problems = check_shapes(wrapped, shapes);
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_NE(problems[0].message.find("90000 nm long across a periodic side"), std::string::npos)
      << problems[0].message;
}

}  // namespace
}  // namespace scarp
