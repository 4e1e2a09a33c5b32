#include "levelset/motion/advect.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "core/recipe/quantity.h"
#include "levelset/grid/band.h"
#include "levelset/surface/extract_surface.h"
#include "tests/levelset/speeds.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

class Plane : public testing::TestWithParam<Scheme> {};

TEST_P(Plane, MovesByRateTimesTime) {
  const Frame frame{.spacing = 2, .cells = {20, 12}};
  for (const double speed : {1.5, -1.5}) {
    Layers layers = single_layer(
        frame, [](Vec3d r) { return r.z - 0.31; }, -8, 8);
    move(
        layers, 20, 0.5, [&](Vec3d, MaterialId) { return speed; }, GetParam());
    for (const Vec3f& v : extract_surface(layers).vertices) {
      ASSERT_NEAR(v.z, 0.31 + speed * 20, 1e-3 * frame.spacing);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Schemes, Plane,
                         testing::Values(Scheme::first_order, Scheme::eno2, Scheme::weno5));

/// Mean error of the radius, in nm, of a sphere of 10 nm that grows to 14 nm or shrinks to 6 nm.
/// A quarter of it, mirrored at two sides.
double sphere_error(double spacing, double speed) {
  const int cells = static_cast<int>(std::lround(18 / spacing));
  const Frame frame{.spacing = spacing, .cells = {cells, cells}};
  const Vec3d centre{-9, -9, 0};
  Layers layers = single_layer(
      frame, [&](Vec3d r) { return length(r - centre) - 10; }, -10, 10);
  move(layers, 4, 0.4 * spacing, [&](Vec3d, MaterialId) { return speed; });
  const TriMesh mesh = extract_surface(layers);
  double error = 0;
  for (const Vec3f& v : mesh.vertices) {
    error += std::abs(length(Vec3d(v) - centre) - (10 + 4 * speed));
  }
  return error / static_cast<double>(mesh.vertices.size());
}

TEST(Sphere, ConvergesAtSecondOrder) {
  for (const double speed : {1.0, -1.0}) {
    const double coarse = sphere_error(1.0, speed);
    const double middle = sphere_error(0.5, speed);
    const double fine = sphere_error(0.25, speed);
    EXPECT_LT(coarse, 0.05);
    EXPECT_GT(std::log2(coarse / middle), 1.6);
    EXPECT_GT(std::log2(middle / fine), 1.6);
  }
}

TEST(Advect, RefusesSpeedsThatAreNotFinite) {
  const Frame frame{.spacing = 1, .cells = {8, 8}};
  Layers layers = single_layer(
      frame, [](Vec3d r) { return r.z - 0.3; }, -8, 8);
  SpeedField field = prescribe_speeds(layers, [](Vec3d, MaterialId) { return 1.0; });
  const std::size_t leaf = layers.top().band().leaves().size() - 1;
  field.speed[leaf * leaf_size + 100] = std::numeric_limits<float>::quiet_NaN();
  const Vec3d place = frame.node_position(node_at(layers.top().band().leaves()[leaf], 100));
  EXPECT_THAT([&] { advect(layers, field, 0.1); },
              testing::ThrowsMessage<NumericalError>(
                  testing::HasSubstr("not finite at " + rounded_place(place) + " nm")));
}

// What find gives at every place around the band, and the neighbours of all leaves.
std::vector<int> topology(const Band& band) {
  std::vector<int> found;
  for (int x = -1; x <= band.column_count(0); ++x) {
    for (int y = -1; y <= band.column_count(1); ++y) {
      for (int z = -6; z <= 6; ++z) found.push_back(band.find(x, y, z));
    }
  }
  for (std::size_t n = 0; n < band.leaves().size(); ++n) {
    found.insert(found.end(), band.neighbours(n).begin(), band.neighbours(n).end());
  }
  return found;
}

TEST(Advect, ABandThatFollowedTheSurfaceIsTheOneReadAnew) {
  const Frame frame{
      .spacing = 1, .cells = {37, 24}, .boundary = {Boundary::reflective, Boundary::periodic}};
  for (const double speed : {1.0, -1.0}) {
    // A ball over a plane: bands that part, meet and leave leaves behind.
    Layers layers = single_layer(
        frame,
        [](Vec3d r) {
          return std::min(length(r - Vec3d{3, 0, 1}) - 7, r.z + 14.3);
        },
        -16, 9);
    const std::vector<int> before = topology(layers.top().band());
    move(layers, 9, 0.5, [&](Vec3d, MaterialId) { return speed; });
    const LevelSet anew = layers.top().copy();
    EXPECT_NE(topology(layers.top().band()), before);
    EXPECT_EQ(topology(layers.top().band()), topology(anew.band()));
    EXPECT_EQ(layers.top().hash(), anew.hash());
  }
}

// The sign of what is missing is that of the lowest nodes of the next leaf above.
TEST(Advect, WhatIsMissingInTheBandIsSolidBelowAndGasAbove) {
  const Frame frame{.spacing = 1, .cells = {16, 16}};
  const Layers layers = single_layer(
      frame, [](Vec3d r) { return std::abs(r.z - 0.3) - 20; }, -30, 30);
  const Band& band = layers.top().band();
  EXPECT_EQ(band.find(0, 0, -9), Band::missing_gas);
  EXPECT_GE(band.find(0, 0, -3), 0);
  EXPECT_EQ(band.find(0, 0, 0), Band::missing_solid);
  EXPECT_GE(band.find(0, 0, 2), 0);
  EXPECT_EQ(band.find(0, 0, 9), Band::missing_gas);
  EXPECT_EQ(band.find(3, 0, 0), Band::missing_gas);
}

}  // namespace
}  // namespace scarp
