#include "levelset/shapes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "levelset/cross_section.h"
#include "levelset/extract_surface.h"
#include "surfaces.h"

namespace scarp {
namespace {

using testing::HasSubstr;

TEST(Shapes, TrenchHasItsVolume) {
  const Frame frame{.spacing = 1, .cells = {40, 12}};
  TrenchShape trench{.width = 13.4};
  trench.cut.depth = 17.3;
  const Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{}, trench});
  const double exact = -13.4 * 17.3 * 12;
  EXPECT_NEAR(material_volumes(layers)[0], exact, 0.01 * -exact);
}

TEST(Shapes, LayersAreNested) {
  const Frame frame{.spacing = 1, .cells = {40, 20}};
  HoleShape hole{.radius = 7.2, .centre = {-3, 1}};
  hole.cut = {.depth = 12, .taper = 0.1, .depth_from = 0, .through = {}};
  const Layers layers = build_layers(
      frame, std::vector<Shape>{
                 WaferShape{.material = 0}, LayerShape{.material = 1, .thickness = 3.3}, hole,
                 MaskShape{.material = 2,
                           .thickness = 5,
                           .outline = RectangleOutline{.size = {18, 13}, .centre = {-3, 1}}}});
  ASSERT_EQ(layers.stack.size(), 3U);
  for (int i = 0; i <= 40; ++i) {
    for (int k = -16; k < 16; ++k) {
      EXPECT_LE(layers.stack[2].phi.node(i, 10, k), layers.stack[1].phi.node(i, 10, k));
      EXPECT_LE(layers.stack[1].phi.node(i, 10, k), layers.stack[0].phi.node(i, 10, k));
    }
  }
}

struct BadShape {
  Shape shape;
  std::string message;
};

class BadShapes : public testing::TestWithParam<BadShape> {};

TEST_P(BadShapes, AreRefusedWithTheKey) {
  const Frame frame{.spacing = 1, .cells = {40, 20}};
  const std::vector<Shape> shapes{WaferShape{}, GetParam().shape};
  try {
    build_layers(frame, shapes);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr(GetParam().message));
  }
}

Shape trench(double width, double depth, double taper = 0, double centre = 0) {
  TrenchShape shape{.width = width, .centre = centre};
  shape.cut.depth = depth;
  shape.cut.taper = taper;
  return shape;
}

INSTANTIATE_TEST_SUITE_P(
    All, BadShapes,
    testing::Values(
        BadShape{trench(41, 5), "geometry[1].width: 41 nm is not narrower than the domain (40 nm)"},
        BadShape{trench(1.5, 5), "geometry[1].width: 1.5 nm is thinner than two grid spacings"},
        BadShape{trench(10, 0), "geometry[1].depth: must be a length above 0"},
        BadShape{trench(std::nan(""), 5), "geometry[1].width: must be"},
        BadShape{trench(10, 5, 0, 30), "geometry[1].center: must lie in the domain"},
        BadShape{trench(10, 20, 0.3), "geometry[1].taper: leaves a floor"},
        BadShape{trench(39, 5), "geometry[1].width: leaves 1 nm to its image"},
        BadShape{WaferShape{}, "geometry[1].shape: a wafer can only be the first"},
        BadShape{LayerShape{.material = 1, .thickness = -1}, "geometry[1].thickness: must be"},
        BadShape{MaskShape{.material = 1, .thickness = 5, .outline = SlotOutline{.width = 50}},
                 "geometry[1].opening.width: 50 nm is not narrower"}));

}  // namespace
}  // namespace scarp
