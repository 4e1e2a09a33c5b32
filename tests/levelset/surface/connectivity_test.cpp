#include "levelset/surface/connectivity.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "tests/levelset/surfaces.h"

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
  EXPECT_NEAR(gas.voids[0].volume, exact, 1e-3 * exact);
  EXPECT_NEAR(gas.voids[0].lower, -20.3, 0.02);
  EXPECT_NEAR(gas.voids[0].upper, -3.7, 0.02);
}

/// A wafer with closed boxes in it, of dilated solid.
Layers with_closed_boxes(const Frame& frame, const std::vector<std::array<Vec3d, 2>>& boxes) {
  return single_layer(
      frame,
      [&](Vec3d r) {
        double gas = std::numeric_limits<double>::infinity();
        for (const auto& [centre, half] : boxes) gas = std::min(gas, box(r, centre, half));
        return std::max(r.z, -gas) - 1e-3 * frame.spacing;
      },
      -40 * frame.spacing, 10 * frame.spacing);
}

// Where walls lie on nodes a node is half full or empty, which no fraction of its own tells.
TEST(OpenGas, BoxesHaveTheirExactVolumeWhereverTheirWallsLie) {
  for (const double offset : {0.0, 0.3, 0.5, 0.77}) {
    const Frame frame{.spacing = 0.5, .cells = {60, 60}};
    const Vec3d centre{0.5 * offset, -0.5 * offset, -9 + 0.5 * offset};
    const Vec3d half{6, 4, 5};
    const OpenGas gas = open_gas(with_closed_boxes(frame, {{centre, half}}));
    ASSERT_EQ(gas.voids.size(), 1U);
    const double shrunk = 2 * 1e-3 * frame.spacing;
    const double exact = (12 - shrunk) * (8 - shrunk) * (10 - shrunk);
    EXPECT_NEAR(gas.voids[0].volume, exact, 2e-5 * exact) << offset;
    EXPECT_NEAR(gas.voids[0].lower, centre.z - 5 + 0.5 * shrunk, 1e-5) << offset;
    EXPECT_NEAR(gas.voids[0].upper, centre.z + 5 - 0.5 * shrunk, 1e-5) << offset;
  }
}

TEST(OpenGas, VoidsThatMeetInACellAreMeasuredEachForItself) {
  // Two boxes with neighbouring nodes across an edge, where the upper one's surface begins, and one
  // cut by two sides of the domain.
  const Frame frame{.spacing = 1, .cells = {40, 40}};
  const OpenGas gas = open_gas(with_closed_boxes(frame, {{Vec3d{-5.6, 0, -25.6}, Vec3d{5, 6, 5}},
                                                         {Vec3d{3.6, 0, -16.4}, Vec3d{4, 6, 4}},
                                                         {Vec3d{20, 20, -10}, Vec3d{4, 6, 3}}}));
  ASSERT_EQ(gas.voids.size(), 3U);
  EXPECT_NEAR(gas.voids[0].volume, 10 * 10 * 12, 3);
  EXPECT_NEAR(gas.voids[1].volume, 8 * 8 * 12, 3);
  EXPECT_NEAR(gas.voids[2].volume, 4 * 6 * 6, 0.2);
}

TEST(OpenGas, VoidsThatAreKnownAreNotMeasuredAgain) {
  const Frame frame{.spacing = 1, .cells = {40, 40}};
  const Layers layers = with_closed_boxes(
      frame, {{Vec3d{-8, 0, -15}, Vec3d{4, 6, 5}}, {Vec3d{8, 0, -15}, Vec3d{4, 6, 5}}});
  const std::vector<Region> voids = open_gas(layers).voids;
  ASSERT_EQ(voids.size(), 2U);
  Region known = voids[1];
  known.volume = 42;
  const std::vector<Region> again = open_gas(layers, {&known, 1}).voids;
  ASSERT_EQ(again.size(), 2U);
  EXPECT_EQ(again[0].volume, voids[0].volume);
  EXPECT_EQ(again[1].volume, 42);
  EXPECT_EQ(again[1].lower, voids[1].lower);
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
      const double exact = 50.6 * 30.6 * 40.6;
      EXPECT_NEAR(gas.voids[0].volume, exact, 1e-5 * exact);
      EXPECT_NEAR(gas.voids[0].lower, -60.3, 1e-4);
    }
  }
}

TEST(OpenGas, PeriodicSidesJoinWhatReflectiveOnesPart) {
  for (const Boundary boundary : {Boundary::reflective, Boundary::periodic}) {
    const Frame frame{
        .spacing = 1, .cells = {40, 12}, .boundary = {boundary, Boundary::reflective}};
    // A shaft near the left side, and a tunnel that reaches it only across the right side.
    const Layers layers = single_layer(
        frame,
        [&](Vec3d r) {
          const auto gas = [](Vec3d q) {
            return std::min(box(q, {-15.5, 0, 0}, {2.4, 20, 20.4}),
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

/// A flat wafer below z = 0 with another solid above it, of one material each.
Layers wafer_with(const Frame& frame, const std::function<double(Vec3d)>& other, double top) {
  Layers layers = single_layer(
      frame, [](Vec3d r) { return r.z - 0.3; }, -4, 4);
  layers.stack.push_back(
      {1, LevelSet(
              frame, [&](Vec3d r) { return std::min(r.z - 0.3, other(r)); }, -4, top)});
  return layers;
}

TEST(RemoveIslands, ABallIsToldWithItsVolumeAndHeightsAndLeavesTheRestAlone) {
  const Frame frame{.spacing = 0.5, .cells = {60, 60}};
  const auto post = [](Vec3d r) { return box(r, {-10, 0, 0}, {2.2, 2.2, 5.1}); };
  const auto ball = [](Vec3d r) { return length(r - Vec3d{3, 2, 10}) - 5.3; };
  Layers layers = wafer_with(
      frame, [&](Vec3d r) { return std::min(post(r), ball(r)); }, 20);
  const Layers expected = wafer_with(frame, post, 20);

  const std::vector<Region> islands = remove_islands(layers);
  ASSERT_EQ(islands.size(), 1U);
  const double exact = 4.0 / 3 * std::numbers::pi * 5.3 * 5.3 * 5.3;
  EXPECT_NEAR(islands[0].volume, exact, 3e-3 * exact);
  EXPECT_NEAR(islands[0].lower, 4.7, 0.02);
  EXPECT_NEAR(islands[0].upper, 15.3, 0.02);

  for (int i = 0; i <= 60; ++i) {
    for (int j = 0; j <= 60; ++j) {
      for (int k = -8; k < 40; ++k) {
        const float phi = expected.top().node(i, j, k);
        const float found = layers.top().node(i, j, k);
        // Next to the surface not a bit has changed; further out the distance has grown again.
        if (std::abs(phi) < 0.5) {
          ASSERT_EQ(found, phi) << i << " " << j << " " << k;
        }
        ASSERT_GT(std::copysign(found, phi) == found ? std::abs(found) : -1, std::abs(phi) - 0.35);
        ASSERT_EQ(layers.stack[0].phi.node(i, j, k) < 0, expected.stack[0].phi.node(i, j, k) < 0);
      }
    }
  }
  EXPECT_TRUE(remove_islands(layers).empty());
}

TEST(RemoveIslands, TakesAwayAllLayersOfAnIslandLargerThanTheBand) {
  Frame frame{.spacing = 1, .cells = {80, 1}};
  frame.two_dimensional = true;
  Layers layers = wafer_with(
      frame,
      [](Vec3d r) {
        return box(r, {0, 0, 40}, {30, 100, 25});
      },
      70);
  layers.stack.insert(layers.stack.begin() + 1, {2, layers.top().copy()});
  layers.stack.push_back({3, LevelSet(
                                 frame,
                                 [](Vec3d r) {
                                   return std::min(r.z - 0.3, box(r, {0, 0, 40}, {32, 100, 27}));
                                 },
                                 -4, 72)});
  const std::vector<Region> islands = remove_islands(layers);
  ASSERT_EQ(islands.size(), 1U);
  EXPECT_NEAR(islands[0].volume, 64 * 54, 3);
  for (const Layer& layer : layers.stack) {
    for (int k = 5; k < 80; ++k) {
      ASSERT_GT(layer.phi.node(40, 0, k), 3) << k;
    }
    EXPECT_LT(layer.phi.upper(), 10);
  }
}

TEST(RemoveIslands, SolidThatTouchesOverAnEdgeOfACellStays) {
  // A chain of boxes that touch along diagonals only, across the borders of leaves too: along x and
  // z with a step at every node, and the same along y and z, and x and y.
  const Frame frame{.spacing = 1, .cells = {40, 40}};
  for (const std::array<int, 2> axes : {std::array{0, 2}, std::array{1, 2}, std::array{0, 1}}) {
    const auto stairs = [&](Vec3d r, int missing) {
      double solid = box(r, {-14, -14, 0}, {1.4, 1.4, 10.4});
      for (int n = 0; n < 20; ++n) {
        Vec3d centre{-14, -14, 10};
        centre[axes[0]] += n;
        centre[axes[1]] += n;
        solid = n == missing ? solid : std::min(solid, box(r, centre, {0.4, 0.4, 0.4}));
      }
      return solid;
    };
    for (const int missing : {-1, 10}) {
      Layers layers = wafer_with(
          frame, [&](Vec3d r) { return stairs(r, missing); }, 40);
      EXPECT_EQ(remove_islands(layers).size(), missing < 0 ? 0U : 1U) << axes[0] << axes[1];
    }
  }
}

TEST(RemoveIslands, PeriodicSidesHoldWhatReflectiveOnesPart) {
  for (const Boundary boundary : {Boundary::reflective, Boundary::periodic}) {
    const Frame frame{
        .spacing = 1, .cells = {40, 12}, .boundary = {boundary, Boundary::reflective}};
    // A post near the left side, and a beam that reaches it only across the right side.
    Layers layers = wafer_with(
        frame,
        [&](Vec3d r) {
          const auto solid = [](Vec3d q) {
            return std::min(box(q, {-15.5, 0, 0}, {2.4, 20, 20.4}),
                            box(q, {14, 0, 15}, {9, 20, 3.4}));
          };
          double all = solid(r);
          if (boundary == Boundary::periodic) {
            all = std::min({all, solid(r + Vec3d{40, 0, 0}), solid(r - Vec3d{40, 0, 0})});
          }
          return all;
        },
        30);
    EXPECT_EQ(remove_islands(layers).size(), boundary == Boundary::periodic ? 0U : 1U);
  }
}

}  // namespace
}  // namespace scarp
