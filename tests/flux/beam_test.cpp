#include "flux/beam.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "flux/solve.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

using testing::Shape;

FluxField solve(const Shape& shape, Vec3d direction, Boundary boundary = Boundary::periodic) {
  const Species ions{.name = "ions",
                     .source = {.kind = SourceLobe::Kind::beam, .direction = direction}};
  FluxOptions options{.sides = shape.sides, .spacing = 1};
  options.sides.boundary = {boundary, boundary};
  return solve_flux(shape.mesh, {&ions, 1}, options).front();
}

TEST(Beam, GivesTheCosineOnAFlatWafer) {
  const Shape wafer = testing::flat_wafer(20, 4);
  for (const Vec3d direction : {Vec3d{0, 0, -1}, Vec3d{0.6, 0, -0.8}}) {
    const FluxField flux = solve(wafer, direction);
    for (std::size_t f = 0; f < wafer.mesh.triangles.size(); ++f) {
      EXPECT_FLOAT_EQ(flux.arrivals().mean[f], static_cast<float>(-direction.z));
      EXPECT_EQ(flux.arrivals().std_error[f], 0);
    }
    EXPECT_NEAR(flux.audit.balance_error(), 0, 1e-6);
    EXPECT_EQ(flux.error, 0);
    EXPECT_TRUE(flux.target_reached);
  }
}

TEST(Beam, LeavesVerticalWallsDarkAndTheBottomLit) {
  const Shape shape = testing::trench(2);
  const FluxField flux = solve(shape, {0, 0, -1}, Boundary::reflective);
  const auto normals = facet_normals(shape.mesh);
  for (std::size_t f = 0; f < normals.size(); ++f)
    EXPECT_EQ(flux.arrivals().mean[f], normals[f].z > 0.5F ? 1 : 0);
}

// A trench of width 20, a beam with slope 1 in 2: the edge throws a shadow of half the depth, and
// below 40 the far wall is lit down to a depth of 40.
TEST(Beam, ThrowsTheShadowOfTheEdge) {
  const Shape shape = testing::trench(1, 30, 8, 20);
  const FluxField flux = solve(shape, {1, 0, -2});
  const auto normals = facet_normals(shape.mesh);
  const auto areas = facet_areas(shape.mesh);
  double bottom = 0;
  double far_wall = 0;
  for (std::size_t f = 0; f < normals.size(); ++f) {
    const bool at_bottom = corners(shape.mesh, f)[0].z < -19.9 && normals[f].z > 0.5F;
    if (at_bottom) bottom += flux.arrivals().mean[f] * areas[f];
    if (normals[f].x < -0.5F) far_wall += flux.arrivals().mean[f] * areas[f];
  }
  const double cosine = 2 / std::sqrt(5.0);
  EXPECT_NEAR(bottom, cosine * 10 * 8, 1e-4 * bottom);
  EXPECT_NEAR(far_wall, 0.5 * cosine * 20 * 8, 1e-4 * far_wall);
  EXPECT_NEAR(flux.audit.balance_error(), 0, 1e-4);
}

TEST(Beam, TiltedTowardsAReflectiveSideIsRefused) {
  EXPECT_THROW(solve(testing::flat_wafer(20, 2), {0.1, 0, -1}, Boundary::reflective), InputError);
  EXPECT_THROW(solve(testing::flat_wafer(20, 2), {0, 0, 1}), InputError);
}

}  // namespace
}  // namespace scarp
