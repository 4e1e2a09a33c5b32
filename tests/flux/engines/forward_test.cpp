#include "flux/engines/forward.h"

#include <gtest/gtest.h>

#include <cmath>

#include "flux/rays/tracer.h"
#include "flux/solve.h"
#include "tests/flux/direct_flux.h"
#include "tests/flux/shape_problem.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

using exact::Shape;

FluxField trace(const Shape& shape, const Species& species, std::uint64_t rays,
                std::uint64_t seed = 1) {
  const FluxOptions options{.engine = FluxOptions::Engine::forward,
                            .sides = shape.sides,
                            .spacing = 1,
                            .rays = rays,
                            .seed = seed};
  return solve_flux(shape.mesh, {&species, 1}, options).front();
}

TEST(Forward, AccountsForEveryParticleExactly) {
  const Shape shape = exact::hole(3);
  for (const float sticking : {0.0F, 0.003F, 0.1F, 1.0F}) {
    const FluxField flux = trace(shape, {.name = "gas", .sticking = {sticking}}, 20'000);
    const FluxAudit& audit = flux.audit;
    EXPECT_EQ(audit.emitted, 20'000);
    EXPECT_EQ(audit.absorbed + audit.escaped - audit.roulette, audit.emitted);
    EXPECT_EQ(audit.lost(), 0);
    EXPECT_EQ(flux.rays, 20'000U);
    // The tallies hold what was absorbed, and roulette is fair.
    const std::vector<double> areas = facet_areas(shape.mesh);
    double arrived = 0;
    for (std::size_t f = 0; f < areas.size(); ++f) arrived += flux.arrivals().mean[f] * areas[f];
    arrived *= audit.emitted / shape.sides.area();
    EXPECT_NEAR(sticking * arrived, audit.absorbed, 1e-4 * arrived);
    EXPECT_LT(std::abs(audit.roulette), 0.01 * audit.emitted);
  }
}

TEST(Forward, RoundsTheNumberOfRaysUpToWholeBatches) {
  EXPECT_EQ(trace(exact::flat_wafer(20, 2), {.name = "gas"}, 1).rays, 32U);
  EXPECT_EQ(trace(exact::flat_wafer(20, 2), {.name = "gas"}, 33).rays, 64U);
}

class DirectFlux : public ::testing::TestWithParam<std::tuple<FluxOptions::Engine, double>> {};

TEST_P(DirectFlux, OfAPowerCosineSourceIsTheClosedForm) {
  const auto [engine, power] = GetParam();
  const Shape shape = exact::trench(1, 4, 8, 40);
  const Species species{.name = "gas", .source = {.cosine_power = power}};
  const FluxOptions options{
      .engine = engine, .sides = shape.sides, .spacing = 1, .rays = 1 << 18, .seed = 3};
  const FluxField flux = solve_flux(shape.mesh, {&species, 1}, options).front();
  const auto normals = facet_normals(shape.mesh);
  double squares = 0;
  int count = 0;
  for (std::size_t f = 0; f < normals.size(); ++f) {
    const auto [a, b, c] = corners(shape.mesh, f);
    const Vec3d r = (a + b + c) / 3.0;
    const double error = flux.arrivals().std_error[f];
    const bool is_field = r.z > -0.01;
    const double exact = is_field ? 1 : exact::direct_trench_flux(r, Vec3d(normals[f]), power);
    EXPECT_NEAR(flux.arrivals().mean[f], exact, 6 * error + 0.003) << r.x << " " << r.z;
    squares += std::pow((flux.arrivals().mean[f] - exact) / (error + 0.001), 2);
    ++count;
  }
  EXPECT_LT(std::sqrt(squares / count), 1.15);
}

INSTANTIATE_TEST_SUITE_P(Powers, DirectFlux,
                         ::testing::Combine(::testing::Values(FluxOptions::Engine::forward,
                                                              FluxOptions::Engine::gather),
                                            ::testing::Values(0.5, 1.0, 2.0, 10.0, 100.0)));

// Of any number that another engine used: each batch has as many rays, or some would come twice.
TEST(Forward, BeginsWithWholeBatches) {
  exact::ShapeProblem wafer(exact::flat_wafer(8, 4), {.name = "gas"});
  wafer.options.target_error = 0.5;
  const FluxField flux = trace_forward(wafer.problem, 70'001);
  EXPECT_GE(flux.rays, 70'001U);
  EXPECT_EQ(flux.rays % batch_count, 0U);
  EXPECT_EQ(flux.audit.emitted, static_cast<double>(flux.rays));
}

}  // namespace
}  // namespace scarp
