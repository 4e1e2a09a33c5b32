#include "flux/engines/gather.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "flux/solve.h"
#include "tests/flux/direct_flux.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

using exact::Shape;

FluxOptions options_of(const Shape& shape, std::uint64_t rays) {
  return {.engine = FluxOptions::Engine::gather, .sides = shape.sides, .spacing = 1, .rays = rays};
}

double mean_on_bottom(const Shape& shape, const FluxField& flux, double depth) {
  const std::vector<double> areas = facet_areas(shape.mesh);
  double sum = 0;
  double area = 0;
  for (std::size_t f = 0; f < areas.size(); ++f) {
    const auto [a, b, c] = corners(shape.mesh, f);
    if (std::max({a.z, b.z, c.z}) > 0.01 - depth) continue;
    sum += flux.arrivals().mean[f] * areas[f];
    area += areas[f];
  }
  return sum / area;
}

TEST(Gather, GivesTheDirectFluxAtTheBottomOfAHole) {
  const Shape shape = exact::hole(2);
  const Species gas{.name = "gas"};
  const FluxField flux = solve_flux(shape.mesh, {&gas, 1}, options_of(shape, 1 << 20)).front();
  const double exact = exact::direct_hole_bottom_flux(2);
  EXPECT_NEAR(mean_on_bottom(shape, flux, 40), exact, 0.02 * exact);
}

// Clausing: what enters a slot of depth W between walls that hold nothing reaches the absorbing
// bottom with probability 0.68438.
TEST(Gather, GivesTheTransmissionOfASlot) {
  Shape shape = exact::trench(1);
  const auto normals = facet_normals(shape.mesh);
  shape.mesh.materials.resize(normals.size());
  for (std::size_t f = 0; f < normals.size(); ++f)
    shape.mesh.materials[f] = normals[f].z > 0.5F ? 1 : 0;
  const Species gas{.name = "gas", .sticking = {0.0F, 1.0F}};
  const FluxField flux = solve_flux(shape.mesh, {&gas, 1}, options_of(shape, 1 << 18)).front();
  EXPECT_NEAR(mean_on_bottom(shape, flux, 20), 0.68438, 0.004);
}

// Species share the rays, and each gets what it would get alone.
TEST(Gather, SolvesManySpeciesFromTheSameRays) {
  const Shape shape = exact::trench(2);
  const std::vector<Species> species{{.name = "a", .sticking = {0.1F}},
                                     {.name = "b", .sticking = {0.7F}}};
  const auto both = solve_flux(shape.mesh, species, options_of(shape, 1 << 16));
  for (std::size_t k = 0; k < 2; ++k) {
    const auto alone = solve_flux(shape.mesh, {&species[k], 1}, options_of(shape, 1 << 16));
    EXPECT_EQ(both[k].arrivals().mean, alone.front().arrivals().mean);
  }
  EXPECT_EQ(both[0].segments, both[1].segments);
}

// Facets of one spacing share an equation with their neighbours; on each the flux is its own.
TEST(Gather, GivesTheDirectFluxOnEverySmallFacetOfAWall) {
  const Shape shape = exact::fine_trench();
  const Species gas{.name = "gas"};
  const FluxField flux = solve_flux(shape.mesh, {&gas, 1}, options_of(shape, 1 << 21)).front();
  const auto normals = facet_normals(shape.mesh);
  for (std::size_t f = 0; f < normals.size(); ++f) {
    const auto [a, b, c] = corners(shape.mesh, f);
    const Vec3d r = (Vec3d(a) + Vec3d(b) + Vec3d(c)) / 3.0;
    if (r.z > -0.1) continue;
    const double exact = exact::direct_trench_flux(r, Vec3d(normals[f]), 1);
    EXPECT_NEAR(flux.arrivals().mean[f], exact, 4 * flux.arrivals().std_error[f] + 0.005 * exact)
        << "at z = " << r.z;
  }
}

// Slopes end where they would lead below zero, next to elements that few rays from saw the source.
TEST(Gather, IsNowhereNegative) {
  const Shape shape = exact::fine_trench(200);
  const Species gas{.name = "gas"};
  const FluxField flux = solve_flux(shape.mesh, {&gas, 1}, options_of(shape, 1 << 13)).front();
  EXPECT_THAT(flux.arrivals().mean, ::testing::Contains(0));
  EXPECT_THAT(flux.arrivals().mean, ::testing::Each(::testing::Ge(0)));
}

// A slope between mirrors, of two facets that make one element: with a few rays its two sets often
// find the same, with many only by chance.
TEST(Gather, DoesNotTakeAFewRaysThatAgreeForATarget) {
  exact::Builder builder;
  builder.grid({0, 0, 0}, {10, 0, 10}, 1, {0, 10, 0}, 1);
  const Shape shape{builder.mesh, {.lower = {0, 0}, .upper = {10, 10}}};
  const Species gas{.name = "gas"};
  double stated = 0;
  double found = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    FluxOptions options = options_of(shape, 0);
    options.spacing = 0;
    options.seed = seed;
    const FluxField flux = solve_flux(shape.mesh, {&gas, 1}, options).front();
    stated += flux.error * flux.error;
    found += std::pow(flux.audit.balance_error(), 2);
    EXPECT_NEAR(flux.audit.balance_error(), 0, 0.01);
  }
  EXPECT_GT(stated, 0.5 * found);
}

TEST(Gather, BalancesWithinItsOwnError) {
  const Shape shape = exact::hole(3);
  double squares = 0;
  constexpr int seeds = 20;
  for (int seed = 1; seed <= seeds; ++seed) {
    FluxOptions options = options_of(shape, 1 << 16);
    options.seed = static_cast<std::uint64_t>(seed);
    const Species gas{.name = "gas", .sticking = {0.1F}};
    const FluxAudit audit = solve_flux(shape.mesh, {&gas, 1}, options).front().audit;
    const double z = audit.balance_error() / audit.balance_std_error;
    EXPECT_LT(std::abs(z), 4);
    squares += z * z;
    EXPECT_LT(audit.balance_std_error, 0.01);
    EXPECT_EQ(audit.lost(), 0);
  }
  EXPECT_LT(std::sqrt(squares / seeds), 1.6);
  EXPECT_GT(std::sqrt(squares / seeds), 0.5);
}

}  // namespace
}  // namespace scarp
