#include "levelset/connectivity.h"

#include <gtest/gtest.h>

#include <numbers>

#include "surfaces.h"

namespace scarp {
namespace {

double box(Vec3d r, Vec3d centre, Vec3d half) {
  const Vec3d d{std::abs(r.x - centre.x) - half.x, std::abs(r.y - centre.y) - half.y,
                std::abs(r.z - centre.z) - half.z};
  const double outside = length(Vec3d{std::max(d.x, 0.0), std::max(d.y, 0.0), std::max(d.z, 0.0)});
  return outside + std::min(std::max({d.x, d.y, d.z}), 0.0);
}

TEST(OpenGas, ABubbleIsAVoidWithItsVolumeAndHeights) {
  const Frame frame{.spacing = 0.5, .cells = {60, 60}};
  const Layers layers = single_layer(
      frame,
      [](Vec3d r) {
        return std::max(r.z - 0.2, 8.3 - length(r - Vec3d{1, 2, -12}));
      },
      -24, 4);
  const OpenGas gas = open_gas(layers);
  ASSERT_EQ(gas.voids.size(), 1U);
  const double exact = 4.0 / 3 * std::numbers::pi * 8.3 * 8.3 * 8.3;
  EXPECT_NEAR(gas.voids[0].volume, exact, 0.01 * exact);
  EXPECT_NEAR(gas.voids[0].lower, -20.3, 0.5);
  EXPECT_NEAR(gas.voids[0].upper, -3.7, 0.5);
}

TEST(OpenGas, AChannelOneNodeWideOpensACavityManyLeavesLarge) {
  const Frame frame{.spacing = 1, .cells = {64, 40}};
  for (const double channel : {0.6, 0.4}) {
    // The channel is centred between nodes when it is narrow, so no node lies in it.
    const double x = channel > 0.5 ? 3 : 3.5;
    const Layers layers = single_layer(
        frame,
        [&](Vec3d r) {
          const double cavity = box(r, {0, 0, -40}, {25.3, 15.3, 20.3});
          const double neck = box(r, {x, 0, 0}, {channel, channel, 30});
          return std::max(r.z - 0.2, -std::min(cavity, neck));
        },
        -70, 10);
    const OpenGas gas = open_gas(layers);
    EXPECT_EQ(gas.voids.size(), channel > 0.5 ? 0U : 1U);
    if (!gas.voids.empty()) {
      EXPECT_NEAR(gas.voids[0].volume, 51 * 31 * 41, 1);
    }
  }
}

TEST(OpenGas, PeriodicSidesJoinWhatReflectiveOnesPart) {
  for (const Boundary boundary : {Boundary::reflective, Boundary::periodic}) {
    const Frame frame{
        .spacing = 1, .cells = {40, 12}, .boundary = {boundary, Boundary::reflective}};
    // A shaft at the left side, and a tunnel that reaches it only across the right side.
    const Layers layers = single_layer(
        frame,
        [&](Vec3d r) {
          const auto gas = [](Vec3d q) {
            return std::min(box(q, {-20, 0, 0}, {4.4, 20, 20.4}),
                            box(q, {14, 0, -15}, {9, 20, 3.4}));
          };
          double open = gas(r);
          if (boundary == Boundary::periodic) {
            open = std::min({open, gas(r + Vec3d{40, 0, 0}), gas(r - Vec3d{40, 0, 0})});
          }
          return std::max(r.z - 0.2, -open);
        },
        -40, 10);
    EXPECT_EQ(open_gas(layers).voids.size(), boundary == Boundary::periodic ? 0U : 1U);
  }
}

TEST(OpenGas, GasThatTouchesOverAnEdgeOfACellIsParted) {
  // Two cavities whose nearest nodes are neighbours along a diagonal only.
  const Frame frame{.spacing = 1, .cells = {40, 12}};
  const Layers layers = single_layer(
      frame,
      [](Vec3d r) {
        const double open = std::min(box(r, {-4.5, 0, 0}, {5, 20, 10.45}),
                                     box(r, {5.5, 0, -15.95}, {4.95, 20, 5.45}));
        return std::max(r.z - 0.2, -open);
      },
      -40, 10);
  EXPECT_EQ(open_gas(layers).voids.size(), 1U);
}

}  // namespace
}  // namespace scarp
