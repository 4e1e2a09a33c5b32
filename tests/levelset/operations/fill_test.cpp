// Which openings a fill takes for narrow, wherever they lie on the grid.

#include "levelset/operations/fill.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "levelset/grid/band.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/operations/layer_sets.h"
#include "levelset/operations/layer_steps.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

constexpr MaterialId si = 0;
constexpr MaterialId oxide = 1;

Frame line_of(int cells, bool is_around_axis = false) {
  Frame frame{.spacing = 1, .cells = {cells, 1}};
  frame.two_dimensional = true;
  frame.axisymmetric = is_around_axis;
  return frame;
}

Frame square_of(int cells, Boundary boundary = Boundary::reflective) {
  return {.spacing = 1, .cells = {cells, cells}, .boundary = {boundary, boundary}};
}

Shape trench(double width, double depth, double centre, double taper = 0, int along = 1) {
  TrenchShape shape{.width = width, .centre = centre, .along = along};
  shape.cut.depth = depth;
  shape.cut.taper = taper;
  return shape;
}

Shape hole(double radius, double depth, std::array<double, 2> centre, double taper = 0) {
  HoleShape shape{.radius = radius, .centre = centre};
  shape.cut.depth = depth;
  shape.cut.taper = taper;
  return shape;
}

Layers filled(const Frame& frame, const Shape& opening, double narrower_than) {
  Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{.material = si}, opening});
  add_layer(layers, oxide);
  fill(layers, 0, {.narrower_than = narrower_than});
  return layers;
}

double volume_of(const Layers& layers) { return material_volumes(layers).back(); }

void expect_unfilled(const Layers& layers) {
  EXPECT_TRUE(is_same_surface(layers.top(), layers.stack[0].phi)) << volume_of(layers);
}

// Where openings lie between two nodes.
constexpr std::array places{0.0, 0.13, 0.25, 0.38, 0.5, 0.69, 0.75, 0.94};
// By how much the width may differ from the true one. Units: spacings.
constexpr double most_error = 0.1;
// The grid knows circles as polygons.
double most_error_of_hole(double radius) { return 0.02 + 0.4 / radius; }

TEST(NarrowFill, TellsTrenchesApartWhereverTheyLie) {
  for (const double width : {2.3, 4.0, 5.9, 12.4})
    for (const double place : places) {
      SCOPED_TRACE(testing::Message() << width << ' ' << place);
      const double depth = 12.3;
      const Shape opening = trench(width, depth, place);
      EXPECT_NEAR(volume_of(filled(line_of(32), opening, width + most_error)), width * depth, 0.5);
      expect_unfilled(filled(line_of(32), opening, width - most_error));
    }
}

TEST(NarrowFill, TellsTrenchesInSpaceApart) {
  for (const int along : {0, 1})
    for (const double width : {2.3, 6.9})
      for (const double place : places) {
        SCOPED_TRACE(testing::Message() << along << ' ' << width << ' ' << place);
        const double depth = 6.4;
        const Shape opening = trench(width, depth, place, 0, along);
        EXPECT_NEAR(volume_of(filled(square_of(16), opening, width + most_error)),
                    16 * width * depth, 16 * 0.5);
        expect_unfilled(filled(square_of(16), opening, width - most_error));
      }
}

TEST(NarrowFill, TellsHolesApartWhereverTheyLie) {
  for (const double radius : {1.8, 4.6, 6.3})
    for (const double x : places)
      for (const double y : {0.0, 0.31, 0.5}) {
        SCOPED_TRACE(testing::Message() << radius << ' ' << x << ' ' << y);
        const double depth = 5.4;
        const double area = std::numbers::pi * radius * radius;
        const Shape opening = hole(radius, depth, {x, y});
        EXPECT_NEAR(
            volume_of(filled(square_of(20), opening, 2 * radius + most_error_of_hole(radius))),
            area * depth, 0.1 * area + radius);
        expect_unfilled(filled(square_of(20), opening, 2 * radius - most_error_of_hole(radius)));
      }
}

TEST(NarrowFill, TellsHolesAroundTheAxisApart) {
  for (const double radius : {4.0, 4.3, 4.5, 4.8}) {
    const double depth = 8.4;
    const double area = std::numbers::pi * radius * radius;
    const Shape opening = hole(radius, depth, {0, 0});
    EXPECT_NEAR(volume_of(filled(line_of(30, true), opening, 2 * radius + most_error)),
                area * depth, 0.1 * area + radius);
    expect_unfilled(filled(line_of(30, true), opening, 2 * radius - most_error));
  }
}

// The fill of an opening whose walls lean ends where it is as wide as the limit, half a spacing up
// or down at most, and further by what the error of its width means on such walls.
TEST(NarrowFill, EndsWhereLeaningWallsAreFarEnoughApart) {
  for (const double taper : {0.035, 0.1, 0.3})
    for (const double place : places) {
      SCOPED_TRACE(testing::Message() << taper << ' ' << place);
      const double slope = std::tan(taper);
      const double depth = 12.4;
      const double height = 7.3;
      const double floor = 8.2;
      const double limit = floor + 2 * slope * height;
      const double width = floor + 2 * slope * depth;
      const Shape opening = trench(width, depth, place, taper);
      const double expected = (floor + limit) / 2 * height;
      // Without pockets at the walls.
      EXPECT_NEAR(volume_of(filled(line_of(40), opening, limit)), expected, 0.3);
      const double of_width = 0.01 / slope;
      EXPECT_NEAR(volume_of(filled(square_of(20), opening, limit)) / 20, expected,
                  (0.5 + of_width) * limit);
    }
}

TEST(NarrowFill, EndsWhereLeaningHolesAreWideEnough) {
  for (const double taper : {0.05, 0.3})
    for (const double place : {0.0, 0.25, 0.38, 0.5}) {
      SCOPED_TRACE(testing::Message() << taper << ' ' << place);
      const double slope = std::tan(taper);
      const double depth = 8.4;
      const double height = 4.3;
      const double floor = 4.7;
      const double limit = floor + slope * height;
      const Shape opening = hole(floor + slope * depth, depth, {place, 0.4}, taper);
      const double expected =
          std::numbers::pi / 3 * height * (floor * floor + floor * limit + limit * limit);
      const double area = std::numbers::pi * limit * limit;
      const double of_width = most_error_of_hole(limit) / 2 / slope;
      EXPECT_NEAR(volume_of(filled(square_of(24), opening, 2 * limit)), expected,
                  (0.5 + of_width) * area);
    }
}

// Trenches along the diagonals of one cell or two.
TEST(NarrowFill, TellsTrenchesAtAnAngleApart) {
  const double width = 5.3;
  const double depth = 5.9;
  for (const double slope : {1.0, 2.0})
    for (const double place : {0.0, 0.3, 0.61}) {
      SCOPED_TRACE(testing::Message() << slope << ' ' << place);
      const double pitch = 24 / std::hypot(1, slope);
      const auto solid = [&](Vec3d r) {
        const double along = (slope * r.x + r.y) / std::hypot(1, slope) - place;
        const double across = std::abs(std::remainder(along, pitch)) - width / 2;
        return std::max(r.z - 0.3, -std::max(across, 0.3 - depth - r.z));
      };
      Layers layers = single_layer(square_of(24, Boundary::periodic), solid, -12, 5);
      add_layer(layers, oxide);
      Layers wide = layers.copy();
      fill(layers, 0.3, {.narrower_than = width + most_error});
      fill(wide, 0.3, {.narrower_than = width - most_error});
      EXPECT_NEAR(volume_of(layers), 24 * 24 * width / pitch * depth,
                  24 * 24 / pitch * 0.25 * width);
      EXPECT_NEAR(volume_of(wide), 0, 0.5);
    }
}

// phi of the top at nodes, of which those of another wafer are the images.
template <class Image>
void expect_images(const Layers& one, const Layers& other, const Image& image) {
  const Band& band = one.top().band();
  for (int i = 0; i < band.node_count(0); ++i)
    for (int j = 0; j < band.node_count(1); ++j)
      for (int k = -12; k < 4; ++k) {
        const Node there = image(Node{i, j, k});
        ASSERT_EQ(one.top().node(i, j, k), other.top().node(there[0], there[1], there[2]))
            << i << ' ' << j << ' ' << k;
      }
}

Layers filled_holes(const Frame& frame, std::array<double, 2> first, std::array<double, 2> second) {
  Layers layers =
      build_layers(frame, std::vector<Shape>{WaferShape{.material = si},
                                             hole(4.3, 7.4, first, 0.05), hole(5.1, 5.2, second)});
  add_layer(layers, oxide);
  fill(layers, 0, {.narrower_than = 8.2});
  return layers;
}

TEST(NarrowFill, OfImagesIsTheImage) {
  const Frame frame = square_of(24, Boundary::periodic);
  const Layers there = filled_holes(frame, {-4.3, 1.6}, {5.2, -2.7});
  EXPECT_GT(volume_of(there), 100);
  const Layers mirrored = filled_holes(frame, {4.3, 1.6}, {-5.2, -2.7});
  expect_images(there, mirrored, [](Node node) { return Node{24 - node[0], node[1], node[2]}; });
  const Layers turned = filled_holes(frame, {1.6, -4.3}, {-2.7, 5.2});
  expect_images(there, turned, [](Node node) { return Node{node[1], node[0], node[2]}; });
  const Layers shifted = filled_holes(frame, {-1.3, 6.6}, {8.2, 2.3});
  expect_images(there, shifted, [](Node node) { return Node{node[0] + 3, node[1] + 5, node[2]}; });
}

}  // namespace
}  // namespace scarp
