#include "levelset/overgrowth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "levelset/advect.h"
#include "levelset/extend.h"
#include "levelset/extract_surface.h"
#include "levelset/shapes.h"
#include "surfaces.h"

namespace scarp {
namespace {

using std::numbers::pi;

/// A mask 4 spacings thick with an opening, and a film that grows at 1 nm/s, but not on the mask.
Layers masked(const Frame& frame, const Outline& opening) {
  Layers layers = build_layers(
      frame, std::vector<Shape>{
                 WaferShape{.material = 0},
                 MaskShape{.material = 1, .thickness = 4 * frame.spacing, .outline = opening}});
  add_layer(layers, 2);
  return layers;
}

void grow(Layers& layers, double duration) {
  const auto steps = static_cast<int>(std::ceil(duration / (0.4 * layers.frame.spacing)));
  const double dt = duration / steps;
  for (int step = 0; step < steps; ++step) {
    const OpenGas gas = open_gas(layers);
    const TriMesh mesh = extract_surface(layers, gas);
    std::vector<CornerSpeeds> speeds(3, CornerSpeeds(mesh.triangles.size(), {1, 1, 1}));
    speeds[1].assign(mesh.triangles.size(), {0, 0, 0});
    advect(layers, extend_speeds(layers, gas, mesh, speeds, dt), dt);
  }
}

Frame flat(double h) {
  Frame frame{.spacing = h, .cells = {static_cast<int>(96 / h), 1}};
  frame.two_dimensional = true;
  return frame;
}

// Above the mask a film spreads from the mask's edge on circles, however long it has grown and
// whatever the spacing: what it loses or wins where it passes the edge is a spacing at most.
TEST(Overgrowth, SpreadsFromTheEdgeOfAMaskOnAQuarterCircle) {
  for (const double h : {1.0, 0.5}) {
    for (const double offset : {0.0, 0.15, 0.5, 0.95}) {
      Layers layers = masked(flat(h), SlotOutline{.width = 2 * (20 + offset * h)});
      grow(layers, 4 * h);
      double error_at_foot = 0;
      for (const double radius : {6.0, 18.0}) {
        grow(layers, radius == 6 ? 6 : 12);
        for (double angle = 5; angle < 90; angle += 10) {
          const double x = 20 + offset * h + radius * std::cos(angle * pi / 180);
          const double z = 4 * h + radius * std::sin(angle * pi / 180);
          EXPECT_NEAR(layers.top().distance({x, 0, z}) / h, 0, 1.2)
              << h << " " << offset << ' ' << angle;
          EXPECT_NEAR(layers.top().distance({-x, 0, z}) / h, 0, 1.2)
              << h << " " << offset << ' ' << angle;
        }
        EXPECT_NEAR(layers.top().distance({0, 0, 4 * h + radius}) / h, 0, 0.01);
        const double foot =
            layers.top().distance({20 + offset * h + radius, 0, 5 * h}) / h - 0.5 * h / radius;
        if (radius > 6) {
          EXPECT_NEAR(foot, error_at_foot, 0.3) << h << " " << offset;
        }
        error_at_foot = foot;
      }
    }
  }
}

TEST(Overgrowth, SpreadsFromARoundOpeningToo) {
  const Frame frame{.spacing = 1, .cells = {48, 48}};
  Layers layers = masked(frame, CircleOutline{.radius = 8.3});
  grow(layers, 4 + 9);
  for (const double turn : {0.0, 0.3, pi / 4, 1.2}) {
    for (const double angle : {10.0, 30.0, 60.0}) {
      const double rho = 8.3 + 9 * std::cos(angle * pi / 180);
      const Vec3d r{rho * std::cos(turn), rho * std::sin(turn), 4 + 9 * std::sin(angle * pi / 180)};
      EXPECT_NEAR(layers.top().distance(r), 0, 1.2) << turn << ' ' << angle;
    }
  }
}

// Where the film has not come the mask keeps its surface to the last bit, also along its wall and
// above what lies buried below it.
TEST(Overgrowth, DoesNotCreepOnAMask) {
  for (const double offset : {0.0, 0.15, 0.85}) {
    Layers layers = masked(flat(1), SlotOutline{.width = 2 * (20 + offset)});
    const Layers before = layers.copy();
    grow(layers, 0.4);
    // Two spacings of the wall are above the film.
    EXPECT_NEAR(layers.top().distance({20 + offset - 0.5, 0, 2}), 0.5, 0.02) << offset;
    grow(layers, 9.6);
    const auto foot = static_cast<int>(std::ceil(48 + 20 + offset + 6 + 2));
    for (int i = foot; i <= 96; ++i) {
      for (int k = 2; k <= 5; ++k) {
        const float was = before.top().node(i, 0, k);
        if (std::abs(was) < 1.01F) {
          EXPECT_EQ(layers.top().node(i, 0, k), was) << offset << ' ' << i << ' ' << k;
        }
      }
    }
  }
}

}  // namespace
}  // namespace scarp
