#include "levelset/grid/redistance.h"

#include <gtest/gtest.h>

#include <cmath>

#include "levelset/grid/band.h"
#include "levelset/surface/extract_surface.h"
#include "tests/levelset/speeds.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

TEST(Redistance, MakesADistanceOfWhatIsNone) {
  const Frame frame{.spacing = 1, .cells = {48, 48}};
  Layers layers = single_layer(
      frame, [](Vec3d r) { return length(r) - 15.2; }, -16, 16);
  Band& band = layers.top().band();
  for (Leaf& leaf : band.leaves()) {
    for (int node = 0; node < leaf_size; ++node) {
      const float phi = leaf.phi[node];
      leaf.phi[node] = std::abs(phi) > 1.2F && std::abs(phi) < 4 ? 0.6F * phi : phi;
    }
  }
  for (int n = 0; n < 6; ++n) {
    redistance(band);
  }
  for (int i = 0; i <= 48; ++i) {
    for (int k = -24; k < 24; ++k) {
      const double exact =
          length(Vec3d{frame.node_position(0, i), frame.node_position(1, 24), 1.0 * k}) - 15.2;
      if (std::abs(exact) < 2.5) {
        EXPECT_NEAR(layers.top().node(i, 24, k), exact, 0.06);
      }
    }
  }
}

TEST(Redistance, DoesNotMoveTheSurfaceByOneBit) {
  const Frame frame{.spacing = 1, .cells = {40, 40}};
  HoleShape hole{.radius = 9.3};
  hole.cut.depth = 11.7;
  Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{}, hole});
  const auto before = phi_next_to_surface(layers.top(), -20, 6);
  for (int n = 0; n < 100; ++n) {
    redistance(layers.top().band());
  }
  EXPECT_EQ(phi_next_to_surface(layers.top(), -20, 6), before);
}

TEST(Redistance, ForgetsASurfaceThatHasVanished) {
  const Frame frame{.spacing = 1, .cells = {40, 40}};
  Layers layers = single_layer(
      frame, [](Vec3d r) { return length(r) - 2.3; }, -16, 16);
  for (int step = 0; step < 20; ++step) {
    advect(layers, prescribe_speeds(layers, [](Vec3d, MaterialId) { return -1.0; }), 0.5);
  }
  EXPECT_TRUE(extract_surface(layers).triangles.empty());
  EXPECT_EQ(layers.top().active_count(), 0U);
}

}  // namespace
}  // namespace scarp
