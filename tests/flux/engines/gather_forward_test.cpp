#include "flux/engines/gather_forward.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "core/running_statistics.h"
#include "tests/flux/calibration.h"
#include "tests/flux/direct_flux.h"
#include "tests/flux/ion_traces.h"
#include "tests/flux/polar_tables.h"

namespace scarp {
namespace {

using exact::degree;
using exact::plasma_ions;
using exact::Shape;
using Engine = FluxOptions::Engine;

/// The mean of a quantity over a triangle.
template <class Quantity>
double mean_on(const std::array<Vec3d, 3>& triangle, const Quantity& quantity) {
  constexpr int steps = 8;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      const Vec3d weights = sample_triangle({(i + 0.5) / steps, (j + 0.5) / steps});
      sum += quantity(weights.x * triangle[0] + weights.y * triangle[1] + weights.z * triangle[2]);
    }
  }
  return sum / (steps * steps);
}

/// All stick where they arrive; yields of a constant angular factor and of a cosine.
Species straight_ions(double power) {
  return {.name = "ion",
          .source = {.cosine_power = power},
          .ions = Ions{.energy = EnergyDistribution::gaussian(100, 25)},
          .yields = {{.name = "any", .amplitude = 1, .threshold = 60},
                     {.name = "upright",
                      .amplitude = 1,
                      .threshold = 60,
                      .factor = AngleTable([](double theta) { return std::cos(theta); })}}};
}

// Of a normal distribution.
double mean_strength(double mean, double deviation, double threshold) {
  constexpr int steps = 100'000;
  double sum = 0;
  double norm = 0;
  for (int k = 0; k < steps; ++k) {
    const double x = -6 + 12 * (k + 0.5) / steps;
    const double E = mean + deviation * x;
    if (E < 0) continue;
    const double density = std::exp(-x * x / 2);
    norm += density;
    sum += density * std::max(0.0, std::sqrt(E) - std::sqrt(threshold));
  }
  return sum / norm;
}

class FirstArrivalsInATrench : public ::testing::TestWithParam<double> {};

// On the bottom the cosine of a particle's angle turns a source of power n into one of n + 1 with
// (n + 1) / (n + 2) of its strength.
TEST_P(FirstArrivalsInATrench, AreTheClosedForm) {
  const double power = GetParam();
  const double strength = mean_strength(100, 25, 60);
  const Shape shape = exact::trench(4, 4, 8, 40);
  const auto normals = facet_normals(shape.mesh);
  const auto on_field = [&](std::size_t f) {
    const auto [a, b, c] = corners(shape.mesh, f);
    return a.z + b.z + c.z > -1e-6;
  };
  const auto exact_flux = [&](std::size_t f, double power_there) {
    return mean_on(corners(shape.mesh, f), [&](Vec3d r) {
      return exact::direct_trench_flux(r, Vec3d(normals[f]), power_there);
    });
  };
  std::vector<std::size_t> inside;
  std::vector<std::size_t> bottom;
  std::vector<double> arrivals;
  std::vector<double> upright;
  for (std::size_t f = 0; f < normals.size(); ++f) {
    if (on_field(f)) continue;
    inside.push_back(f);
    arrivals.push_back(exact_flux(f, power));
    if (normals[f].z < 0.5F) continue;
    bottom.push_back(f);
    upright.push_back(strength * (power + 1) / (power + 2) * exact_flux(f, power + 1));
  }
  for (const bool two_dimensional : {false, true}) {
    std::vector<exact::Stated> of_arrivals;
    std::vector<exact::Stated> of_upright;
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      const FluxField flux =
          exact::trace(shape, straight_ions(power),
                       {.two_dimensional = two_dimensional, .rays = 1 << 17, .seed = seed});
      EXPECT_EQ(flux.segments, flux.rays);  // nothing goes on
      EXPECT_NEAR(flux.audit.balance_error(), 0, 5 * flux.audit.balance_std_error);
      const Tally& mean = flux.tallies[0];
      const Tally& any = flux.tallies[1];
      for (std::size_t f = 0; f < normals.size(); ++f) {
        EXPECT_NEAR(any.mean[f], strength * mean.mean[f], 3e-5 * any.mean[f]);
        if (on_field(f)) {
          EXPECT_NEAR(mean.mean[f], 1, 1e-6);
        } else {
          ASSERT_GT(mean.std_error[f], 0);
        }
      }
      of_arrivals.push_back(at_places(exact::on_facets(mean), inside));
      of_upright.push_back(at_places(exact::on_facets(flux.tallies[2]), bottom));
    }
    exact::expect_true(exact::calibration_of(of_arrivals, arrivals), "arrivals");
    exact::expect_true(exact::calibration_of(of_upright, upright), "yield on the bottom");
  }
}

INSTANTIATE_TEST_SUITE_P(Powers, FirstArrivalsInATrench, ::testing::Values(20.0, 100.0, 500.0));

/// What runs with several seeds find on a facet; the error is the larger of what they say and what
/// their spread says, which misses what is too rare for them all.
struct Found {
  double mean = 0;
  double error = 0;
};

Found over_seeds(const std::vector<FluxField>& runs, std::size_t tally, std::size_t facet) {
  RunningStatistics found;
  double squares = 0;
  for (const FluxField& run : runs) {
    found.add(run.tallies[tally].mean[facet]);
    squares += std::pow(run.tallies[tally].std_error[facet], 2);
  }
  const double stated = std::sqrt(squares) / static_cast<double>(runs.size());
  return {found.mean(), std::max(found.std_error(), stated)};
}

/// All together inside the feature.
RunningStatistics inside(const TriMesh& mesh, const std::vector<FluxField>& runs,
                         std::size_t tally) {
  RunningStatistics result;
  for (const FluxField& run : runs)
    result.add(exact::mean_of(mesh, run.tallies[tally], [](Vec3d r) { return r.z < -1e-3; }).value);
  return result;
}

struct Case {
  const char* name;
  double aspect_ratio = 2;
  double power = 500;
  double tilt = 0;  // degrees
  bool rotating = false;
  bool two_dimensional = false;
  bool is_hole = false;
  Boundary boundary = Boundary::reflective;
  bool re_emits = false;   // a neutral instead
  bool tabulated = false;  // a ring of directions and two peaks of energy instead of the power
  bool mapped = false;     // the source gets brighter towards a corner
};

Shape shape_of(const Case& c) {
  return c.is_hole ? exact::hole(c.aspect_ratio, 11, 2) : exact::trench(c.aspect_ratio);
}

Species ions_of(const Case& c) {
  Species ions = plasma_ions();
  ions.source = {.cosine_power = c.power,
                 .direction = {std::sin(c.tilt * degree), 0, -std::cos(c.tilt * degree)},
                 .rotating = c.rotating};
  if (c.tabulated) {
    ions.source.table = exact::polar_table(
        [](double theta) { return 1 - std::abs(theta - 12 * degree) / (9 * degree); });
    ions.ions->energy = EnergyDistribution::bimodal(100, 120);
  }
  if (c.mapped) {
    const Sides sides = shape_of(c).sides;
    ions.source.map = SourceMap(std::array{sides.lower[0], sides.upper[0]},
                                std::array{sides.lower[1], sides.upper[1]},
                                std::array{0.1, 0.5, 1.0, 3.0}, sides);
  }
  if (c.re_emits) return {.name = "gas", .source = ions.source, .sticking = {0.6F}};
  return ions;
}

// A slit between plates above a floor, with the borders of its light within facets.
Shape floor_below_a_slit() {
  constexpr double half = 2.3;
  constexpr Vec3d y{0, 1, 0};
  exact::Builder builder;
  for (const double from : {-8.0, half}) {
    const Vec3d plate{8 - half, 0, 0};
    builder.grid({from, 0, 0}, plate, 6, y, 1);
    builder.grid({from, 0, -0.5}, y, 1, plate, 6);
  }
  builder.grid({-half, 0, -0.5}, y, 1, {0, 0, 0.5}, 1);
  builder.grid({half, 0, -0.5}, {0, 0, 0.5}, 1, y, 1);
  builder.grid({-8, 0, -4}, {16, 0, 0}, 16, y, 1);
  return {builder.mesh, {.lower = {-8, 0}, .upper = {8, 1}}};
}

// With a few rays from each facet, the balance hangs on the two where light ends.
TEST(BalanceOfFewRays, IsOffByWhatIsStated) {
  const Shape shape = floor_below_a_slit();
  constexpr int runs = 100;
  for (const std::uint64_t rays : {std::uint64_t{300}, std::uint64_t{3000}}) {
    double squares = 0;
    double stated = 0;
    int beyond = 0;
    for (std::uint64_t seed = 1; seed <= runs; ++seed) {
      const FluxAudit audit = exact::trace(shape, straight_ions(1000),
                                           {.two_dimensional = true, .rays = rays, .seed = seed})
                                  .audit;
      squares += std::pow(audit.balance_error(), 2);
      stated += std::pow(audit.balance_std_error, 2);
      beyond += std::abs(audit.balance_error()) > 4 * audit.balance_std_error ? 1 : 0;
    }
    EXPECT_LE(beyond, runs / 100) << rays;
    EXPECT_GT(stated, 0.8 * squares) << rays;
    EXPECT_LT(stated, 4 * squares) << rays;
  }
}

class BothEngines : public ::testing::TestWithParam<Case> {};

TEST_P(BothEngines, AgreeOnAllFacetsWithinTheirErrors) {
  const Case& c = GetParam();
  const Shape shape = shape_of(c);
  const Species ions = ions_of(c);
  constexpr int seeds = 12;
  std::vector<FluxField> forward;
  std::vector<FluxField> gathered;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    FluxOptions options{.engine = Engine::forward,
                        .two_dimensional = c.two_dimensional,
                        .rays = 1 << 16,
                        .seed = seed};
    options.sides.boundary = {c.boundary, c.boundary};
    forward.push_back(exact::trace(shape, ions, options));
    options.engine = Engine::automatic;
    options.rays = 1 << 15;
    gathered.push_back(exact::trace(shape, ions, options));
  }
  ASSERT_EQ(gathered[0].tallies.size(), forward[0].tallies.size());
  for (std::size_t tally = 0; tally < forward[0].tallies.size(); ++tally) {
    double squares = 0;
    int count = 0;
    for (std::size_t f = 0; f < shape.mesh.triangles.size(); ++f) {
      const Found a = over_seeds(forward, tally, f);
      const Found b = over_seeds(gathered, tally, f);
      const double error = std::hypot(a.error, b.error);
      // Where fewer arrive the differences are not normally distributed.
      if (error == 0 || error > 0.3 * std::max(a.mean, b.mean)) continue;
      const double z = (a.mean - b.mean) / error;
      EXPECT_LT(std::abs(z), 7) << tally << " " << f;
      squares += z * z;
      ++count;
    }
    ASSERT_GT(count, 50);
    EXPECT_LT(squares / count, 1 + 5 * std::sqrt(2.0 / count)) << tally;
    EXPECT_GT(squares / count, 0.5) << tally;
    const RunningStatistics a = inside(shape.mesh, forward, tally);
    const RunningStatistics b = inside(shape.mesh, gathered, tally);
    EXPECT_NEAR(a.mean(), b.mean(), 5 * std::hypot(a.std_error(), b.std_error())) << tally;
  }
  RunningStatistics difference;
  for (int k = 0; k < seeds; ++k) {
    const FluxAudit& audit = gathered[k].audit;
    EXPECT_EQ(audit.lost(), 0);
    EXPECT_NEAR(audit.balance_error(), 0, 5 * audit.balance_std_error + 1e-7);
    difference.add(audit.escaped / audit.emitted -
                   forward[k].audit.escaped / forward[k].audit.emitted);
  }
  EXPECT_NEAR(difference.mean(), 0, 5 * difference.std_error());
}

INSTANTIATE_TEST_SUITE_P(
    Cases, BothEngines,
    ::testing::Values(
        Case{.name = "trench"}, Case{.name = "deep_trench", .aspect_ratio = 6},
        Case{.name = "hole", .is_hole = true}, Case{.name = "wide", .power = 3},
        Case{.name = "cross_section", .two_dimensional = true},
        Case{.name = "leaning_periodic", .power = 100, .tilt = 30, .boundary = Boundary::periodic},
        Case{.name = "leaning_to_mirrors", .power = 100, .tilt = 30},
        Case{.name = "leaning_cross_section", .power = 100, .tilt = 30, .two_dimensional = true},
        Case{.name = "turning", .power = 100, .tilt = 40, .rotating = true},
        Case{.name = "turning_cross_section",
             .power = 100,
             .tilt = 40,
             .rotating = true,
             .two_dimensional = true,
             .boundary = Boundary::periodic},
        Case{.name = "leaning_neutral",
             .power = 10,
             .tilt = 20,
             .boundary = Boundary::periodic,
             .re_emits = true},
        Case{.name = "mapped", .power = 20, .mapped = true},
        Case{.name = "mapped_leaning_to_mirrors", .power = 100, .tilt = 30, .mapped = true},
        Case{.name = "mapped_hole_neutral",
             .aspect_ratio = 1,
             .power = 1,
             .is_hole = true,
             .boundary = Boundary::periodic,
             .re_emits = true,
             .mapped = true},
        Case{.name = "tabulated", .tabulated = true},
        Case{.name = "tabulated_turning", .tilt = 40, .rotating = true, .tabulated = true},
        Case{.name = "tabulated_leaning_neutral",
             .tilt = 20,
             .two_dimensional = true,
             .boundary = Boundary::periodic,
             .re_emits = true,
             .tabulated = true}),
    [](const auto& info) { return info.param.name; });

TEST(GatherForward, FollowsIonsUnlessForwardIsWanted) {
  const Shape shape = exact::trench(2);
  const auto run = [&](Engine engine) {
    return exact::trace(shape, plasma_ions(), {.engine = engine, .rays = 1 << 12});
  };
  EXPECT_EQ(run(Engine::forward).engine, FluxEngine::forward);
  EXPECT_EQ(run(Engine::automatic).engine, FluxEngine::gather_forward);
  EXPECT_EQ(run(Engine::gather).engine, FluxEngine::gather_forward);
  EXPECT_EQ(run(Engine::gather).tallies[1].mean, run(Engine::automatic).tallies[1].mean);
}

class StatedErrors : public ::testing::TestWithParam<Case> {};

TEST_P(StatedErrors, AreTrue) {
  const Case& c = GetParam();
  const Shape shape = shape_of(c);
  const Species ions = ions_of(c);
  // So few reach the bottom of a hole that the onward part is known well from many alone: a value
  // and its error rise together with their number.
  const std::uint64_t rays = std::uint64_t{1} << (c.is_hole ? 16 : 13);
  std::array<std::vector<exact::Stated>, 2> on_facets;
  std::array<std::vector<exact::Stated>, 2> on_patches;
  for (std::uint64_t seed = 1; seed <= 64; ++seed) {
    const FluxField flux = exact::trace(
        shape, ions, {.two_dimensional = c.two_dimensional, .rays = rays, .seed = seed});
    for (const std::size_t tally : {0U, 1U}) {
      on_facets[tally].push_back(exact::on_facets(flux.tallies[tally]));
      on_patches[tally].push_back(exact::on_patches(flux.tallies[tally]));
    }
  }
  for (const std::size_t tally : {0U, 1U}) {
    const std::string number = std::to_string(tally);
    exact::expect_true(exact::calibration_of(on_facets[tally]), "facets, tally " + number);
    exact::expect_true(exact::calibration_of(on_patches[tally]), "patches, tally " + number);
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, StatedErrors,
                         ::testing::Values(Case{.name = "trench", .aspect_ratio = 3},
                                           Case{.name = "hole", .is_hole = true},
                                           Case{.name = "turning_cross_section",
                                                .power = 100,
                                                .tilt = 40,
                                                .rotating = true,
                                                .two_dimensional = true}),
                         [](const auto& info) { return info.param.name; });

TEST(GatherForward, ReachesTheTargetWithFewerFlights) {
  Species ions = plasma_ions();
  ions.source.cosine_power = 500;
  for (const double aspect_ratio : {2.0, 6.0}) {
    const Shape shape = exact::trench(aspect_ratio);
    const FluxField flux = exact::trace(shape, ions, {.target_error = 0.02});
    EXPECT_TRUE(flux.target_reached());
    EXPECT_LE(flux.error, 0.02);
    EXPECT_GT(flux.error, 0.01);
    const FluxField forward =
        exact::trace(shape, ions, {.engine = Engine::forward, .target_error = 0.02});
    EXPECT_GT(forward.segments, 5 * flux.segments);
  }
}

// Few rays at grazing angles bring most of what the walls of a trench receive then.
TEST(GatherForward, LeavesWhatComesAlongTheWaferToParticles) {
  const Shape shape = exact::trench(1);
  Species ions = plasma_ions();
  ions.source.cosine_power = 20;
  const auto run = [&](double tilt, Engine engine) {
    ions.source.direction = {std::sin(tilt), 0, -std::cos(tilt)};
    return exact::trace(shape, ions,
                        {.engine = engine,
                         .sides = {.boundary = {Boundary::periodic, Boundary::periodic}},
                         .target_error = 0.02});
  };
  EXPECT_EQ(run(0.5, Engine::automatic).engine, FluxEngine::gather_forward);
  const FluxField particles = run(1.3, Engine::automatic);
  EXPECT_EQ(particles.engine, FluxEngine::forward);
  EXPECT_TRUE(particles.target_reached());
  const FluxField rays = run(1.3, Engine::gather);
  EXPECT_EQ(rays.engine, FluxEngine::gather_forward);
  EXPECT_GT(rays.segments, 2 * particles.segments);
}

TEST(GatherForward, StopsWhereNoElementSendsMore) {
  const Shape shape = exact::trench(0.5, 4, 4, 3);
  Species ions = plasma_ions();
  ions.ions->sticking = AngleTable(1);
  const FluxField flux =
      solve_flux(shape.mesh, {&ions, 1}, {.sides = shape.sides, .spacing = 8, .target_error = 1e-9})
          .front();
  EXPECT_EQ(flux.missed_by, RayCap::elements);
  EXPECT_LT(flux.rays, FluxOptions{}.max_rays / 2);
}

// Walls of 45 degrees, and a lobe that hardly ever grazes them: in the first rounds nothing goes
// on, and how many particles it takes is not known.
TEST(GatherForward, SendsFewParticlesWhereNearlyAllSticks) {
  exact::Builder builder;
  builder.grid({-10, 0, 0}, {10, 0, -10}, 8, {0, 8, 0}, 4);
  builder.grid({0, 0, -10}, {10, 0, 10}, 8, {0, 8, 0}, 4);
  const Shape valley{builder.mesh, {.lower = {-10, 0}, .upper = {10, 8}}};
  Species ions = plasma_ions();
  ions.ions->sticking = AngleTable([](double theta) { return theta < 85 * degree ? 1 : 0; });
  ions.source.cosine_power = 30;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const FluxField flux =
        exact::trace(valley, ions, {.target_error = 1e-4, .max_rays = 1U << 22, .seed = seed});
    EXPECT_TRUE(flux.target_reached());
    EXPECT_LT(flux.rays, 1U << 20) << seed;
  }
}

TEST(GatherForward, SaysThatATargetIsOutOfReach) {
  const FluxField flux =
      exact::trace(exact::trench(2), plasma_ions(), {.target_error = 1e-6, .max_rays = 100'000});
  EXPECT_EQ(flux.missed_by, RayCap::rays);
  EXPECT_LE(flux.rays, 100'000U);
  EXPECT_GT(flux.rays, 50'000U);
  const FluxField small =
      exact::trace(exact::trench(2), plasma_ions(),
                   {.target_error = 1e-6, .max_rays = 100'000, .memory_limit = 400'000});
  EXPECT_EQ(small.missed_by, RayCap::memory);
  EXPECT_LT(small.rays, 100'000U);
}

TEST(GatherForward, ToATargetDoesNotDependOnTheNumberOfThreads) {
  const Shape shape = exact::hole(2, 11, 5);
  std::vector<FluxField> runs;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    runs.push_back(exact::trace(shape, plasma_ions(), {.target_error = 0.05}));
  }
  for (const FluxField& run : runs) {
    for (const std::size_t tally : {0U, 1U}) {
      EXPECT_EQ(run.tallies[tally].mean, runs[0].tallies[tally].mean);
      EXPECT_EQ(run.tallies[tally].std_error, runs[0].tallies[tally].std_error);
    }
    EXPECT_EQ(run.segments, runs[0].segments);
    EXPECT_EQ(run.audit.absorbed, runs[0].audit.absorbed);
  }
}

}  // namespace
}  // namespace scarp
