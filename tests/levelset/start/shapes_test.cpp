#include "levelset/start/shapes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/operations/layer_steps.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/extract_surface.h"
#include "tests/levelset/surfaces.h"

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
  const auto with = [&](const Cut& cut) {
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

/// Volumes of all materials of a wafer (material 0) with one more shape.
std::vector<double> volumes_of(const Frame& frame, const Shape& shape) {
  return material_volumes(build_layers(frame, std::vector<Shape>{WaferShape{}, shape}));
}

constexpr double corner_share = 1 - std::numbers::pi / 4;  // what a radius of 1 takes off a corner

TEST(Shapes, RoundedTrenchesHaveTheirVolume) {
  const Frame frame{.spacing = 1, .cells = {48, 8}};
  TrenchShape trench{.width = 16.4};
  trench.cut.depth = 15.3;
  const double sharp = 16.4 * 15.3;
  trench.cut.bottom_radius = 5;
  EXPECT_NEAR(volumes_of(frame, trench)[0], -8 * (sharp - 2 * corner_share * 25), 4);
  trench.cut.bottom_radius = 8.2;  // a U
  EXPECT_NEAR(volumes_of(frame, trench)[0], -8 * (sharp - 2 * corner_share * 8.2 * 8.2), 4);
  trench.cut.bottom_radius = 0;
  trench.cut.top_radius = 5;
  EXPECT_NEAR(volumes_of(frame, trench)[0], -8 * (sharp + 2 * corner_share * 25), 4);
}

TEST(Shapes, ReentrantOpeningsWidenDownwards) {
  const Frame frame{.spacing = 1, .cells = {48, 48}};
  const double slope = 0.15;
  TrenchShape trench{.width = 12.4};
  trench.cut = {.depth = 15.3, .taper = -slope};
  const double wide = 15.3 * std::tan(slope);
  EXPECT_NEAR(volumes_of(frame, trench)[0], -48 * 15.3 * (12.4 + wide), 60);
  HoleShape hole{.radius = 6.2};
  hole.cut = trench.cut;
  const double r = 6.2;
  const double floor = r + wide;
  EXPECT_NEAR(volumes_of(frame, hole)[0],
              -std::numbers::pi / 3 * 15.3 * (r * r + r * floor + floor * floor), 30);
}

TEST(Shapes, RepeatedShapesAreCopies) {
  const Frame frame{
      .spacing = 1, .cells = {64, 48}, .boundary = {Boundary::periodic, Boundary::reflective}};
  TrenchShape trench{.width = 7.3};
  trench.cut.depth = 10.2;
  const double one = volumes_of(frame, trench)[0];
  trench.repeat = {.count = {4, 1}, .pitch = {16, 0}};
  EXPECT_NEAR(volumes_of(frame, trench)[0], 4 * one, 3e-3 * -one);
  HoleShape hole{.radius = 4.7, .centre = {1, -2}};
  hole.cut.depth = 10.2;
  const double dot = volumes_of(frame, hole)[0];
  hole.repeat = {.count = {3, 2}, .pitch = {16, 20}};
  EXPECT_NEAR(volumes_of(frame, hole)[0], 6 * dot, 3e-2 * -dot);
  const MaskShape mask{.material = 1,
                       .thickness = 6,
                       .outline = CircleOutline{.radius = 4.7, .repeat = hole.repeat}};
  EXPECT_NEAR(volumes_of(frame, mask)[1], 6 * (64 * 48 - 6 * std::numbers::pi * 4.7 * 4.7), 50);
}

TEST(Shapes, AStackAlternates) {
  const Frame frame{.spacing = 1, .cells = {20, 20}};
  const StackShape stack{
      .layers = {{.material = 1, .thickness = 4.5}, {.material = 2, .thickness = 2.5}}, .count = 3};
  const Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{}, stack});
  ASSERT_EQ(layers.stack.size(), 7U);
  double top = 0;
  for (std::size_t k = 1; k < 7; ++k) {
    EXPECT_EQ(layers.stack[k].material, k % 2 == 1 ? 1 : 2);
    top += k % 2 == 1 ? 4.5 : 2.5;
    EXPECT_NEAR(layers.stack[k].phi.distance({0, 0, top}), 0, 0.01);
  }
}

MaskShape square_mask(double taper, Outline outline) {
  return {.material = 1, .thickness = 9, .taper = taper, .outline = std::move(outline)};
}

TEST(Shapes, VeryManyShapesAreRefused) {
  std::vector<Shape> shapes(1001, LayerShape{.material = 0, .thickness = 1});
  shapes[0] = WaferShape{};
  const auto problems = check_shapes({.spacing = 1, .cells = {40, 20}}, shapes);
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_EQ(problems[0].shape, 1000U);
  EXPECT_THAT(problems[0].message, HasSubstr("is one of 1001 shapes, at most 1000"));
}

TEST(Shapes, APolygonIsTheRectangleItDescribes) {
  const Frame frame{.spacing = 1, .cells = {48, 40}};
  for (const double taper : {0.0, 0.12}) {
    const RectangleOutline box{.size = {17.3, 13.1}, .centre = {1.2, 0.4}};
    const PolygonOutline same{.loops = {{{1.2 - 8.65, 0.4 - 6.55},
                                         {1.2 + 8.65, 0.4 - 6.55},
                                         {1.2 + 8.65, 0.4 + 6.55},
                                         {1.2 - 8.65, 0.4 + 6.55}}}};
    const Layers a = build_layers(frame, std::vector<Shape>{WaferShape{}, square_mask(taper, box)});
    const Layers b =
        build_layers(frame, std::vector<Shape>{WaferShape{}, square_mask(taper, same)});
    for (int i = 0; i <= 48; ++i) {
      for (int j = 0; j <= 40; ++j) {
        for (int k = -3; k < 14; ++k) {
          // The polygon is exact. The rectangle takes its planes in pairs, which is not exact where
          // three of them meet: 0.002 at a depth of 1.8, more further inside.
          if (std::abs(a.top().node(i, j, k)) > 2) continue;
          ASSERT_NEAR(a.top().node(i, j, k), b.top().node(i, j, k), 3e-3)
              << i << ' ' << j << ' ' << k << " taper " << taper;
        }
      }
    }
  }
}

TEST(Shapes, PolygonMasksWithHolesHaveTheirVolume) {
  const Frame frame{.spacing = 1, .cells = {48, 48}};
  const PolygonOutline ring{.loops = {{{-15.3, -14.2}, {15.3, -14.2}, {15.3, 14.2}, {-15.3, 14.2}},
                                      {{-6.1, -5.2}, {6.1, -5.2}, {0, 7.4}}}};
  const double area = 30.6 * 28.4 - 0.5 * 12.2 * 12.6;
  MaskShape mask = square_mask(0, ring);
  EXPECT_NEAR(volumes_of(frame, mask)[1], 9 * (48 * 48 - area), 20);
  mask.outlines = MaskShape::Outlines::resist;
  EXPECT_NEAR(volumes_of(frame, mask)[1], 9 * area, 20);
}

TEST(Shapes, APolygonOverASideIsMirrored) {
  const Frame frame{.spacing = 1, .cells = {48, 48}};
  const PolygonOutline edge{.loops = {{{14.3, -9.2}, {70, -9.2}, {70, 9.2}, {14.3, 9.2}}}};
  MaskShape mask = square_mask(0, edge);
  mask.outlines = MaskShape::Outlines::resist;
  EXPECT_NEAR(volumes_of(frame, mask)[1], 9 * 9.7 * 18.4, 10);
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

/// The keys of one shape that are reported.
std::vector<std::string> keys_reported(const Shape& shape) {
  std::vector<std::string> keys;
  const std::vector<Shape> shapes{WaferShape{}, shape};
  for (const ShapeProblem& problem : check_shapes({.spacing = 10, .cells = {40, 20}}, shapes))
    keys.push_back(problem.key);
  return keys;
}

TEST(Shapes, OnlyTheKeyThatIsWrongIsReported) {
  using Keys = std::vector<std::string>;
  EXPECT_EQ(keys_reported(trench(15, 100)), Keys{"width"});
  EXPECT_EQ(keys_reported(trench(100, 5)), Keys{"depth"});
  EXPECT_EQ(keys_reported(trench(100, 200, 0.3)), Keys{"taper"});
  HoleShape hole{.radius = 5};
  hole.cut.depth = 100;
  EXPECT_EQ(keys_reported(hole), Keys{"radius"});
  FinShape fin{.material = 1, .width = 15, .height = 100};
  EXPECT_EQ(keys_reported(fin), Keys{"width"});
}

Shape round_hole(double radius) {
  HoleShape shape{.radius = radius};
  shape.cut.depth = 5;
  return shape;
}

Shape rounded(double bottom, double top) {
  TrenchShape shape{.width = 10};
  shape.cut = {.depth = 8, .bottom_radius = bottom, .top_radius = top};
  return shape;
}

Shape row(int count, double pitch) {
  TrenchShape shape{.width = 10};
  shape.cut.depth = 8;
  shape.repeat = {.count = {count, 1}, .pitch = {pitch, 0}};
  return shape;
}

Shape polygon(const Loop& loop, double taper = 0) {
  return MaskShape{
      .material = 1, .thickness = 5, .taper = taper, .outline = PolygonOutline{.loops = {loop}}};
}

/// A mask 6 nm thick.
Shape mask(const Outline& outline, double taper, bool is_opening = true) {
  return MaskShape{
      .material = 1,
      .thickness = 6,
      .taper = taper,
      .outlines = is_opening ? MaskShape::Outlines::opening : MaskShape::Outlines::resist,
      .outline = outline};
}

/// A tetrahedron with right angles at a corner.
Shape tetrahedron(Vec3f corner, float size) {
  TriMesh mesh;
  mesh.vertices = {corner, corner + Vec3f{size, 0, 0}, corner + Vec3f{0, size, 0},
                   corner + Vec3f{0, 0, size}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return MeshShape{.mesh = std::make_shared<TriMesh>(mesh), .material = 1};
}

// The foot of a mask is no surface where the mask lies on solid, far from its walls either.
TEST(Shapes, UnderTheMiddleOfAMaskAllIsDeep) {
  const Frame frame{.spacing = 1, .cells = {60, 60}};
  const Loop wide{{-80, -80}, {20, -80}, {20, 80}, {-80, 80}};
  const Layers layers = build_layers(
      frame, std::vector<Shape>{WaferShape{}, MaskShape{.material = 1,
                                                        .thickness = 12,
                                                        .outlines = MaskShape::Outlines::resist,
                                                        .outline = PolygonOutline{{wide}}}});
  for (int i = 0; i <= 40; ++i) {
    for (int k = -10; k <= 6; ++k)
      EXPECT_EQ(layers.top().node(i, 30, k), -LevelSet::half_width) << i << ' ' << k;
  }
}

// How deep a place lies matters as far as the rounded edge of a later hole reaches.
TEST(Shapes, FarFromItsEdgeAMaskIsAHigherWafer) {
  const Frame frame{.spacing = 1, .cells = {80, 60}};
  HoleShape hole{.radius = 9, .centre = {-15, 0}};
  hole.cut = {.depth = 20, .top_radius = 7};
  const Loop wide{{-80, -80}, {30, -80}, {30, 80}, {-80, 80}};
  const Layers masked =
      build_layers(frame, std::vector<Shape>{WaferShape{},
                                             MaskShape{.thickness = 5,
                                                       .outlines = MaskShape::Outlines::resist,
                                                       .outline = PolygonOutline{.loops = {wide}}},
                                             hole});
  const Layers bare = build_layers(frame, std::vector<Shape>{WaferShape{}, hole});
  for (int i = 0; i <= 56; ++i) {
    for (int k = -30; k < 12; ++k)
      EXPECT_EQ(masked.top().node(i, 30, k + 5), bare.top().node(i, 30, k)) << i << ' ' << k;
  }
}

// One message for one mistake: the domain is a spacing wide along y in two dimensions.
TEST(Shapes, AWrongDirectionInTwoDimensionsIsToldOnce) {
  Frame frame{.spacing = 1, .cells = {40, 1}};
  frame.two_dimensional = true;
  TrenchShape trench{.width = 10, .along = 0};
  trench.cut.depth = 5;
  const auto problems = check_shapes(frame, std::vector<Shape>{WaferShape{}, trench});
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_EQ(problems[0].key, "along");
}

// What lay on the surface of a layer that is cut away below it is not left as a film.
TEST(Shapes, AMaskThatIsCutFreeLeavesNoSheet) {
  const Frame frame{.spacing = 1, .cells = {40, 20}};
  TrenchShape below{.width = 30};
  below.cut = {.depth = 10, .through = {1}};
  Layers layers = build_layers(
      frame, std::vector<Shape>{WaferShape{}, LayerShape{.material = 1, .thickness = 10},
                                MaskShape{.material = 2,
                                          .thickness = 6,
                                          .outlines = MaskShape::Outlines::resist,
                                          .outline = SlotOutline{.width = 12}},
                                below});
  const std::vector<Region> islands = remove_islands(layers);
  ASSERT_EQ(islands.size(), 1U);
  EXPECT_NEAR(islands[0].volume, 12 * 6 * 20, 2);
  EXPECT_NEAR(islands[0].lower, 10, 0.01);
}

// A slot beside a trench that was there before: the trench's wall is none where the slot opens, and
// phi is the distance to what is left. A fin between the two cuts changes nothing of that.
TEST(Shapes, ASlotBesideAnEarlierTrenchHasAnOpenMouth) {
  const Frame frame{.spacing = 1, .cells = {60, 4}};
  TrenchShape trench{.width = 24};
  trench.cut.depth = 30;
  TrenchShape slot{.width = 40};
  slot.cut = {.depth = 10, .through = {1}};
  const FinShape fin{.material = 3, .width = 4, .height = 6, .centre = 24};
  for (const bool with_fin : {false, true}) {
    std::vector<Shape> shapes{WaferShape{}, LayerShape{.material = 1, .thickness = 10},
                              LayerShape{.material = 2, .thickness = 12}, trench};
    if (with_fin) shapes.push_back(fin);
    shapes.push_back(slot);
    const Layers layers = build_layers(frame, shapes);
    for (double x = 0.5; x < 20; ++x) {
      for (double z = 0.5; z < 10; ++z) {
        const double to_edge = std::max(12 - x, 0.0);
        const double to_roof = std::hypot(to_edge, 10 - z);
        const double to_floor = std::hypot(to_edge, z);
        const double expected = std::min({to_roof, to_floor, 20 - x});
        if (expected > 2.5) continue;
        EXPECT_NEAR(layers.top().distance({x, 0.5, z}), expected, 0.3) << x << " " << z;
      }
    }
  }
}

// A mask that was opened down to what is undercut: the floor of the opening was no edge of it.
TEST(Shapes, ASlotUnderAnOpeningHasAnOpenMouth) {
  Frame frame{.spacing = 1, .cells = {60, 1}};
  frame.two_dimensional = true;
  for (const double width : {10.0, 10.6, 11.0}) {
    TrenchShape opening{.width = width};
    opening.cut = {.depth = 10, .through = {1}};
    TrenchShape slot{.width = 40};
    slot.cut = {.depth = 15, .through = {0}};
    Layers layers = build_layers(
        frame, std::vector<Shape>{WaferShape{}, LayerShape{.material = 1, .thickness = 10}, opening,
                                  slot});
    for (const double z : {-7.0, -2.0, -1.0, 0.0, 1.0, 5.0})
      EXPECT_GT(layers.top().distance({0, 0, z}), 3.9) << width << " " << z;
    add_layer(layers, 2);
    coat(layers, 1);
    // Around 40 by 15 without the opening, up its walls, and on top, with its six corners.
    const double around = 2 * 40 + 2 * 15 - width + 2 * 10 + 60 - width;
    EXPECT_NEAR(material_volumes(layers).back(), around - 4 + std::numbers::pi, 2) << width;
  }
}

// A leg that stands on the floor of a slot is one with it, and two trenches side by side are one.
TEST(Shapes, WhatMeetsIsOne) {
  Frame frame{.spacing = 1, .cells = {60, 1}};
  frame.two_dimensional = true;
  TrenchShape gap{.width = 12};
  gap.cut.depth = 10;
  const FinShape leg{.material = 2, .width = 8, .height = 10};
  TrenchShape slot{.width = 40};
  slot.cut = {.depth = 10, .through = {1}};
  const Layers standing = build_layers(
      frame,
      std::vector<Shape>{WaferShape{}, LayerShape{.material = 1, .thickness = 10}, gap, leg, slot});
  for (const double z : {1.0, 0.0, -1.0}) EXPECT_LT(standing.top().distance({0, 0, z}), -3.5) << z;

  for (const double middle : {0.0, 0.4, 0.5}) {
    TrenchShape left{.width = 12, .centre = middle - 6};
    left.cut.depth = 10;
    TrenchShape right = left;
    right.centre = middle + 6;
    const Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{}, left, right});
    for (const double z : {-1.0, -4.0, -6.0})
      EXPECT_GT(layers.top().distance({middle, 0, z}), 3.3) << middle << " " << z;
  }
}

// Two walls that cross, of a pair of trenches: leaves that hold the surface are all there.
TEST(Shapes, WallsThatCrossKeepTheirSurface) {
  Frame frame{.spacing = 1, .cells = {60, 1}};
  frame.two_dimensional = true;
  TrenchShape wide{.width = 14, .centre = 8};
  wide.cut.depth = 22;
  TrenchShape narrow{.width = 8};
  narrow.cut = {.depth = 18, .taper = 0.07};
  const Layers layers = build_layers(
      frame,
      std::vector<Shape>{WaferShape{}, LayerShape{.material = 1, .thickness = 5}, wide, narrow});
  for (double x = -2; x < 15; ++x)
    for (double z = -12; z < 5; ++z)
      EXPECT_GT(layers.top().distance({x, 0, z}), 0) << x << " " << z;
  const double floor = layers.top().distance({8, 0, -16});
  EXPECT_NEAR(floor, 1, 0.01);
}

TEST(Shapes, TaperedMasksAreUprightBelowTheirFoot) {
  Frame frame{.spacing = 1, .cells = {60, 1}};
  frame.two_dimensional = true;
  TrenchShape trench{.width = 30};
  trench.cut.depth = 30;
  for (const double taper : {0.17, -0.17}) {
    const MaskShape mask{
        .material = 1, .thickness = 10, .taper = taper, .outline = SlotOutline{.width = 20}};
    const Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{}, trench, mask});
    for (const double z : {-1.0, -10.0, -25.0})
      EXPECT_NEAR(layers.top().distance({9, 0, z}), 1, 0.02) << taper << " " << z;
    EXPECT_NEAR(layers.top().distance({9, 0, 5}), (1 + 5 * std::tan(taper)) * std::cos(taper),
                0.02);
  }
}

TEST(Shapes, AMeshIsAcceptedWhereAnyOfItIsInTheDomain) {
  const Frame frame{.spacing = 1, .cells = {40, 20}};
  const std::vector<Shape> shapes{WaferShape{}, tetrahedron({19, 9, -1}, 5)};
  EXPECT_TRUE(check_shapes(frame, shapes).empty());
}

// Half a trench, a quarter of a hole: mirrored at the sides they are whole.
TEST(Shapes, MayFillMostOfTheDomainFromAReflectiveSide) {
  Frame frame{.spacing = 1, .cells = {40, 20}};
  HoleShape quarter{.radius = 15, .centre = {-20, -10}};
  quarter.cut.depth = 5;
  const std::vector<Shape> half_trench{WaferShape{}, trench(60, 5, 0, -20)};
  const std::vector<Shape> quarter_hole{WaferShape{}, quarter};
  EXPECT_TRUE(check_shapes(frame, half_trench).empty());
  EXPECT_TRUE(check_shapes(frame, quarter_hole).empty());
  frame.boundary = {Boundary::periodic, Boundary::periodic};
  EXPECT_FALSE(check_shapes(frame, half_trench).empty());
  EXPECT_FALSE(check_shapes(frame, quarter_hole).empty());
}

// Sides cut off what is beyond them: what is in the domain are two straight walls.
TEST(Shapes, ARectangleFromSideToSideIsASlot) {
  Frame frame{.spacing = 1, .cells = {40, 30}};
  const auto built = [&](const Outline& outline, double taper, bool is_opening) {
    const std::vector<Shape> shapes{WaferShape{}, mask(outline, taper, is_opening)};
    EXPECT_TRUE(check_shapes(frame, shapes).empty()) << check_shapes(frame, shapes)[0].message;
    return hash(build_layers(frame, shapes));
  };
  for (const bool is_periodic : {false, true}) {
    if (is_periodic) frame.boundary = {Boundary::periodic, Boundary::periodic};
    for (const bool is_opening : {false, true}) {
      const SlotOutline along_y{.width = 12, .centre = 3};
      const SlotOutline along_x{.width = 12, .centre = 3, .along = 0};
      EXPECT_EQ(built(RectangleOutline{.size = {12, 30}, .centre = {3, 0}}, 0, is_opening),
                built(along_y, 0, is_opening));
      EXPECT_EQ(built(RectangleOutline{.size = {44, 12}, .centre = {1, 3}, .corner_radius = 1}, 0,
                      is_opening),
                built(along_x, 0, is_opening));
      EXPECT_EQ(built(RectangleOutline{.size = {12, 36}, .centre = {3, 0}}, 0.3, is_opening),
                built(along_y, 0.3, is_opening));
      const Repeat in_x{.count = {2, 1}, .pitch = {20, 0}};
      EXPECT_EQ(built(RectangleOutline{.size = {9, 30}, .repeat = in_x}, 0, is_opening),
                built(SlotOutline{.width = 9, .repeat = in_x}, 0, is_opening));
    }
  }
}

TEST(Shapes, ARectangleFillsASectionAlongY) {
  Frame frame{.spacing = 1, .cells = {40, 1}};
  frame.two_dimensional = true;
  const std::vector<Shape> rectangle{WaferShape{}, mask(RectangleOutline{.size = {12, 20}}, 0.2)};
  const std::vector<Shape> slot{WaferShape{}, mask(SlotOutline{.width = 12}, 0.2)};
  ASSERT_TRUE(check_shapes(frame, rectangle).empty());
  EXPECT_EQ(hash(build_layers(frame, rectangle)), hash(build_layers(frame, slot)));
}

Shape stack(int count) {
  return StackShape{.layers = {{.material = 1, .thickness = 3}, {.material = 2, .thickness = 3}},
                    .count = count};
}

INSTANTIATE_TEST_SUITE_P(
    All, BadShapes,
    testing::Values(
        BadShape{trench(41, 5), "geometry[1].width: 41 nm is not narrower than the domain (40 nm)"},
        BadShape{trench(1.5, 5), "geometry[1].width: 1.5 nm is thinner than two grid spacings"},
        BadShape{trench(81, 5, 0, -20), "geometry[1].width: 81 nm is not narrower"},
        BadShape{round_hole(0.5),
                 "geometry[1].radius: a diameter of 1 nm is thinner than two grid"},
        BadShape{round_hole(15), "geometry[1].radius: a diameter of 30 nm is not narrower"},
        BadShape{trench(10, 0), "geometry[1].depth: must be a length above 0"},
        BadShape{trench(std::nan(""), 5), "geometry[1].width: must be"},
        BadShape{trench(10, 5, 0, 30), "geometry[1].center: must lie in the domain"},
        BadShape{trench(10, 20, 0.3), "geometry[1].taper: leaves a floor"},
        BadShape{trench(39, 5), "geometry[1].width: leaves 1 nm to its image"},
        BadShape{WaferShape{}, "geometry[1].shape: a wafer can only be the first"},
        BadShape{stack(101), "geometry[1].count: makes 202 layers with those below; at most 200"},
        BadShape{stack(1'000'000'000), "geometry[1].count: makes 2000000000 layers"},
        BadShape{LayerShape{.material = 1, .thickness = 1e300},
                 "geometry[1].thickness: makes the geometry more than 1e15 grid spacings high"},
        BadShape{trench(10, 1e7), "geometry[1].depth: makes the geometry 10000000 grid spacings"},
        BadShape{polygon({{-50, -50}, {50, -50}, {50, 50}, {-50, 50}}),
                 "geometry[1].opening.points: covers the whole domain and leaves nothing"},
        BadShape{LayerShape{.material = 1, .thickness = -1}, "geometry[1].thickness: must be"},
        BadShape{trench(10, 15, -0.9), "geometry[1].width: 47.8"},
        BadShape{rounded(6, 0), "geometry[1].bottom_radius: must lie between 0 nm and 5 nm"},
        BadShape{rounded(0, 9), "geometry[1].top_radius: must lie between 0 nm and 8 nm"},
        BadShape{row(4, 11), "geometry[1].pitch: leaves 1 nm between copies"},
        BadShape{row(5, 15), "geometry[1].repeat: puts the centre of a copy outside"},
        BadShape{row(0, 15), "geometry[1].repeat: must be 1 or more"},
        BadShape{polygon({{-5, -5}, {5, 5}, {5, -5}, {-5, 5}}),
                 "geometry[1].opening.points: edge 0 and edge 2 cross or touch"},
        BadShape{polygon({{25, -5}, {35, -5}, {35, 5}}),
                 "geometry[1].opening.points: lies wholly outside the domain"},
        BadShape{
            polygon({{-5, 0}, {5, 0}, {5, 1}, {-5, 1}}),
            "geometry[1].opening.points: walls at (-5, 0) nm are 1 nm apart; let shapes overlap, "},
        BadShape{polygon({{-5, -2}, {5, -2}, {5, 2}, {-5, 2}}, -0.5),
                 "geometry[1].taper: makes the walls of the polygon meet"},
        BadShape{mask(SlotOutline{.width = 9}, -0.6), "geometry[1].taper: leaves 0.790"},
        BadShape{mask(SlotOutline{.width = 9}, 0.6, false), "geometry[1].taper: leaves 0.790"},
        BadShape{mask(CircleOutline{.radius = 4.5}, 0.6, false), "geometry[1].taper: leaves 0.790"},
        BadShape{mask(RectangleOutline{.size = {20, 9}}, 0.6, false),
                 "geometry[1].taper: leaves 0.790"},
        BadShape{mask(RectangleOutline{.size = {20, 9}}, 1, false),
                 "geometry[1].taper: leaves 0 nm of the resist at the top of the mask: less"},
        BadShape{mask(RectangleOutline{.size = {10, 20}, .corner_radius = 3}, 0),
                 "geometry[1].opening.size: 20 nm reaches from side to side of the domain, but not "
                 "its corners; write 26 nm or more, or shape = \"trench\""},
        BadShape{mask(RectangleOutline{.size = {10, 20}}, -0.25),
                 "geometry[1].opening.size: 20 nm reaches from side to side of the domain, but not "
                 "its tapered ends; write 23."},
        BadShape{mask(RectangleOutline{.size = {40, 20}}, 0),
                 "geometry[1].opening.size: covers the whole domain and leaves nothing"},
        BadShape{mask(SlotOutline{.width = 6, .repeat = {.count = {3, 1}, .pitch = {13, 0}}}, 0.6),
                 "geometry[1].opening.pitch: leaves -1.2"},
        BadShape{
            mask(CircleOutline{.radius = 3, .repeat = {.count = {3, 1}, .pitch = {13, 0}}}, 0.6),
            "geometry[1].opening.pitch: leaves -1.2"},
        BadShape{
            mask(RectangleOutline{.size = {6, 6}, .repeat = {.count = {1, 2}, .pitch = {0, 13}}},
                 -0.6, false),
            "geometry[1].resist.pitch: leaves -1.2"},
        BadShape{MeshShape{.mesh = std::make_shared<TriMesh>()},
                 "geometry[1].file: has no triangle"},
        BadShape{tetrahedron({25, 0, 0}, 5),
                 "geometry[1].file: lies wholly outside the domain, which reaches from (-20 nm, "},
        BadShape{tetrahedron({0, 0, 0}, 1.5),
                 "geometry[1].file: has a body around (0.75 nm, 0.75 nm, 0.75 nm) that is 0."},
        BadShape{MaskShape{.material = 1, .thickness = 5, .outline = SlotOutline{.width = 50}},
                 "geometry[1].opening.width: 50 nm is not narrower"}));

}  // namespace
}  // namespace scarp
