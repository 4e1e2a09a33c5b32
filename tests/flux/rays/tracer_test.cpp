#include "flux/rays/tracer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/flux/ion_traces.h"

namespace scarp {
namespace {

using exact::degree;
using exact::everywhere;
using exact::mean_of;
using exact::plasma_ions;
using exact::right_angle;
using exact::Shape;
using exact::sputter;
using Engine = FluxOptions::Engine;

class IonFlux : public ::testing::TestWithParam<Engine> {
 protected:
  static FluxField trace(const Shape& shape, const Species& species, FluxOptions options) {
    options.engine = GetParam();
    return exact::trace(shape, species, options);
  }

  // Particles from the source are counted; what facets see of it has an error, and is rounded.
  static void expect_balance(const FluxAudit& audit) {
    EXPECT_EQ(audit.lost(), 0);
    if (GetParam() == Engine::forward) {
      EXPECT_EQ(audit.absorbed + audit.escaped - audit.roulette, audit.emitted);
    } else {
      EXPECT_NEAR(audit.balance_error(), 0, 5 * audit.balance_std_error + 1e-7);
    }
  }
};

INSTANTIATE_TEST_SUITE_P(Engines, IonFlux, ::testing::Values(Engine::forward, Engine::automatic),
                         [](const auto& info) {
                           return info.param == Engine::forward ? "forward" : "gather_forward";
                         });

TEST_P(IonFlux, OnAFlatWaferHasTheMeanYieldOfTheLobe) {
  for (const double power : {3.0, 50.0, 500.0}) {
    const Species ions{.name = "ion",
                       .source = {.cosine_power = power},
                       .ions = Ions{.energy = EnergyDistribution::gaussian(100, 0)},
                       .yields = {sputter}};
    const Shape shape = exact::flat_wafer(16, 4);
    const FluxField flux = trace(shape, ions, {.rays = 1 << 16});
    ASSERT_EQ(flux.tallies.size(), 2U);
    EXPECT_EQ(flux.tallies[1].quantity, Tally::Quantity::yield);
    // Density (n + 1) cos^n(theta) sin(theta) of the polar angle.
    double expected = 0;
    constexpr int steps = 100'000;
    for (int k = 0; k < steps; ++k) {
      const double theta = right_angle * (k + 0.5) / steps;
      expected += right_angle / steps * (power + 1) * std::pow(std::cos(theta), power) *
                  std::sin(theta) * 0.5 * 5 * std::cos(theta) *
                  (1 + 9.3 * std::pow(std::sin(theta), 2));
    }
    const exact::Mean yield = mean_of(shape.mesh, flux.tallies[1], everywhere);
    EXPECT_NEAR(yield.value, expected, 4 * yield.error + 1e-4 * expected) << power;
    EXPECT_GT(yield.error, 0);
    EXPECT_EQ(flux.audit.escaped, 0);
    expect_balance(flux.audit);
  }
}

TEST_P(IonFlux, OnAFlatWaferHasTheMeanYieldOfItsEnergies) {
  const Species ions{.name = "ion",
                     .source = {.cosine_power = 1e6},
                     .ions = Ions{.energy = EnergyDistribution::gaussian(100, 40)},
                     .yields = {{.name = "any", .amplitude = 1, .threshold = 100}}};
  double expected = 0;
  constexpr int steps = 100'000;
  for (int k = 0; k < steps; ++k)
    expected += ions.yields[0].at(ions.ions->energy.quantile((k + 0.5) / steps), 0) / steps;
  const Shape shape = exact::flat_wafer(16, 4);
  const exact::Mean yield =
      mean_of(shape.mesh, trace(shape, ions, {.rays = 1 << 16}).tallies[1], everywhere);
  EXPECT_NEAR(yield.value, expected, 4 * yield.error + 1e-6 * expected);
  EXPECT_GT(expected, 20 * yield.error);
}

// What a wide lobe would send away from the wafer is drawn again.
TEST_P(IonFlux, OfALeaningWideLobeAllGoesDown) {
  const Species ions{.name = "ion",
                     .source = {.direction = {std::sin(80 * degree), 0, -std::cos(80 * degree)}},
                     .ions = Ions{}};
  const FluxAudit audit = trace(exact::flat_wafer(16, 4), ions, {.rays = 1 << 12}).audit;
  EXPECT_EQ(audit.escaped, 0);
  expect_balance(audit);
}

TEST_P(IonFlux, OfATiltedNarrowLobeHasTheYieldOfItsAngle) {
  for (const bool rotating : {false, true}) {
    const Species ions{.name = "ion",
                       .source = {.cosine_power = 1e5,
                                  .direction = {std::sin(40 * degree), 0, -std::cos(40 * degree)},
                                  .rotating = rotating},
                       .ions = Ions{.energy = EnergyDistribution::gaussian(100, 0)},
                       .yields = {sputter}};
    const Shape shape = exact::flat_wafer(16, 4);
    const FluxField flux = trace(shape, ions, {.rays = 1 << 16});
    const exact::Mean arrivals = mean_of(shape.mesh, flux.tallies[0], everywhere);
    EXPECT_NEAR(arrivals.value, 1, 4 * arrivals.error + 1e-6);
    const exact::Mean yield = mean_of(shape.mesh, flux.tallies[1], everywhere);
    EXPECT_NEAR(yield.value, sputter.at(100, std::sin(20 * degree)), 4 * yield.error + 1e-4);
  }
}

// Nothing is lost between mirrors: what enters arrives at the bottom with its whole energy, at the
// angle at which it came, whose cosine has the mean (n + 1) / (n + 2).
TEST_P(IonFlux, BetweenMirrorsReachesTheBottom) {
  Shape shape = exact::trench(5);
  const auto normals = facet_normals(shape.mesh);
  for (const Vec3f& n : normals) shape.mesh.materials.push_back(n.z > 0.5F ? 1 : 0);
  const YieldLaw square_root{.name = "any", .amplitude = 1};
  const YieldLaw upright{.name = "upright", .amplitude = 1, .factor = AngleTable([](double theta) {
                                                              return std::cos(theta);
                                                            })};
  const Species ions{.name = "ion",
                     .source = {.cosine_power = 3},
                     .sticking = {0, 1},
                     .ions = Ions{.energy = EnergyDistribution::gaussian(81, 0)},
                     .yields = {square_root, upright}};
  const auto at_bottom = [](Vec3d r) { return r.z < -99.99; };
  for (const bool two_dimensional : {false, true}) {
    const FluxField flux =
        trace(shape, ions, {.two_dimensional = two_dimensional, .rays = 1 << 18});
    const exact::Mean bottom = mean_of(shape.mesh, flux.tallies[0], at_bottom);
    EXPECT_NEAR(bottom.value, 1, 4 * bottom.error);
    EXPECT_NEAR(mean_of(shape.mesh, flux.tallies[1], at_bottom).value, 9 * bottom.value, 1e-5);
    const exact::Mean yield = mean_of(shape.mesh, flux.tallies[2], at_bottom);
    EXPECT_NEAR(yield.value, 9 * 0.8, 4 * yield.error) << two_dimensional;
    EXPECT_LT(yield.error, 0.05);
    EXPECT_EQ(flux.audit.escaped, 0);
    expect_balance(flux.audit);
  }
}

// Of a lobe so narrow that all come at 45 degrees.
TEST_P(IonFlux, SticksByItsAngleAndItsMaterial) {
  const Shape shape = exact::flat_wafer(16, 4);
  const Species ions{
      .name = "ion",
      .source = {.cosine_power = 1e6, .direction = {std::sqrt(0.5), 0, -std::sqrt(0.5)}},
      .sticking = {0.5F},
      .ions = Ions{.sticking = sticking_between(30 * degree, 90 * degree)}};
  FluxOptions options{.rays = 1 << 12};
  options.sides.boundary = {Boundary::periodic, Boundary::periodic};
  const FluxAudit audit = trace(shape, ions, options).audit;
  EXPECT_NEAR(audit.absorbed / audit.emitted, 0.5 * 0.75, 1e-3);
  EXPECT_NEAR(audit.escaped / audit.emitted, 1 - 0.5 * 0.75, 1e-3);
}

// With a yield that is the same for all, the yields are the arrivals, later ones included.
TEST_P(IonFlux, CountsYieldsByTheWeightThatArrives) {
  const Shape shape = exact::trench(2);
  const Species ions{.name = "ion",
                     .source = {.cosine_power = 3},
                     .sticking = {0.5F},
                     .ions = Ions{.energy = EnergyDistribution::gaussian(81, 0)},
                     .yields = {{.name = "any", .amplitude = 1}}};
  const FluxField flux = trace(shape, ions, {.rays = 1 << 14});
  for (std::size_t f = 0; f < shape.mesh.triangles.size(); ++f)
    EXPECT_NEAR(flux.tallies[1].mean[f], 9 * flux.tallies[0].mean[f], 1e-4) << f;
}

// Upright ions meet the walls of a trench only after its bottom, which sends them all around with
// half of their energy on average: a few have enough for the yield.
TEST_P(IonFlux, IsReflectedInAConeWithTheSpreadOfItsEnergy) {
  Shape shape = exact::trench(1);
  for (const Vec3f& n : facet_normals(shape.mesh)) shape.mesh.materials.push_back(n.z > 0.5F);
  const YieldLaw law{.name = "any", .amplitude = 1, .threshold = 60};
  const Species ions{.name = "ion",
                     .source = {.cosine_power = 1e6},
                     .sticking = {1, 0},
                     .ions = Ions{.energy = EnergyDistribution::gaussian(100, 0),
                                  .cone = AngleTable(right_angle),
                                  .energy_kept = AngleTable(0.5),
                                  .energy_deviation = 0.1},
                     .yields = {law}};
  const FluxField flux = trace(shape, ions, {.rays = 1 << 17});
  const auto wall = [](Vec3d r) { return r.z > -9 && r.z < -1; };
  double expected = 0;
  constexpr int steps = 10'000;
  for (int k = 0; k < steps; ++k)
    expected += law.at(100 * (0.5 + 0.1 * standard_normal((k + 0.5) / steps)), 0) / steps;
  const exact::Mean arrivals = mean_of(shape.mesh, flux.tallies[0], wall);
  const exact::Mean yield = mean_of(shape.mesh, flux.tallies[1], wall);
  EXPECT_GT(arrivals.value, 20 * arrivals.error);
  EXPECT_NEAR(yield.value / arrivals.value, expected, 4 * yield.error / arrivals.value);
  EXPECT_GT(expected, 4 * yield.error / arrivals.value);
}

TEST_P(IonFlux, StaysWhereItsEnergyEnds) {
  const Shape shape = exact::trench(2);
  Species ions{.name = "ion",
               .source = {.cosine_power = 20},
               .sticking = {0.25F},
               .ions = Ions{.energy = EnergyDistribution::gaussian(100, 0),
                            .energy_kept = AngleTable(0.5),
                            .least_energy = 60}};
  const FluxField stopped = trace(shape, ions, {.rays = 1 << 12});
  EXPECT_EQ(stopped.audit.escaped, 0);
  expect_balance(stopped.audit);
  ions.ions->least_energy = 20;  // 100, 50, 25 eV
  EXPECT_GT(trace(shape, ions, {.rays = 1 << 12}).segments, stopped.segments);
}

// The angle of incidence is that in space, not that in the cross-section.
TEST_P(IonFlux, IsTheSameInTwoDimensions) {
  const Shape shape = exact::trench(2, 4, 8, 10);
  const FluxField space = trace(shape, plasma_ions(), {.rays = 1 << 19});
  const FluxField plane =
      trace(shape, plasma_ions(), {.two_dimensional = true, .rays = 1 << 19, .seed = 2});
  for (const double z : {0.0, -5.0, -20.0, -35.0, -40.0}) {
    const auto near = [z](Vec3d r) { return std::abs(r.z - z) < 3; };
    for (const std::size_t tally : {0U, 1U}) {
      const exact::Mean a = mean_of(shape.mesh, space.tallies[tally], near);
      const exact::Mean b = mean_of(shape.mesh, plane.tallies[tally], near);
      EXPECT_NEAR(a.value, b.value, 4 * std::hypot(a.error, b.error)) << z << " " << tally;
      EXPECT_GT(a.value, 5 * a.error);
    }
  }
}

TEST_P(IonFlux, OfATurningWaferFallsOnAllSidesAlike) {
  const Shape shape = exact::trench(1, 4, 8, 10);
  Species ions = plasma_ions();
  ions.source.cosine_power = 2000;
  ions.source.direction = {std::sin(45 * degree), 0, -std::cos(45 * degree)};
  const auto wall = [&](const FluxField& flux, double side) {
    return mean_of(shape.mesh, flux.tallies[0],
                   [side](Vec3d r) { return r.x * side > 9.99 && r.z < -0.01; });
  };
  FluxOptions options{.rays = 1 << 17};
  options.sides.boundary = {Boundary::periodic, Boundary::periodic};
  const FluxField still = trace(shape, ions, options);
  EXPECT_GT(wall(still, 1).value, 5 * wall(still, -1).value);
  ions.source.rotating = true;
  const FluxField turning = trace(shape, ions, options);
  const exact::Mean right = wall(turning, 1);
  const exact::Mean left = wall(turning, -1);
  EXPECT_NEAR(right.value, left.value, 4 * std::hypot(right.error, left.error));
}

TEST_P(IonFlux, OfValuesThatMakeNoSenseIsRefused) {
  using ::testing::HasSubstr;
  const Shape wafer = exact::flat_wafer(16, 4);
  const auto expect = [&](const Species& species, const std::string& message) {
    EXPECT_THAT([&] { trace(wafer, species, {.rays = 32}); },
                ::testing::ThrowsMessage<InputError>(HasSubstr("species ion: " + message)));
  };
  const auto ion = [](const Ions& ions) { return Species{.name = "ion", .ions = ions}; };
  for (const double wrong : {-0.1, 1.1}) {
    expect(ion({.sticking = AngleTable(wrong)}), "the sticking of ions leaves [0, 1]");
    expect(ion({.energy_kept = AngleTable(wrong)}), "the part of the energy that is kept leaves");
    expect(ion({.energy_deviation = wrong}), "the deviation of the energy that is kept");
  }
  for (const double wrong : {-0.1, 1.6})
    expect(ion({.cone = AngleTable(wrong)}), "the cone of reflection is wider");
  for (const YieldLaw& wrong :
       {YieldLaw{.name = "y", .amplitude = -1}, YieldLaw{.name = "y", .threshold = -1},
        YieldLaw{.name = "y", .factor = AngleTable(-1)}}) {
    expect({.name = "ion", .ions = Ions{}, .yields = {wrong}}, "yield y is negative somewhere");
  }
  expect({.name = "ion", .yields = {sputter}}, "only ions have yields");
  for (const Vec3d wrong : {Vec3d{0, 0, 1}, Vec3d{0, 0, -2}, Vec3d{1, 0, 0}})
    expect({.name = "ion", .source = {.direction = wrong}}, "the source has to point down");
}

TEST_P(IonFlux, DoesNotDependOnTheNumberOfThreads) {
  const Shape shape = exact::hole(2);
  std::vector<FluxField> runs;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    runs.push_back(trace(shape, plasma_ions(), {.rays = 100'000}));
  }
  for (const FluxField& run : runs) {
    for (const std::size_t tally : {0U, 1U}) {
      EXPECT_EQ(run.tallies[tally].mean, runs[0].tallies[tally].mean);
      EXPECT_EQ(run.tallies[tally].std_error, runs[0].tallies[tally].std_error);
    }
    EXPECT_EQ(run.segments, runs[0].segments);
  }
}

}  // namespace
}  // namespace scarp
