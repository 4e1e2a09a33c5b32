#include "levelset/grid/exposure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/motion/extend.h"
#include "levelset/operations/layer_steps.h"
#include "levelset/surface/extract_surface.h"
#include "tests/levelset/speeds.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

TEST(SpeedThroughLayers, SpendsTheTimeLayerByLayer) {
  // 0.3 at speed 0.1 takes 3 s, then 0.2 at speed 2 takes 0.1 s, then speed 1.
  const std::vector<float> speeds{-1, -2, -0.1F};
  const std::vector<float> depth{0.5F, 0.3F, 0};
  EXPECT_FLOAT_EQ(speed_through_layers(speeds, depth, 2, 2), -0.1F);
  EXPECT_FLOAT_EQ(speed_through_layers(speeds, depth, 2, 3.05F), -0.4F / 3.05F);
  EXPECT_FLOAT_EQ(speed_through_layers(speeds, depth, 2, 4.1F), -1.5F / 4.1F);
  // A layer that is not there takes no time, though it does not etch, or grows.
  EXPECT_FLOAT_EQ(speed_through_layers({-1, 0, -0.1F}, {0.3F, 0.3F, 0}, 2, 4), -1.3F / 4);
  EXPECT_FLOAT_EQ(speed_through_layers({-1, 2, -0.1F}, {0.3F, 0.3F, 0}, 2, 4), -1.3F / 4);
  // Also below several films, whose depths need not add up to the last bit.
  for (int n = 1; n < 100; ++n) {
    const float first = 0.0137F * static_cast<float>(n);
    const float second = first + 0.9F + 0.113F * static_cast<float>(n % 7);
    const std::vector<float> depths{second, second, first, 0};
    EXPECT_NEAR(speed_through_layers({-1, 0, -1, -1}, depths, 3, 8), -1, 1e-6) << n;
  }
  // A layer that does not etch stops the surface.
  EXPECT_FLOAT_EQ(speed_through_layers({0, -2}, {0.5F, 0}, 1, 1), -0.5F);
  EXPECT_FLOAT_EQ(speed_through_layers({-1, 2}, {0.5F, 0}, 1, 1), 2);
}

/// A trench through a stack on a wafer, and a conformal film on all of it.
Layers coated_trench(double film) {
  const Frame frame{.spacing = 2, .cells = {40, 8}};
  Layers layers =
      build_layers(frame, std::vector<Shape>{WaferShape{.material = 0},
                                             LayerShape{.material = 1, .thickness = 9},
                                             LayerShape{.material = 2, .thickness = 9},
                                             TrenchShape{.width = 30, .cut = {.depth = 25}}});
  if (film > 0) {
    add_layer(layers, 3);
    coat(layers, film);
  }
  return layers;
}

// What a wall shows of a stack is no film, whatever is left of a layer next to its lower border.
TEST(ThinnestFilm, IsThatOfWhatLiesAlongTheSurface) {
  EXPECT_EQ(thinnest_film(coated_trench(0), 0.5F), std::numeric_limits<double>::infinity());
  for (const double film : {1.3, 2.2, 3.7})
    EXPECT_NEAR(thinnest_film(coated_trench(film), 0.5F), film, 0.1);
  EXPECT_EQ(thinnest_film(coated_trench(0.4), 0.5F), 1);
  // Nor is the foot of a mask whose opening was etched on straight down.
  for (const double wall : {10.0, 10.6, 11.4}) {
    const Layers etched = build_layers(
        {.spacing = 2, .cells = {40, 8}},
        std::vector<Shape>{WaferShape{.material = 0}, LayerShape{.material = 1, .thickness = 12},
                           TrenchShape{.width = 2 * wall, .cut = {.depth = 30}}});
    EXPECT_EQ(thinnest_film(etched, 0.5F), std::numeric_limits<double>::infinity()) << wall;
  }
  // Thicker than the band can tell, and of no concern.
  EXPECT_EQ(thinnest_film(coated_trench(7.5), 0.5F), std::numeric_limits<double>::infinity());
}

/// Etches a stack with speeds by material through the whole loop of mesh and extension.
void etch(Layers& layers, double time, const std::vector<float>& speed_of_material) {
  for (double t = 0; t < time * (1 - 1e-9);) {
    const OpenGas gas = open_gas(layers);
    const TriMesh mesh = extract_surface(layers, gas);
    std::vector<CornerSpeeds> speeds;
    for (const Layer& layer : layers.stack) {
      const float v = speed_of_material[layer.material];
      speeds.emplace_back(mesh.triangles.size(), std::array<float, 3>{v, v, v});
    }
    const double dt = std::min(stable_time_step(layers, speeds, 0.5), time - t);
    advect(layers, extend_speeds(layers, gas, mesh, speeds, dt), dt);
    remove_empty_layers(layers);
    t += dt;
  }
}

TEST(ThinFilm, DelaysTheEtchByTheExactTime) {
  for (const double thickness : {0.3, 0.05, 1.7}) {
    const Frame frame{.spacing = 1, .cells = {12, 12}};
    Layers layers =
        build_layers(frame, std::vector<Shape>{WaferShape{.material = 0},
                                               LayerShape{.material = 1, .thickness = thickness}});
    // The film takes thickness / 0.1 s; after it the wafer recedes at 1 nm/s.
    etch(layers, thickness / 0.1 + 6, {-1, -0.1F});
    for (const Vec3f& v : extract_surface(layers).vertices) {
      EXPECT_NEAR(v.z, -6, 0.02 * thickness / 0.1 + 1e-3) << thickness;
    }
    EXPECT_EQ(layers.stack.size(), 1U);
    EXPECT_EQ(layers.stack[0].material, 0);
  }
}

TEST(ThinFilm, TenFilmsTakeTheSumOfTheirTimes) {
  const Frame frame{.spacing = 1, .cells = {12, 12}};
  std::vector<Shape> shapes{WaferShape{.material = 0}};
  for (int n = 0; n < 10; ++n) {
    shapes.push_back(LayerShape{.material = static_cast<MaterialId>(1 + n % 2), .thickness = 0.2});
  }
  Layers layers = build_layers(frame, shapes);
  ASSERT_EQ(layers.stack.size(), 11U);
  // 5 films at 0.1 nm/s and 5 at 1 nm/s: 10 s + 1 s.
  etch(layers, 11 + 3, {-1, -0.1F, -1});
  for (const Vec3f& v : extract_surface(layers).vertices) {
    EXPECT_NEAR(v.z, -3, 0.02 * 11);
  }
}

/// Where the floor of an opening of a mask lies once a film over all of it is through, for 6 s.
double floor_of_covered_opening(float rate_of_mask) {
  const Frame frame{.spacing = 1, .cells = {48, 8}};
  const SlotOutline slot{.width = 24};
  Layers layers = build_layers(
      frame, std::vector<Shape>{WaferShape{.material = 0},
                                MaskShape{.material = 1, .thickness = 6, .outline = slot}});
  add_layer(layers, 2);
  const double thickness = 1.37;
  move(layers, thickness, 0.5, [](Vec3d, MaterialId) { return 1.0; });
  etch(layers, thickness / 0.1 + 6, {-1, rate_of_mask, -0.1F});
  return -6 - layers.top().distance({0, 0, -6});
}

TEST(ThinFilm, OverAnOpeningDelaysTheEtchByTheExactTimeThoughTheMaskStandsStill) {
  const double still = floor_of_covered_opening(0);
  EXPECT_NEAR(still, -6, 0.02 * 13.7);
  EXPECT_NEAR(still, floor_of_covered_opening(-1e-6F), 1e-4);
}

// Once what is below is gone the mask's lower edge is etched from two sides; where in its cell it
// was is not known.
TEST(Etch, LeavesTheLowerEdgeOfAnEtchedMaskToAboutASpacing) {
  for (const double offset : {0.0, 0.3, 0.6, 0.9}) {
    Layers layers = build_layers(
        Frame{.spacing = 1, .cells = {48, 8}},
        std::vector<Shape>{WaferShape{.material = 0},
                           MaskShape{.material = 1,
                                     .thickness = 6,
                                     .outline = SlotOutline{.width = 2 * (12 + offset)}}});
    etch(layers, 6, {-1, -1e-3F});
    double nearest = std::numeric_limits<double>::max();
    for (const Vec3f& v : extract_surface(layers).vertices) {
      nearest = std::min(nearest, std::hypot(v.x - 12 - offset, static_cast<double>(v.z)));
    }
    EXPECT_LT(nearest, 1.1) << offset;
  }
}

TEST(Etch, StopsOnALayerThatDoesNotEtchAndLeavesTheRest) {
  const Frame frame{.spacing = 1, .cells = {40, 8}};
  Layers layers = build_layers(
      frame, std::vector<Shape>{
                 WaferShape{.material = 0}, LayerShape{.material = 1, .thickness = 6.3},
                 MaskShape{.material = 2, .thickness = 4, .outline = SlotOutline{.width = 16.6}}});
  etch(layers, 9, {0, -1, 0});
  // 6.3 deep at the bottom, undercut 9 under the mask's foot.
  EXPECT_NEAR(layers.top().distance({0, 0, 0}), 0, 0.02);
  EXPECT_NEAR(layers.top().distance({8.3 + 9, 0, 5.3}), 0, 0.5);
  EXPECT_EQ(layers.stack.size(), 3U);
}

}  // namespace
}  // namespace scarp
