#include "levelset/shapes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

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

/// Whether a point lies in a layer (or one below it).
bool is_in(const Layers& layers, std::size_t layer, Vec3d r) {
  return layers.stack[layer].phi.distance(r) < 0;
}

TEST(Shapes, TaperNarrowsATrenchDownwardsAndAFinUpwards) {
  const Frame frame{.spacing = 1, .cells = {60, 12}};
  const double taper = 0.1;
  TrenchShape trench{.width = 20};
  trench.cut = {.depth = 25, .taper = taper, .depth_from = {}, .through = {}};
  const Layers grooved = build_layers(frame, std::vector<Shape>{WaferShape{}, trench});
  const double groove = 25 * (20 - 25 * std::tan(taper));
  EXPECT_NEAR(material_volumes(grooved)[0], -groove * 12, 0.003 * groove * 12);
  EXPECT_NEAR(grooved.top().distance({10 - 12 * std::tan(taper), 0, -12}), 0, 0.01);

  const Layers ridged = build_layers(
      frame,
      std::vector<Shape>{WaferShape{.material = 0},
                         FinShape{.material = 1, .width = 20, .height = 25, .taper = taper}});
  EXPECT_NEAR(material_volumes(ridged)[1], groove * 12, 0.003 * groove * 12);
}

TEST(Shapes, HolesAndCirclesHaveTheirVolumes) {
  const Frame frame{.spacing = 0.5, .cells = {60, 60}};
  HoleShape hole{.radius = 10, .centre = {1, -2}};
  hole.cut = {.depth = 15, .taper = 0.2, .depth_from = {}, .through = {}};
  const double bottom = 10 - 15 * std::tan(0.2);
  const double cone = std::numbers::pi / 3 * 15 * (100 + 10 * bottom + bottom * bottom);
  const Layers layers = build_layers(
      frame,
      std::vector<Shape>{WaferShape{.material = 0}, hole,
                         MaskShape{.material = 1,
                                   .thickness = 6,
                                   .outlines = MaskShape::Outlines::resist,
                                   .outline = CircleOutline{.radius = 3, .centre = {10, 10}}}});
  EXPECT_NEAR(material_volumes(layers)[0], -cone, 0.005 * cone);
  const double pillar = std::numbers::pi * 9 * 6;
  EXPECT_NEAR(material_volumes(layers)[1], pillar, 0.01 * pillar);
}

TEST(Shapes, ThroughAndDepthFromLimitACut) {
  const Frame frame{.spacing = 1, .cells = {40, 12}};
  const std::vector<Shape> films{WaferShape{.material = 0},
                                 LayerShape{.material = 1, .thickness = 5},
                                 LayerShape{.material = 2, .thickness = 4}};
  const auto with = [&](Cut cut) {
    std::vector<Shape> shapes = films;
    shapes.push_back(TrenchShape{.width = 12.3, .centre = 0, .along = 1, .cut = cut});
    return build_layers(frame, shapes);
  };
  const Vec3d in_wafer{0, 0, -1};
  const Vec3d in_first{0, 0, 2};
  const Vec3d in_second{0, 0, 7};

  const Layers all = with({.depth = 12, .taper = 0, .depth_from = {}, .through = {}});
  EXPECT_FALSE(is_in(all, 2, in_wafer));
  EXPECT_TRUE(is_in(all, 2, {0, 0, -4}));  // 12 deep from z = 9

  const Layers from_wafer = with({.depth = 12, .taper = 0, .depth_from = 0, .through = {}});
  EXPECT_FALSE(is_in(from_wafer, 2, {0, 0, -11}));
  EXPECT_TRUE(is_in(from_wafer, 2, {0, 0, -13}));

  const Layers top_only = with({.depth = 12, .taper = 0, .depth_from = {}, .through = {2}});
  EXPECT_FALSE(is_in(top_only, 2, in_second));
  EXPECT_TRUE(is_in(top_only, 2, in_first));
  EXPECT_NEAR(top_only.top().distance({0, 0, 5.2}), 0.2, 0.002);

  // A cavity in the lower film under a roof of the upper one.
  const Layers roofed = with({.depth = 12, .taper = 0, .depth_from = {}, .through = {1}});
  EXPECT_TRUE(is_in(roofed, 2, in_second));
  EXPECT_FALSE(is_in(roofed, 2, in_first));
  EXPECT_FALSE(is_in(roofed, 1, in_first));
  EXPECT_TRUE(is_in(roofed, 2, in_wafer));
  EXPECT_NEAR(material_volumes(roofed)[1], (40 - 12.3) * 12 * 5, 15);
}

TEST(Shapes, ReachAcrossSidesAsMirrorImagesOrCopies) {
  for (const Boundary boundary : {Boundary::reflective, Boundary::periodic}) {
    const Frame frame{.spacing = 1, .cells = {40, 40}, .boundary = {boundary, boundary}};
    HoleShape hole{.radius = 8.3, .centre = {17, 0}};
    hole.cut.depth = 10;
    const Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{}, hole});
    const bool periodic = boundary == Boundary::periodic;
    EXPECT_EQ(is_in(layers, 0, {-19, 0, -4}), !periodic);
    EXPECT_FALSE(is_in(layers, 0, {19, 0, -4}));
    // The distance near the side counts the image: at the side the wall is where both meet.
    const double wall = std::sqrt(8.3 * 8.3 - 9);
    EXPECT_LT(layers.top().distance({20, wall + 1, -4}), 0);
    EXPECT_GT(layers.top().distance({20, wall - 1, -4}), 0);
  }
}

TEST(Shapes, PhiIsTheExactDistanceAroundEdges) {
  const Frame frame{.spacing = 1, .cells = {40, 12}};
  TrenchShape trench{.width = 12.4};
  trench.cut.depth = 9.7;
  const Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{}, trench});
  const LevelSet& phi = layers.top();
  for (int i = 21; i < 40; ++i) {
    for (int k = -14; k < 5; ++k) {
      const double x = i - 20;
      // Quarter planes: gas above the wafer or inside the trench.
      double exact;
      if (k > 0) {
        exact = x < 6.2 ? std::hypot(6.2 - x, k) : k;
      } else if (x < 6.2 && k > -9.7) {
        exact = std::min(6.2 - x, k + 9.7);
      } else if (x >= 6.2 && k > -9.7) {
        exact = -std::min(x - 6.2, -1.0 * k);
      } else {
        exact = x < 6.2 ? k + 9.7 : -std::hypot(x - 6.2, k + 9.7);
      }
      const double clamped = std::clamp(exact - 1e-3, -4.0, 4.0);
      EXPECT_NEAR(phi.node(i, 5, k), clamped, 1e-5) << x << " " << k;
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
