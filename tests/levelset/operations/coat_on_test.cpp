#include "levelset/operations/coat_on.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/parallel.h"
#include "levelset/grid/band.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/operations/chosen_surface.h"
#include "levelset/operations/fill.h"
#include "levelset/operations/layer_steps.h"
#include "levelset/operations/placed_shapes.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/extract_surface.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

using std::numbers::pi;

constexpr MaterialId si = 0;
constexpr MaterialId oxide = 1;
constexpr MaterialId poly = 2;
constexpr MaterialId metal = 3;

// Spacings are 1 nm.
Frame section(int cells, double spacing = 1) {
  Frame frame{.spacing = spacing, .cells = {cells, 1}};
  frame.two_dimensional = true;
  return frame;
}

Shape trench(double width, double depth, double centre = 0) {
  TrenchShape shape{.width = width, .centre = centre};
  shape.cut.depth = depth;
  return shape;
}

Shape hole(double radius, double depth, std::array<double, 2> centre = {}) {
  HoleShape shape{.radius = radius, .centre = centre};
  shape.cut.depth = depth;
  return shape;
}

Shape layer(MaterialId material, double thickness) {
  return LayerShape{.material = material, .thickness = thickness};
}

const Shape wafer = WaferShape{.material = si};

Layers coated(const Frame& frame, const std::vector<Shape>& shapes, double thickness,
              const std::vector<MaterialId>& on) {
  Layers layers = build_layers(frame, shapes);
  add_layer(layers, metal);
  coat_on(layers, thickness, on);
  return layers;
}

double volume(const Layers& layers, MaterialId material) {
  const std::vector<double> of_layers = material_volumes(layers);
  double sum = 0;
  for (std::size_t n = 0; n < of_layers.size(); ++n)
    if (layers.stack[n].material == material) sum += of_layers[n];
  return sum;
}

// The height above another one at which the gas begins.
double gas_above(const Layers& layers, double x, double z) {
  const double step = 1.0 / 64;
  while (layers.top().distance({x, 0, z}) < 0) z += step;
  return z;
}

// Over the rim of the oxide the film grows sideways as far as it stands above it, on the way along
// the wall.
double area_in_trench(double width, double depth, double film) {
  const double over = std::max(0.0, film - depth);
  return width * film + 0.5 * pi * over * over;
}

TEST(CoatOn, FilmsOfAnyThicknessFillTheirTrench) {
  struct Case {
    double width;
    double depth;
    double film;
  };
  // Deep and shallow trenches: films from a spacing up to 50.
  std::vector<Case> cases;
  for (const double film : {1.0, 2.0, 3.5, 5.0, 8.0, 9.0, 10.0, 12.0, 15.0, 20.0, 25.0, 30.0, 50.0})
    for (const double depth : {10.0, 40.0, 50.0}) cases.push_back({100.4, depth, film});
  for (const double film : {4.0, 12.0, 22.0}) cases.push_back({15, 20, film});
  for (const auto& [width, depth, film] : cases) {
    const Layers layers =
        coated(section(240), {wafer, layer(oxide, depth), trench(width, depth)}, film, {si});
    const double expected = area_in_trench(width, depth, film);
    // A third of a spacing on the two arcs over the rim.
    const double arcs = pi * std::max(0.0, film - depth);
    EXPECT_NEAR(volume(layers, metal), expected, 0.7 + arcs / 3)
        << width << ' ' << depth << ' ' << film;
    // Nothing of it holds a void.
    EXPECT_TRUE(open_gas(layers).voids.empty()) << width << ' ' << depth << ' ' << film;
  }
}

TEST(CoatOn, MeetsAWallOfAnotherMaterialAtItsOwnThickness) {
  // On nodes next to the wall, which is at 10.3.
  const double x = 9;
  const double beside = 1.3;
  for (const double film : {1.0, 3.0, 6.0})
    for (int part = 0; part < 10; ++part) {
      const double lift = 2 + 0.1 * part;
      std::vector<Shape> shapes{wafer, layer(poly, lift), layer(oxide, 12), trench(20.6, 12)};
      const Layers floor = coated(section(60), shapes, film, {poly});
      EXPECT_NEAR(gas_above(floor, x, lift + 0.5), lift + film, 0.05) << film << ' ' << lift;
      if (film <= beside) continue;
      // On a wall that goes on below the border.
      shapes.back() = trench(20.6, 30);
      const double over = std::sqrt(film * film - beside * beside);
      const Layers wall = coated(section(60), shapes, film, {si});
      EXPECT_NEAR(gas_above(wall, x, -1), over, 0.15) << film << ' ' << lift;
      const Layers between = coated(section(60), shapes, film, {poly});
      EXPECT_NEAR(gas_above(between, x, 1), lift + over, 0.15) << film << ' ' << lift;
      EXPECT_NEAR(volume(between, metal), 2 * (lift * film + 0.5 * pi * film * film), 0.8)
          << film << ' ' << lift;
    }
}

// As after a polish: the border lies on a flat surface.
TEST(CoatOn, EndsBesideAFlushBorder) {
  for (const double shift : {0.0, 0.3, 0.5, 0.8}) {
    Layers layers = build_layers(
        section(80), std::vector<Shape>{wafer, layer(oxide, 12), trench(20.6, 9, shift)});
    add_layer(layers, poly);
    fill(layers, 12);
    add_layer(layers, metal);
    const double film = 6;
    coat_on(layers, film, std::vector<MaterialId>{poly});
    EXPECT_NEAR(volume(layers, metal), 20.6 * film + 0.5 * pi * film * film, 1) << shift;
  }
}

TEST(CoatOn, CoversAPadAndItsWalls) {
  for (const double film : {1.0, 5.3, 12.0, 20.0}) {
    Layers pad = build_layers(section(120), std::vector<Shape>{wafer});
    MaskShape island{.material = oxide, .thickness = 4, .outlines = MaskShape::Outlines::resist};
    island.outline = SlotOutline{.width = 20};
    place_shapes(pad, std::vector<Shape>{island});
    add_layer(pad, metal);
    coat_on(pad, film, std::vector<MaterialId>{oxide});
    const double beside = 2 * (pi * film * film / 4 + 4 * film);
    EXPECT_NEAR(volume(pad, metal), 20 * film + beside, 0.5 + 0.15 * film) << film;
  }
}

TEST(CoatOn, AHoleInSpaceAndAroundAnAxis) {
  const double radius = 12;
  for (const double film : {3.0, 8.0, 15.0}) {
    const std::vector<Shape> shapes{wafer, layer(oxide, 10), hole(radius, 10)};
    const double over = std::max(0.0, film - 10);
    const double expected = pi * radius * radius * film +
                            0.5 * pi * pi * over * over * (radius + 4 * over / (3 * pi));  // Pappus
    const double arc = pi * pi * over * (radius + 2 * over / pi);
    const Layers space = coated({.spacing = 1, .cells = {44, 44}}, shapes, film, {si});
    EXPECT_NEAR(volume(space, metal), expected, 0.005 * expected + arc / 3) << film;
    Frame axis = section(44);
    axis.axisymmetric = true;
    EXPECT_NEAR(volume(coated(axis, shapes, film, {si}), metal), expected,
                0.005 * expected + arc / 3)
        << film;
  }
}

TEST(CoatOn, GrowsThroughTheGasAlone) {
  // Silicon in the left trench, poly in the right one, and three spacings of oxide between.
  const double width = 20.4;
  const double depth = 30;
  std::vector<Shape> shapes{wafer, layer(poly, 2), layer(oxide, depth - 2), trench(width, depth, 0),
                            trench(30, depth - 2, 0.5 * width + 3 + 15)};
  for (const double film : {5.0, 12.0, 25.0})
    EXPECT_NEAR(volume(coated(section(160), shapes, film, {si}), metal), width * film, 0.5) << film;
  // Over the wall between, and around its other edge.
  const double film = depth + 8;
  EXPECT_NEAR(volume(coated(section(160), shapes, film, {si}), metal),
              width * film + 0.5 * pi * 8 * 8 + 0.25 * pi * 5 * 5,
              (pi * 8 + 2 * 0.5 * pi * 5) / 3 + 2);
}

TEST(CoatOn, LeavesClosedVoidsAlone) {
  Layers layers = build_layers(
      section(60),
      std::vector<Shape>{wafer, layer(oxide, 12), trench(6.4, 12, -14), trench(12.4, 12, 10)});
  add_layer(layers, poly);
  coat(layers, 2);
  add_layer(layers, oxide);
  coat(layers, 1.5);  // shuts the narrow one
  const std::vector<Region> before = open_gas(layers).voids;
  add_layer(layers, metal);
  coat_on(layers, 9, std::vector<MaterialId>{oxide});
  const std::vector<Region> after = open_gas(layers).voids;
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t n = 0; n < before.size(); ++n) EXPECT_EQ(after[n].volume, before[n].volume);
}

TEST(CoatOn, WhatIsBuriedGrowsNothing) {
  const Layers before = build_layers(section(40), std::vector<Shape>{wafer, layer(oxide, 5)});
  const Layers after = coated(section(40), {wafer, layer(oxide, 5)}, 4, {si});
  EXPECT_EQ(after.top().hash(), before.top().hash());
}

// The nodes of one and the mirror images of those of the other.
double farthest_apart(const Layers& one, const Layers& other) {
  const Frame& frame = one.frame;
  double most = 0;
  for (const Leaf& leaf : one.top().band().leaves())
    for (int offset = 0; offset < leaf_size; ++offset) {
      const Node node = node_at(leaf, offset);
      if (node[0] > frame.cells[0] || node[1] > frame.cells[1]) continue;
      const float image = other.top().node(frame.cells[0] - node[0], node[1], node[2]);
      most = std::max(most, std::abs(double{leaf.phi[offset]} - double{image}));
    }
  return most;
}

TEST(CoatOn, OfAMirroredWaferIsTheMirrorImage) {
  for (const Boundary boundary : {Boundary::reflective, Boundary::periodic})
    for (const double film : {2.0, 9.5, 21.0}) {
      const auto set_up = [&](double side) {
        Frame frame = section(48);
        frame.boundary[0] = boundary;
        return coated(frame,
                      {wafer, layer(poly, 3.3), layer(oxide, 12), trench(15.4, 20, side * 8.3),
                       trench(9.2, 13, side * -9.6)},
                      film, {poly});
      };
      EXPECT_EQ(farthest_apart(set_up(1), set_up(-1)), 0) << film;
    }
  // Triangles in space are no mirror images.
  const auto in_space = [](double side) {
    return coated({.spacing = 1, .cells = {28, 26}},
                  {wafer, layer(poly, 3.3), layer(oxide, 8), hole(7.3, 16, {side * 3.2, -2.1})}, 5,
                  {poly});
  };
  EXPECT_LT(farthest_apart(in_space(1), in_space(-1)), 1e-5);
}

TEST(CoatOn, IsTheSameOnAnyNumberOfThreads) {
  const auto make = [] {
    return hash(coated({.spacing = 1, .cells = {24, 22}},
                       {wafer, layer(oxide, 4), hole(5, 4, {3, 1})}, 6, {si}));
  };
  const std::uint64_t alone = [&] {
    const ThreadLimit one(1);
    return make();
  }();
  const ThreadLimit four(4);
  EXPECT_EQ(make(), alone);
}

double area(const TriMesh& mesh) {
  double sum = 0;
  for (const double each : facet_areas(mesh)) sum += each;
  return sum;
}

TEST(ChosenSurface, EndsWhereAnotherMaterialBegins) {
  for (int part = 0; part < 10; ++part) {
    const double lift = 0.1 * part;
    const std::vector<Shape> shapes{wafer, layer(poly, 3 + lift), layer(oxide, 9),
                                    trench(20.6, 20 + lift)};
    const Layers layers = build_layers(section(40), shapes);
    const auto of = [&](const std::vector<MaterialId>& materials) {
      return area(chosen_surface(layers, open_gas(layers), materials));
    };
    EXPECT_NEAR(of({poly}), 2 * (3 + lift), 0.2) << lift;
    EXPECT_NEAR(of({si}), 20.6 + 2 * 8, 0.5) << lift;
    EXPECT_NEAR(of({oxide}), 40 - 20.6 + 2 * 9, 0.5) << lift;
    // Between two that are both chosen nothing is missing.
    EXPECT_NEAR(of({si, poly}), of({si}) + of({poly}), 0.1) << lift;
    EXPECT_NEAR(of({si, poly, oxide}), area(extract_surface(layers)), 1e-6) << lift;
  }
}

TEST(ChosenSurface, KnowsThinFilmsFromWhatLiesBelow) {
  for (const double film : {0.3, 1.0, 1.4}) {
    Layers layers = build_layers(section(60), std::vector<Shape>{wafer});
    MaskShape pad{.material = oxide, .thickness = 4, .outlines = MaskShape::Outlines::resist};
    pad.outline = SlotOutline{.width = 20};
    place_shapes(layers, std::vector<Shape>{pad});
    planarise(layers, film);
    const auto of = [&](MaterialId material) {
      return area(chosen_surface(layers, open_gas(layers), std::vector<MaterialId>{material}));
    };
    EXPECT_NEAR(of(si), 40, 2) << film;
    EXPECT_NEAR(of(oxide), 20 + 2 * film, 2.5) << film;
  }
}

}  // namespace
}  // namespace scarp
