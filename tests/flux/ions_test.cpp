#include "flux/ions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "core/running_statistics.h"
#include "flux/solve.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

using exact::Shape;

constexpr double degree = std::numbers::pi / 180;
constexpr double right_angle = 90 * degree;

double at_angle(const AngleTable& table, double theta) {
  return table.at(AngleTable::half_sine(std::cos(theta)));
}

TEST(Reflection, KeepsTheEnergyOfBelen) {
  const AngleTable kept = kept_energy(89 * degree, 10);
  const double expected[][2]{{60, 0.0174}, {70, 0.0814}, {75, 0.1624},
                             {80, 0.3096}, {85, 0.5676}, {88, 0.8029}};
  for (const auto& [theta, part] : expected)
    EXPECT_NEAR(at_angle(kept, theta * degree), part, 1e-4) << theta;
  EXPECT_NEAR(at_angle(kept, 89 * degree), 0.8990, 1e-3);
  EXPECT_NEAR(at_angle(kept, right_angle), 1, 1e-6);
}

TEST(Reflection, SticksBelowOneAngleAndNeverAboveAnother) {
  const AngleTable sticking = sticking_between(70 * degree, 90 * degree);
  EXPECT_EQ(at_angle(sticking, 0), 1);
  EXPECT_NEAR(at_angle(sticking, 69.9 * degree), 1, 1e-6);
  EXPECT_NEAR(at_angle(sticking, 80 * degree), 0.5, 1e-4);
  EXPECT_NEAR(at_angle(sticking, right_angle), 0, 1e-6);
  EXPECT_EQ(at_angle(sticking_between(40 * degree, 60 * degree), 80 * degree), 0);
}

TEST(Reflection, OpensTheConeForSteepIons) {
  const AngleTable cone = reflection_cone(80 * degree);
  EXPECT_NEAR(at_angle(cone, 0), right_angle, 1e-6);
  EXPECT_NEAR(at_angle(cone, 50 * degree), 40 * degree, 1e-5);
  EXPECT_NEAR(at_angle(cone, 85 * degree), 10 * degree, 1e-5);
}

// Means over many draws of (cos phi, cos^2 phi, x about the axis) against the density
// cos(pi / 2 phi / cone) sin(phi).
TEST(Reflection, HasTheDensityOfTheCone) {
  const Vec3d n{0, 0, 1};
  const Vec3d d = normalized(Vec3d{1e-9, 0, -1});
  for (const double cone : {5 * degree, 40 * degree, right_angle}) {
    double norm = 0;
    double first = 0;
    double second = 0;
    constexpr int steps = 20'000;
    for (int k = 0; k < steps; ++k) {
      const double phi = cone * (k + 0.5) / steps;
      const double density = std::cos(right_angle * phi / cone) * std::sin(phi);
      norm += density;
      first += density * std::cos(phi);
      second += density * std::pow(std::cos(phi), 2);
    }
    RandomStream random({.seed = 1});
    RunningStatistics height;
    RunningStatistics square;
    RunningStatistics across;
    RunningStatistics x;
    RunningStatistics y;
    for (int k = 0; k < 200'000; ++k) {
      const Vec3d u = sample_reflection(d, n, cone, random);
      ASSERT_NEAR(length(u), 1, 1e-12);
      height.add(u.z);
      square.add(u.z * u.z);
      across.add(u.x * u.x - u.y * u.y);
      x.add(u.x);
      y.add(u.y);
    }
    EXPECT_NEAR(height.mean(), first / norm, 4 * height.std_error() + 1e-6) << cone;
    EXPECT_NEAR(square.mean(), second / norm, 4 * square.std_error() + 1e-6) << cone;
    EXPECT_NEAR(across.mean(), 0, 4 * across.std_error() + 1e-7) << cone;
    EXPECT_NEAR(x.mean(), 0, 4 * x.std_error() + 1e-7) << cone;
    EXPECT_NEAR(y.mean(), 0, 4 * y.std_error() + 1e-7) << cone;
  }
}

TEST(Reflection, WithoutAConeIsAMirrorAndNeverEntersTheSolid) {
  RandomStream random({.seed = 2});
  const Vec3d n = normalized(Vec3d{1, 2, 2});
  const Vec3d d = normalized(Vec3d{0.3, -0.2, -1});
  const Vec3d mirrored = sample_reflection(d, n, 0, random);
  EXPECT_NEAR(dot(mirrored, n), -dot(d, n), 1e-14);
  EXPECT_NEAR(length(cross(mirrored - d, n)), 0, 1e-14);

  const Vec3d glancing = normalized(cross(n, Vec3d{0, 0, 1}) - 0.01 * n);
  for (int k = 0; k < 10'000; ++k)
    ASSERT_GT(dot(sample_reflection(glancing, n, 80 * degree, random), n), 0);
}

// About a specular direction that is `elevation` above the plane the height of a direction is
// cos(phi) sin(elevation) + sin(phi) cos(elevation) cos(azimuth); its mean without the sign.
TEST(Reflection, MirrorsWhatWouldEnterTheSolid) {
  constexpr double elevation = 2 * degree;
  constexpr double cone = 40 * degree;
  constexpr int steps = 1000;
  double norm = 0;
  double expected = 0;
  for (int k = 0; k < steps; ++k) {
    const double phi = cone * (k + 0.5) / steps;
    const double density = std::cos(right_angle * phi / cone) * std::sin(phi);
    for (int j = 0; j < steps; ++j) {
      const double azimuth = 2 * std::numbers::pi * (j + 0.5) / steps;
      norm += density;
      expected += density * std::abs(std::cos(phi) * std::sin(elevation) +
                                     std::sin(phi) * std::cos(elevation) * std::cos(azimuth));
    }
  }
  RandomStream random({.seed = 4});
  const Vec3d n{0, 0, 1};
  const Vec3d d{std::cos(elevation), 0, -std::sin(elevation)};
  RunningStatistics height;
  for (int k = 0; k < 100'000; ++k) height.add(sample_reflection(d, n, cone, random).z);
  EXPECT_NEAR(height.mean(), expected / norm, 4 * height.std_error());
}

TEST(Reflection, LeavesThePlaneAlsoOfAFlightAlongIt) {
  RandomStream random({.seed = 5});
  const Vec3d u = sample_reflection({1, 0, 0}, {0, 0, 1}, 0, random);
  EXPECT_NEAR(u.z, 1e-6, 1e-12);
  EXPECT_NEAR(length(u), 1, 1e-14);
}

TEST(Reflection, KeepsAPartOfTheEnergyBetweenNothingAndAll) {
  RandomStream random({.seed = 3});
  RunningStatistics middle;
  RunningStatistics low;
  RunningStatistics high;
  for (int k = 0; k < 100'000; ++k) {
    middle.add(sample_kept_energy(0.5, 0.1, random));
    low.add(sample_kept_energy(0, 0.1, random));
    high.add(sample_kept_energy(1, 0.1, random));
  }
  EXPECT_NEAR(middle.mean(), 0.5, 4 * middle.std_error());
  // Half a normal distribution.
  EXPECT_NEAR(low.mean(), 0.1 * std::sqrt(2 / std::numbers::pi), 4 * low.std_error() + 1e-5);
  EXPECT_NEAR(high.mean(), 1 - 0.1 * std::sqrt(2 / std::numbers::pi), 4 * high.std_error() + 1e-5);
  EXPECT_EQ(sample_kept_energy(0.3, 0, random), 0.3);
}

TEST(Yield, FollowsTheSquareRootLaw) {
  const YieldLaw law{.name = "sputter",
                     .amplitude = 0.0337,
                     .threshold = 20,
                     .factor = AngleTable([](double theta) { return std::cos(theta); })};
  const double upright = AngleTable::half_sine(1);
  EXPECT_NEAR(law.at(100, upright), 0.0337 * (10 - std::sqrt(20.0)), 1e-7);
  EXPECT_EQ(law.at(19, upright), 0);
  EXPECT_NEAR(law.at(100, AngleTable::half_sine(0.5)) / law.at(100, upright), 0.5, 1e-5);
}

// --- traced ------------------------------------------------------------------------------------

FluxField trace(const Shape& shape, const Species& species, FluxOptions options) {
  options.sides.lower = shape.sides.lower;
  options.sides.upper = shape.sides.upper;
  options.spacing = 1;
  return solve_flux(shape.mesh, {&species, 1}, options).front();
}

// Mean of a tally over the facets that are taken, by area; the error as if facets were independent.
struct Mean {
  double value = 0;
  double error = 0;
};

template <class Taken>
Mean mean_of(const TriMesh& mesh, const Tally& tally, const Taken& taken) {
  const std::vector<double> areas = facet_areas(mesh);
  Mean mean;
  double area = 0;
  for (std::size_t f = 0; f < areas.size(); ++f) {
    const auto [a, b, c] = corners(mesh, f);
    if (!taken((a + b + c) / 3.0)) continue;
    mean.value += areas[f] * tally.mean[f];
    mean.error += std::pow(areas[f] * tally.std_error[f], 2);
    area += areas[f];
  }
  return {mean.value / area, std::sqrt(mean.error) / area};
}

bool everywhere(Vec3d) { return true; }

const YieldLaw sputter{.name = "sputter",
                       .amplitude = 0.5,
                       .threshold = 25,
                       .factor = AngleTable([](double theta) {
                         return std::cos(theta) * (1 + 9.3 * std::pow(std::sin(theta), 2));
                       })};

TEST(IonFlux, OnAFlatWaferHasTheMeanYieldOfTheLobe) {
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
    const Mean yield = mean_of(shape.mesh, flux.tallies[1], everywhere);
    EXPECT_NEAR(yield.value, expected, 4 * yield.error + 1e-4 * expected) << power;
    EXPECT_GT(yield.error, 0);
    EXPECT_EQ(flux.audit.absorbed, flux.audit.emitted);
  }
}

TEST(IonFlux, OnAFlatWaferHasTheMeanYieldOfItsEnergies) {
  const Species ions{.name = "ion",
                     .source = {.cosine_power = 1e6},
                     .ions = Ions{.energy = EnergyDistribution::gaussian(100, 40)},
                     .yields = {{.name = "any", .amplitude = 1, .threshold = 100}}};
  double expected = 0;
  constexpr int steps = 10'000;
  for (int k = 0; k < steps; ++k)
    expected += ions.yields[0].at(ions.ions->energy.quantile((k + 0.5) / steps), 0) / steps;
  const Shape shape = exact::flat_wafer(16, 4);
  const Mean yield =
      mean_of(shape.mesh, trace(shape, ions, {.rays = 1 << 16}).tallies[1], everywhere);
  EXPECT_NEAR(yield.value, expected, 4 * yield.error);
  EXPECT_GT(expected, 20 * yield.error);
}

// What a wide lobe would send away from the wafer is drawn again.
TEST(IonFlux, OfALeaningWideLobeAllGoesDown) {
  const Species ions{.name = "ion",
                     .source = {.direction = {std::sin(80 * degree), 0, -std::cos(80 * degree)}},
                     .ions = Ions{}};
  const FluxAudit audit = trace(exact::flat_wafer(16, 4), ions, {.rays = 1 << 12}).audit;
  EXPECT_EQ(audit.absorbed, audit.emitted);
}

TEST(IonFlux, OfATiltedNarrowLobeHasTheYieldOfItsAngle) {
  for (const bool rotating : {false, true}) {
    const Species ions{.name = "ion",
                       .source = {.cosine_power = 1e5,
                                  .direction = {std::sin(40 * degree), 0, -std::cos(40 * degree)},
                                  .rotating = rotating},
                       .ions = Ions{.energy = EnergyDistribution::gaussian(100, 0)},
                       .yields = {sputter}};
    const Shape shape = exact::flat_wafer(16, 4);
    const FluxField flux = trace(shape, ions, {.rays = 1 << 16});
    const Mean arrivals = mean_of(shape.mesh, flux.tallies[0], everywhere);
    EXPECT_NEAR(arrivals.value, 1, 4 * arrivals.error + 1e-6);
    const Mean yield = mean_of(shape.mesh, flux.tallies[1], everywhere);
    EXPECT_NEAR(yield.value, sputter.at(100, std::sin(20 * degree)), 4 * yield.error + 1e-4);
  }
}

// Nothing is lost between mirrors: what enters arrives at the bottom with its whole energy, at the
// angle at which it came, whose cosine has the mean (n + 1) / (n + 2).
TEST(IonFlux, BetweenMirrorsReachesTheBottom) {
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
        trace(shape, ions, {.two_dimensional = two_dimensional, .rays = 1 << 17});
    const Mean bottom = mean_of(shape.mesh, flux.tallies[0], at_bottom);
    EXPECT_NEAR(bottom.value, 1, 4 * bottom.error);
    EXPECT_NEAR(mean_of(shape.mesh, flux.tallies[1], at_bottom).value, 9 * bottom.value, 1e-5);
    const Mean yield = mean_of(shape.mesh, flux.tallies[2], at_bottom);
    EXPECT_NEAR(yield.value, 9 * 0.8, 4 * yield.error) << two_dimensional;
    EXPECT_LT(yield.error, 0.05);
    EXPECT_EQ(flux.audit.absorbed + flux.audit.escaped - flux.audit.roulette, flux.audit.emitted);
    EXPECT_EQ(flux.audit.escaped, 0);
  }
}

// Of a lobe so narrow that all come at 45 degrees.
TEST(IonFlux, SticksByItsAngleAndItsMaterial) {
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
TEST(IonFlux, CountsYieldsByTheWeightThatArrives) {
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
TEST(IonFlux, IsReflectedInAConeWithTheSpreadOfItsEnergy) {
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
  const Mean arrivals = mean_of(shape.mesh, flux.tallies[0], wall);
  const Mean yield = mean_of(shape.mesh, flux.tallies[1], wall);
  EXPECT_GT(arrivals.value, 20 * arrivals.error);
  EXPECT_NEAR(yield.value / arrivals.value, expected, 4 * yield.error / arrivals.value);
  EXPECT_GT(expected, 4 * yield.error / arrivals.value);
}

TEST(IonFlux, StaysWhereItsEnergyEnds) {
  const Shape shape = exact::trench(2);
  Species ions{.name = "ion",
               .source = {.cosine_power = 20},
               .sticking = {0.25F},
               .ions = Ions{.energy = EnergyDistribution::gaussian(100, 0),
                            .energy_kept = AngleTable(0.5),
                            .least_energy = 60}};
  const FluxField stopped = trace(shape, ions, {.rays = 1 << 12});
  EXPECT_EQ(stopped.segments, stopped.rays);
  EXPECT_EQ(stopped.audit.absorbed, stopped.audit.emitted);
  ions.ions->least_energy = 20;  // 100, 50, 25 eV
  EXPECT_GT(trace(shape, ions, {.rays = 1 << 12}).segments, stopped.rays);
}

Species plasma_ions() {
  return {.name = "ion",
          .source = {.cosine_power = 50},
          .ions = Ions{.energy = EnergyDistribution::gaussian(100, 10),
                       .sticking = sticking_between(70 * degree, 90 * degree),
                       .cone = reflection_cone(80 * degree),
                       .energy_kept = kept_energy(89 * degree, 10),
                       .energy_deviation = 0.1,
                       .least_energy = 10},
          .yields = {sputter}};
}

// The angle of incidence is that in space, not that in the cross-section.
TEST(IonFlux, IsTheSameInTwoDimensions) {
  const Shape shape = exact::trench(2, 4, 8, 10);
  const FluxField space = trace(shape, plasma_ions(), {.rays = 1 << 19});
  const FluxField plane =
      trace(shape, plasma_ions(), {.two_dimensional = true, .rays = 1 << 19, .seed = 2});
  for (const double z : {0.0, -5.0, -20.0, -35.0, -40.0}) {
    const auto near = [z](Vec3d r) { return std::abs(r.z - z) < 3; };
    for (const std::size_t tally : {0U, 1U}) {
      const Mean a = mean_of(shape.mesh, space.tallies[tally], near);
      const Mean b = mean_of(shape.mesh, plane.tallies[tally], near);
      EXPECT_NEAR(a.value, b.value, 4 * std::hypot(a.error, b.error)) << z << " " << tally;
      EXPECT_GT(a.value, 5 * a.error);
    }
  }
}

TEST(IonFlux, OfATurningWaferFallsOnAllSidesAlike) {
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
  const Mean right = wall(turning, 1);
  const Mean left = wall(turning, -1);
  EXPECT_NEAR(right.value, left.value, 4 * std::hypot(right.error, left.error));
}

TEST(IonFlux, OfValuesThatMakeNoSenseIsRefused) {
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

TEST(IonFlux, IsTracedForwardWhateverTheEngine) {
  const Shape shape = exact::trench(2);
  std::vector<FluxField> runs;
  for (const auto engine : {FluxOptions::Engine::automatic, FluxOptions::Engine::forward,
                            FluxOptions::Engine::gather}) {
    runs.push_back(trace(shape, plasma_ions(), {.engine = engine, .rays = 1 << 12}));
  }
  for (const FluxField& run : runs) {
    EXPECT_EQ(run.engine, FluxEngine::forward);
    EXPECT_EQ(run.tallies[1].mean, runs[0].tallies[1].mean);
  }
}

TEST(IonFlux, DoesNotDependOnTheNumberOfThreads) {
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
