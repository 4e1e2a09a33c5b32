#include "levelset/motion/overgrowth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "levelset/metrology/cross_section.h"
#include "levelset/motion/advect.h"
#include "levelset/motion/extend.h"
#include "levelset/start/shapes.h"
#include "levelset/surface/extract_surface.h"
#include "tests/levelset/speeds.h"
#include "tests/levelset/surfaces.h"

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

/// A crystal that grows fastest on {100}, on a wafer of that plane or of {110}; or at one rate.
AngularFactor crystal(const std::string& wafer) {
  const double a = std::sqrt(0.5);
  const CrystalRates::Values rates{.r100 = 1, .r110 = 0.65, .r111 = 0.5, .r311 = 0.89};
  if (wafer == "100") return CrystalRates(rates, {Vec3d{a, a, 0}, Vec3d{-a, a, 0}, Vec3d{0, 0, 1}});
  if (wafer == "110") return CrystalRates(rates, {Vec3d{0, a, a}, Vec3d{0, -a, a}, Vec3d{1, 0, 0}});
  return CrystalRates({.r100 = 1, .r110 = 1, .r111 = 1, .r311 = 1},
                      {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}});
}

/// Grows on all but the mask, by the normal.
void grow_by_normal(Layers& layers, const AngularFactor& rate, double duration) {
  const auto steps = static_cast<int>(std::ceil(duration / (0.2 * layers.frame.spacing)));
  const double dt = duration / steps;
  for (int step = 0; step < steps; ++step) {
    const OpenGas gas = open_gas(layers);
    const TriMesh mesh = extract_surface(layers, gas);
    const std::vector<Vec3f> normals = facet_normals(mesh);
    std::vector<LayerSpeeds> speeds(3);
    for (std::size_t layer = 0; layer < 3; ++layer) {
      const float amplitude = layer == 1 ? 0.0F : 1.0F;
      CornerSpeeds whole;
      for (const Vec3f& n : normals) {
        const float speed = amplitude * rate.value(n);
        whole.push_back({speed, speed, speed});
      }
      speeds[layer] = {.speed = whole,
                       .parts = {CornerSpeeds(normals.size(), {0, 0, 0}),
                                 CornerSpeeds(normals.size(), {amplitude, amplitude, amplitude})}};
    }
    FacetTree facets(mesh);
    advect(layers, extend_speeds(layers, gas, facets, speeds, {&rate, 1}, dt, close_facets), dt);
  }
}

// A film that grows by its normal knows nothing of the wall that it meets: it stays flat, and
// reaches the wall all along its height, wherever the wall lies in the grid.
TEST(Overgrowth, AFilmThatGrowsByItsNormalStaysFlatBesideAMask) {
  for (const char* const wafer : {"any", "100", "110"}) {
    const AngularFactor rate = crystal(wafer);
    for (const double h : {1.0, 0.5}) {
      for (const double offset : {0.0, 0.15, 0.3, 0.5, 0.7, 0.95}) {
        SCOPED_TRACE(testing::Message() << wafer << ' ' << h << ' ' << offset);
        Layers layers = build_layers(
            flat(h),
            std::vector<Shape>{WaferShape{.material = 0},
                               MaskShape{.material = 1,
                                         .thickness = 20,
                                         .outline = SlotOutline{.width = 2 * (20 + offset * h)}}});
        add_layer(layers, 2);
        constexpr double height = 12;
        grow_by_normal(layers, rate, height / rate.value({0, 0, 1}));
        const double wall = 20 + offset * h;
        for (double x = 0; x < wall - 0.5 * h; x += 0.5 * h) {
          EXPECT_NEAR(layers.top().distance({x, 0, height}) / h, 0, 0.4) << x;
          EXPECT_NEAR(layers.top().distance({-x, 0, height}) / h, 0, 0.4) << x;
        }
        for (double z = h; z < height - h; z += 0.5 * h) {
          EXPECT_LT(layers.top().distance({wall - 0.05 * h, 0, z}) / h, -0.5) << z;
          EXPECT_LT(layers.top().distance({0.05 * h - wall, 0, z}) / h, -0.5) << z;
        }
        // In a slice one spacing wide; a cell at each wall.
        EXPECT_NEAR(material_volumes(layers)[2] / h, 2 * wall * height, 2 * h * h);
      }
    }
  }
}

// Above the mask it spreads as its planes have it: equal rates, a quarter of a circle.
TEST(Overgrowth, AFilmThatGrowsByItsNormalSpreadsOverTheMask) {
  const AngularFactor rate = crystal("any");
  Layers layers = masked(flat(0.5), SlotOutline{.width = 40.3});
  grow_by_normal(layers, rate, 2 + 12);
  for (double angle = 5; angle < 90; angle += 10) {
    const double x = 20.15 + 12 * std::cos(angle * pi / 180);
    const double z = 2 + 12 * std::sin(angle * pi / 180);
    EXPECT_NEAR(layers.top().distance({x, 0, z}) / 0.5, 0, 1.2) << angle;
  }
}

}  // namespace
}  // namespace scarp
