#include "flux/engines/beam.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "flux/solve.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

using exact::Shape;

FluxField solve(const Shape& shape, Vec3d direction, Boundary boundary = Boundary::periodic,
                std::uint64_t seed = 1) {
  const Species ions{.name = "ions",
                     .source = {.kind = SourceLobe::Kind::beam, .direction = direction}};
  FluxOptions options{.sides = shape.sides, .spacing = 1, .seed = seed};
  options.sides.boundary = {boundary, boundary};
  return solve_flux(shape.mesh, {&ions, 1}, options).front();
}

TEST(Beam, GivesTheCosineOnAFlatWafer) {
  const Shape wafer = exact::flat_wafer(20, 4);
  for (const Vec3d direction : {Vec3d{0, 0, -1}, Vec3d{0.6, 0, -0.8}}) {
    const FluxField flux = solve(wafer, direction);
    for (std::size_t f = 0; f < wafer.mesh.triangles.size(); ++f) {
      EXPECT_FLOAT_EQ(flux.arrivals().mean[f], static_cast<float>(-direction.z));
      EXPECT_EQ(flux.arrivals().std_error[f], 0);
    }
    EXPECT_NEAR(flux.audit.balance_error(), 0, 1e-6);
    EXPECT_EQ(flux.error, 0);
    EXPECT_TRUE(flux.target_reached());
  }
}

// Of what arrives, and of the part from which the source is seen.
TEST(Beam, HasResponsesOfTwoTallies) {
  const Shape wafer = exact::flat_wafer(20, 4);
  const Species ions{.name = "ions", .source = {.kind = SourceLobe::Kind::beam}};
  const std::vector<float> of_each(wafer.mesh.triangles.size(), 1);
  const FluxField flux =
      solve_flux(wafer.mesh, {&ions, 1}, {.sides = wafer.sides, .responses = {{of_each, of_each}}})
          .front();
  for (const float mean : flux.arrivals().mean) EXPECT_EQ(mean, 1);
}

TEST(Beam, LeavesVerticalWallsDarkAndTheBottomLit) {
  const Shape shape = exact::trench(2);
  const FluxField flux = solve(shape, {0, 0, -1}, Boundary::reflective);
  const auto normals = facet_normals(shape.mesh);
  for (std::size_t f = 0; f < normals.size(); ++f)
    EXPECT_EQ(flux.arrivals().mean[f], normals[f].z > 0.5F ? 1 : 0);
  // In sight of the source they are.
  ASSERT_EQ(flux.tallies.size(), 2U);
  EXPECT_EQ(flux.tallies[1].quantity, Tally::Quantity::visibility);
  for (const float seen : flux.tallies[1].mean) EXPECT_EQ(seen, 1);
}

// Vertices of walls along the beam lie a little to either side of it, as those that a grid gives.
TEST(Beam, FindsRoughWallsAlongItInSight) {
  constexpr float rough = 0.003F;
  Shape shape = exact::fine_trench(20, 8);
  RandomStream random({.seed = 1});
  for (Vec3f& r : shape.mesh.vertices)
    if (std::abs(r.x) == 10 && r.z < 0) r.x += rough * static_cast<float>(2 * random.uniform() - 1);
  const FluxField flux = solve(shape, {0, 0, -1}, Boundary::reflective);
  const auto normals = facet_normals(shape.mesh);
  int wall = 0;
  int in_sight = 0;
  int facing_away = 0;
  for (std::size_t f = 0; f < normals.size(); ++f) {
    if (std::abs(normals[f].x) < 0.5F) continue;
    ++wall;
    facing_away += normals[f].z < -1e-6F ? 1 : 0;
    in_sight += flux.tallies[1].mean[f] > 0.9F ? 1 : 0;
    EXPECT_NEAR(flux.arrivals().mean[f], flux.tallies[1].mean[f] * std::max(0.0F, normals[f].z),
                2e-6);
  }
  EXPECT_GT(facing_away, wall / 3);
  EXPECT_GT(in_sight, 0.99 * wall);
}

// One that hangs over by more is dark.
TEST(Beam, LeavesOverhangsInTheDark) {
  Shape shape = exact::fine_trench(20, 8);
  for (Vec3f& r : shape.mesh.vertices)
    if (std::abs(r.x) == 10) r.x *= 1 - 0.003F * r.z;
  const FluxField flux = solve(shape, {0, 0, -1}, Boundary::reflective);
  const auto normals = facet_normals(shape.mesh);
  for (std::size_t f = 0; f < normals.size(); ++f)
    if (normals[f].z < -0.02F) {
      EXPECT_EQ(flux.tallies[1].mean[f], 0);
    }
}

// A trench of width 20, a beam with slope 1 in 2: the edge throws a shadow of half the depth, and
// below 40 the far wall is lit down to a depth of 40.
TEST(Beam, ThrowsTheShadowOfTheEdge) {
  const Shape shape = exact::trench(1, 30, 8, 20);
  const FluxField flux = solve(shape, {1, 0, -2});
  const auto normals = facet_normals(shape.mesh);
  const auto areas = facet_areas(shape.mesh);
  double bottom = 0;
  double far_wall = 0;
  double bottom_in_sight = 0;
  for (std::size_t f = 0; f < normals.size(); ++f) {
    const bool at_bottom = corners(shape.mesh, f)[0].z < -19.9 && normals[f].z > 0.5F;
    if (at_bottom) bottom += flux.arrivals().mean[f] * areas[f];
    if (at_bottom) bottom_in_sight += flux.tallies[1].mean[f] * areas[f];
    if (normals[f].x < -0.5F) far_wall += flux.arrivals().mean[f] * areas[f];
  }
  const double cosine = 2 / std::sqrt(5.0);
  EXPECT_NEAR(bottom, cosine * 10 * 8, 1e-4 * bottom);
  EXPECT_NEAR(bottom_in_sight, 10 * 8, 1e-4 * bottom_in_sight);
  EXPECT_NEAR(far_wall, 0.5 * cosine * 20 * 8, 1e-4 * far_wall);
  EXPECT_NEAR(flux.audit.balance_error(), 0, 1e-4);
}

// A shadow border lies anywhere on the floor of a trench: the difference to the exact part that is
// lit has to be what is stated.
TEST(Beam, StatesTheErrorOfShadowBorders) {
  double squares = 0;
  double stated = 0;
  for (int n = 0; n < 200; ++n) {
    const Shape shape = exact::trench(1, 30, 4, 20);
    const double slope = 0.31 + 0.0017 * n;
    const FluxField flux =
        solve(shape, {slope, 0.2 * slope, -1}, Boundary::periodic, static_cast<std::uint64_t>(n));
    const double cosine = 1 / std::sqrt(1 + 1.04 * slope * slope);
    const auto normals = facet_normals(shape.mesh);
    const auto areas = facet_areas(shape.mesh);
    double difference = 0;
    double variance = 0;
    for (std::size_t f = 0; f < normals.size(); ++f) {
      if (normals[f].z < 0.5F || corners(shape.mesh, f)[0].z > -19.9) continue;
      difference += flux.arrivals().mean[f] * areas[f];
      variance += std::pow(flux.arrivals().std_error[f] * areas[f], 2);
    }
    difference -= cosine * (20 - 20 * slope) * 4;
    squares += difference * difference;
    stated += variance;
  }
  // Both sums have some 200 terms: their ratio is known to about a fifth.
  EXPECT_GT(squares / stated, 0.5);
  EXPECT_LT(squares / stated, 1.6);
}

// A reflective side shows what lies behind it mirrored: the beam falls as it would on the whole
// trench, of which the domain is a half.
TEST(Beam, FallsOnMirrorImagesOfTheDomain) {
  const Shape whole = exact::trench(1, 30, 8, 20);
  Shape half = whole;
  std::erase_if(half.mesh.triangles, [&](const Triangle& t) {
    const auto x = [&](int k) { return half.mesh.vertices[t[static_cast<std::size_t>(k)]].x; };
    return (x(0) + x(1) + x(2)) / 3 > 0.5 * (whole.sides.lower[0] + whole.sides.upper[0]);
  });
  half.sides.upper[0] = 0.5 * (whole.sides.lower[0] + whole.sides.upper[0]);
  half.sides.boundary = {Boundary::reflective, Boundary::reflective};
  const std::array<Species, 2> pair{
      Species{.name = "left",
              .source = {.kind = SourceLobe::Kind::beam, .direction = {0.5, 0, -1}}},
      Species{.name = "right",
              .source = {.kind = SourceLobe::Kind::beam, .direction = {-0.5, 0, -1}}}};
  const auto fields = solve_flux(half.mesh, pair, {.sides = half.sides, .spacing = 1});
  const FluxField expected = solve(whole, {0.5, 0, -1});
  std::size_t h = 0;
  for (std::size_t f = 0; f < whole.mesh.triangles.size(); ++f) {
    if (h == half.mesh.triangles.size() || whole.mesh.triangles[f] != half.mesh.triangles[h]) {
      continue;
    }
    EXPECT_FLOAT_EQ(fields[0].arrivals().mean[h], expected.arrivals().mean[f]);
    ++h;
  }
  EXPECT_EQ(h, half.mesh.triangles.size());
  for (const FluxField& field : fields) EXPECT_NEAR(field.audit.balance_error(), 0, 1e-3);
}

TEST(Beam, HasToPointDown) { EXPECT_THROW(solve(exact::flat_wafer(20, 2), {0, 0, 1}), InputError); }

}  // namespace
}  // namespace scarp
