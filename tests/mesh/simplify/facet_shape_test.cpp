#include "mesh/simplify/facet_shape.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

double shape_of(Vec3d a, Vec3d b, Vec3d c) { return facet_shape(a, b, c, cross(b - a, c - a)); }

TEST(FacetShape, IsZeroForEqualSidesAndOneForNoArea) {
  EXPECT_NEAR(shape_of({0, 0, 0}, {2, 0, 0}, {1, std::sqrt(3), 0}), 0, 1e-12);
  EXPECT_NEAR(shape_of({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), 1 - std::sqrt(3) / 2, 1e-12);
  EXPECT_NEAR(shape_of({0, 0, 0}, {std::sqrt(3), 0, 0}, {0, 1, 0}), 0.25, 1e-12) << "30 degrees";
  EXPECT_EQ(shape_of({0, 0, 0}, {1, 0, 0}, {2, 0, 0}), 1);
  EXPECT_EQ(shape_of({1, 2, 3}, {1, 2, 3}, {1, 2, 3}), 1);
}

TEST(ShapeGrowth, IsThatOfAllFacetsTogether) {
  const CollapseMesh before(noisy_plane(6, 0.05), {});
  const auto sum = [](const CollapseMesh& mesh) {
    double shape = 0;
    for (std::uint32_t f = 0; f < mesh.normals.size(); ++f) {
      if (!mesh.topology.alive(f)) continue;
      const HalfEdges& topology = mesh.topology;
      shape += facet_shape(mesh.r[topology.origin(3 * f)], mesh.r[topology.origin(3 * f + 1)],
                           mesh.r[topology.origin(3 * f + 2)], mesh.normal_of(f));
    }
    return shape;
  };
  for (std::uint32_t h = 0; h < before.topology.half_edge_count(); h += 7) {
    if (!before.topology.can_collapse(h)) continue;
    CollapseMesh mesh = before;
    Star star;
    ASSERT_TRUE(star.gather(mesh.topology, h));
    const Vec3d r = 0.5 * (mesh.r[star.u] + mesh.r[star.v]);
    std::vector<Vec3d> normals(star.count);
    for (int i = 0; i < star.count; ++i) {
      normals[i] = cross(mesh.r[star.ring[i]] - r, mesh.r[star.ring[i + 1]] - r);
    }
    const double growth = shape_growth(mesh, star, r, normals);
    mesh.topology.collapse(h);
    mesh.r[star.u] = r;
    EXPECT_NEAR(growth, sum(mesh) - sum(before), 1e-9) << "half edge " << h;
  }
}

}  // namespace
}  // namespace scarp
