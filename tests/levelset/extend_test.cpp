#include "levelset/extend.h"

#include <gtest/gtest.h>

#include "core/parallel.h"
#include "levelset/extract_surface.h"
#include "surfaces.h"

namespace scarp {
namespace {

TEST(Extend, SphereWithSpeedOneGrowsAsPrescribed) {
  const Frame frame{.spacing = 1, .cells = {40, 40}};
  Layers layers = single_layer(
      frame, [](Vec3d r) { return length(r) - 10; }, -10, 10);
  for (int step = 0; step < 8; ++step) {
    const TriMesh mesh = extract_surface(layers);
    const std::vector<std::array<float, 3>> speeds(mesh.triangles.size(), {1, 1, 1});
    advect(layers, extend_speeds(layers, open_gas(layers), mesh, speeds), 0.5);
  }
  for (const Vec3f& v : extract_surface(layers).vertices) {
    EXPECT_NEAR(length(Vec3d(v)), 14, 0.1);
  }
}

}  // namespace
}  // namespace scarp
