#include "flux/solve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"
#include "core/parallel.h"
#include "core/running_statistics.h"
#include "flux/rays/ray_scene.h"
#include "tests/flux/reference_bins.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

using exact::Shape;

FluxField solve(const Shape& shape, const Species& species, FluxOptions options) {
  options.sides.lower = shape.sides.lower;
  options.sides.upper = shape.sides.upper;
  options.spacing = options.spacing > 0 ? options.spacing : 1;
  return solve_flux(shape.mesh, {&species, 1}, options).front();
}

Species gas(float sticking, double power = 1) {
  return {.name = "gas", .source = {.cosine_power = power}, .sticking = {sticking}};
}

using Engine = FluxOptions::Engine;

struct FlatCase {
  Engine engine;
  float sticking;
  double power;
};

class FlatWafer : public ::testing::TestWithParam<FlatCase> {};

TEST_P(FlatWafer, ReceivesTheSourceFluxWhateverTheLobe) {
  const Shape wafer = exact::flat_wafer(20, 5);
  const FluxField flux = solve(wafer, gas(GetParam().sticking, GetParam().power),
                               {.engine = GetParam().engine, .rays = 1 << 18, .seed = 7});
  const Tally& arrivals = flux.arrivals();
  for (std::size_t f = 0; f < wafer.mesh.triangles.size(); ++f)
    EXPECT_NEAR(arrivals.mean[f], 1, 5 * arrivals.std_error[f] + 1e-6) << "facet " << f;
  EXPECT_EQ(flux.audit.lost(), 0);
  EXPECT_NEAR(flux.audit.balance_error(), 0, 5 * flux.audit.balance_std_error + 1e-6);
  EXPECT_LT(flux.error, 0.02);
}

INSTANTIATE_TEST_SUITE_P(
    Lobes, FlatWafer,
    ::testing::Values(FlatCase{Engine::forward, 1, 1}, FlatCase{Engine::forward, 0.1F, 1},
                      FlatCase{Engine::forward, 0, 1}, FlatCase{Engine::forward, 1, 0},
                      FlatCase{Engine::forward, 0.5F, 10}, FlatCase{Engine::forward, 1, 1000},
                      FlatCase{Engine::gather, 0.1F, 1}, FlatCase{Engine::gather, 0, 1},
                      FlatCase{Engine::gather, 1, 0}, FlatCase{Engine::gather, 0.5F, 10},
                      FlatCase{Engine::gather, 1, 1000}));

struct Mean {
  double value = 0;
  double std_error = 0;
};

// The mean flux over some facets, with the error from independent seeds.
Mean mean_over(const std::vector<FluxField>& runs, const std::vector<std::uint32_t>& facets,
               const std::vector<double>& areas) {
  Mean mean;
  std::vector<double> values;
  for (const FluxField& run : runs) {
    double sum = 0;
    double area = 0;
    for (const std::uint32_t f : facets) {
      sum += run.arrivals().mean[f] * areas[f];
      area += areas[f];
    }
    values.push_back(sum / area);
    mean.value += values.back() / static_cast<double>(runs.size());
  }
  for (const double value : values) mean.std_error += (value - mean.value) * (value - mean.value);
  const auto n = static_cast<double>(runs.size());
  mean.std_error = std::sqrt(mean.std_error / (n * (n - 1)));
  return mean;
}

void expect_reference_flux(const std::string& name, const Shape& shape, double aspect_ratio,
                           double sticking, FluxOptions options) {
  std::vector<FluxField> runs;
  for (options.seed = 1; options.seed <= 10; ++options.seed) {
    runs.push_back(solve(shape, gas(static_cast<float>(sticking)), options));
    EXPECT_EQ(runs.back().audit.lost(), 0);
    const FluxAudit& audit = runs.back().audit;
    EXPECT_NEAR(audit.balance_error(), 0, 5 * audit.balance_std_error);
  }
  const std::vector<double> areas = facet_areas(shape.mesh);
  const auto bins = exact::reference_bins(name, aspect_ratio, sticking);
  ASSERT_EQ(bins.size(), 15U);
  for (const exact::ReferenceBin& bin : bins) {
    const auto facets = exact::facets_in(bin, shape.mesh, name);
    ASSERT_FALSE(facets.empty());
    const Mean mean = mean_over(runs, facets, areas);
    EXPECT_NEAR(mean.value, bin.flux, 4 * mean.std_error + 0.01 * bin.flux)
        << name << " A = " << aspect_ratio << " s = " << sticking << " " << bin.surface << " "
        << bin.from << " error " << mean.std_error;
  }
}

class Reference : public ::testing::TestWithParam<std::tuple<Engine, double, double>> {};

TEST_P(Reference, TrenchGivesTheExactFlux) {
  const auto [engine, aspect_ratio, sticking] = GetParam();
  expect_reference_flux("trench", exact::trench(aspect_ratio), aspect_ratio, sticking,
                        {.engine = engine, .rays = 1 << 13});
}

TEST_P(Reference, TrenchInTwoDimensionsGivesTheSameFlux) {
  const auto [engine, aspect_ratio, sticking] = GetParam();
  expect_reference_flux("trench", exact::trench(aspect_ratio, 4, 4), aspect_ratio, sticking,
                        {.engine = engine, .two_dimensional = true, .rays = 1 << 13});
}

TEST_P(Reference, HoleGivesTheExactFlux) {
  const auto [engine, aspect_ratio, sticking] = GetParam();
  expect_reference_flux("hole", exact::hole(aspect_ratio), aspect_ratio, sticking,
                        {.engine = engine, .rays = 1 << 13});
}

INSTANTIATE_TEST_SUITE_P(Forward, Reference,
                         ::testing::Combine(::testing::Values(Engine::forward),
                                            ::testing::Values(2.0), ::testing::Values(1.0, 0.1)));
INSTANTIATE_TEST_SUITE_P(Gather, Reference,
                         ::testing::Combine(::testing::Values(Engine::gather),
                                            ::testing::Values(1.0, 5.0),
                                            ::testing::Values(1.0, 0.1)));

class SlowReference : public ::testing::TestWithParam<std::tuple<Engine, double, double>> {};

TEST_P(SlowReference, TrenchAndHoleGiveTheExactFlux) {
  const auto [engine, aspect_ratio, sticking] = GetParam();
  // The walls of a deep hole are cut into more pieces, which take their least sets first.
  const std::uint64_t rays = aspect_ratio > 10 ? 1 << 20 : 1 << 17;
  const FluxOptions options{.engine = engine, .rays = rays};
  expect_reference_flux("trench", exact::trench(aspect_ratio), aspect_ratio, sticking, options);
  expect_reference_flux("hole", exact::hole(aspect_ratio), aspect_ratio, sticking, options);
}

INSTANTIATE_TEST_SUITE_P(Cases, SlowReference,
                         ::testing::Combine(::testing::Values(Engine::forward, Engine::gather),
                                            ::testing::Values(1.0, 2.0, 5.0),
                                            ::testing::Values(1.0, 0.5, 0.1, 0.01)));
INSTANTIATE_TEST_SUITE_P(Deep, SlowReference,
                         ::testing::Combine(::testing::Values(Engine::gather),
                                            ::testing::Values(0.5, 10.0, 20.0),
                                            ::testing::Values(1.0, 0.5, 0.1, 0.01)));

// Every point of a sphere sees every part of it alike, so the flux in a pit is the same all over:
// with f the part of the sphere that is missing, F = f / (1 - (1 - s) (1 - f)).
TEST(SphericalPit, HasTheSameFluxAllOver) {
  struct Case {
    double cut;
    float sticking;
    double flux;
  };
  for (const Case c : {Case{0, 0.5F, 0.66667}, Case{0.5, 0.2F, 0.625}, Case{0.8, 0.1F, 0.52632}}) {
    const Shape pit = exact::spherical_pit(c.cut);
    const std::vector<double> areas = facet_areas(pit.mesh);
    std::vector<std::uint32_t> rim;
    std::vector<std::uint32_t> bottom;
    for (std::uint32_t f = 0; f < areas.size(); ++f) {
      const double z = corners(pit.mesh, f)[0].z;
      if (z < -0.01 && z > -4) rim.push_back(f);
      if (z < -7 - 10 * c.cut) bottom.push_back(f);
    }
    std::vector<FluxField> runs;
    for (std::uint64_t seed = 1; seed <= 10; ++seed)
      runs.push_back(solve(pit, gas(c.sticking), {.rays = 1 << 13, .seed = seed}));
    for (const auto& facets : {rim, bottom}) {
      const Mean mean = mean_over(runs, facets, areas);
      EXPECT_NEAR(mean.value, c.flux, 4 * mean.std_error + 0.01 * c.flux) << "cut " << c.cut;
    }
  }
}

class TargetError : public ::testing::TestWithParam<Engine> {};

TEST_P(TargetError, IsReachedAndTrue) {
  const Shape shape = exact::trench(2, 4, 8, 10);
  const FluxField precise = solve(shape, gas(0.5F), {.engine = Engine::gather, .rays = 1 << 18});
  const std::vector<double> areas = facet_areas(shape.mesh);
  double squares = 0;
  double bars = 0;
  for (std::uint64_t seed = 1; seed <= 16; ++seed) {
    const FluxField flux =
        solve(shape, gas(0.5F), {.engine = GetParam(), .target_error = 0.02, .seed = seed});
    EXPECT_TRUE(flux.target_reached());
    EXPECT_LE(flux.error, 0.02);
    // Not many more rays than needed.
    EXPECT_GT(flux.error, 0.01);
    for (std::size_t f = 0; f < areas.size(); ++f) {
      const double deviation = flux.arrivals().mean[f] - precise.arrivals().mean[f];
      squares += areas[f] * deviation * deviation;
      bars += areas[f] * flux.arrivals().std_error[f] * flux.arrivals().std_error[f];
    }
  }
  EXPECT_NEAR(std::sqrt(squares / bars), 1, 0.25);
}

TEST_P(TargetError, OutOfReachIsSaid) {
  const FluxField flux = solve(exact::trench(2), gas(0.5F),
                               {.engine = GetParam(), .target_error = 1e-6, .max_rays = 100'000});
  EXPECT_EQ(flux.missed_by, RayCap::rays);
  EXPECT_LE(flux.rays, 100'000U);
  EXPECT_GT(flux.rays, 50'000U);
}

INSTANTIATE_TEST_SUITE_P(Engines, TargetError, ::testing::Values(Engine::forward, Engine::gather));

class Engines : public ::testing::TestWithParam<Engine> {};

TEST_P(Engines, DoNotDependOnTheNumberOfThreads) {
  const Shape shape = exact::hole(2);
  std::vector<FluxField> runs;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    runs.push_back(solve(shape, gas(0.2F), {.engine = GetParam(), .rays = 100'000}));
  }
  for (const FluxField& run : runs) {
    EXPECT_EQ(run.arrivals().mean, runs[0].arrivals().mean);
    EXPECT_EQ(run.arrivals().std_error, runs[0].arrivals().std_error);
    EXPECT_EQ(run.segments, runs[0].segments);
    EXPECT_EQ(run.error, runs[0].error);
    EXPECT_EQ(run.audit.absorbed, runs[0].audit.absorbed);
  }
}

TEST_P(Engines, GiveTheSameBetweenPeriodicAndReflectiveSidesOfASymmetricMesh) {
  const Shape shape = exact::trench(2, 4, 8, 10);
  const FluxField mirrored = solve(shape, gas(0.5F), {.engine = GetParam(), .rays = 1 << 17});
  FluxOptions options{.engine = GetParam(), .rays = 1 << 17, .seed = 2};
  options.sides.boundary = {Boundary::periodic, Boundary::periodic};
  const FluxField wrapped = solve(shape, gas(0.5F), options);
  double squares = 0;
  int count = 0;
  for (std::size_t f = 0; f < shape.mesh.triangles.size(); ++f) {
    const double difference = mirrored.arrivals().mean[f] - wrapped.arrivals().mean[f];
    const double error =
        std::hypot(mirrored.arrivals().std_error[f], wrapped.arrivals().std_error[f]);
    if (error == 0) continue;
    squares += difference * difference / (error * error);
    ++count;
  }
  EXPECT_NEAR(std::sqrt(squares / count), 1, 0.15);
}

// A closed bubble under the surface is joined to the source by no path: no flux, no say in the
// error.
TEST_P(Engines, LeaveAVoidAlone) {
  Shape shape = exact::trench(1);
  // Not where sets are about to become a power of two, which have less error than their size says.
  constexpr std::uint64_t rays = 20'000;
  const auto errors = [&] {
    RunningStatistics errors;
    for (std::uint64_t seed = 1; seed <= 16; ++seed)
      errors.add(solve(shape, gas(0.5F), {.engine = GetParam(), .rays = rays, .seed = seed}).error);
    return errors;
  };
  const RunningStatistics without = errors();
  const auto void_begin = shape.mesh.triangles.size();
  const auto v = static_cast<std::uint32_t>(shape.mesh.vertices.size());
  for (const Vec3f r : {Vec3f{-2, 2, -29}, Vec3f{2, 2, -29}, Vec3f{-2, 6, -29}, Vec3f{-2, 2, -25}})
    shape.mesh.vertices.push_back(r);
  for (const Triangle t :
       {Triangle{0, 1, 2}, Triangle{0, 3, 1}, Triangle{1, 3, 2}, Triangle{2, 3, 0}})
    shape.mesh.triangles.push_back({v + t[0], v + t[1], v + t[2]});
  for (const float sticking : {0.5F, 0.0F}) {
    const FluxField flux = solve(shape, gas(sticking), {.engine = GetParam(), .rays = 1 << 14});
    for (std::size_t f = void_begin; f < shape.mesh.triangles.size(); ++f) {
      EXPECT_EQ(flux.arrivals().mean[f], 0);
      EXPECT_EQ(flux.arrivals().std_error[f], 0);
    }
    EXPECT_EQ(flux.audit.lost(), 0);
  }
  const RunningStatistics with = errors();
  const double of_chance = 4 * std::hypot(with.std_error(), without.std_error());
  EXPECT_NEAR(with.mean(), without.mean(), of_chance + 0.05 * without.mean());
  EXPECT_LT(of_chance, 0.1 * without.mean());
}

INSTANTIATE_TEST_SUITE_P(Both, Engines, ::testing::Values(Engine::forward, Engine::gather));

// In a deep hole rays from the walls hardly ever find the source.
TEST(AutomaticEngine, IsTheOneThatTakesFewerFlights) {
  struct Case {
    Shape shape;
    float sticking;
    FluxEngine engine;
  };
  for (const Case& c : {Case{exact::trench(1), 1, FluxEngine::gather},
                        Case{exact::trench(10, 4, 8), 0.1F, FluxEngine::gather},
                        Case{exact::trench(10, 4, 8), 1, FluxEngine::forward},
                        Case{exact::hole(5), 1, FluxEngine::forward}}) {
    const Engine other = c.engine == FluxEngine::gather ? Engine::forward : Engine::gather;
    std::uint64_t taken = 0;
    std::uint64_t by_other = 0;
    // A gathered flux may reach its target early, by chance.
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      FluxOptions options{.target_error = 0.03, .seed = seed};
      const FluxField chosen = solve(c.shape, gas(c.sticking), options);
      EXPECT_EQ(chosen.engine, c.engine) << c.sticking;
      EXPECT_LE(chosen.error, options.target_error);
      taken += chosen.segments;
      options.engine = other;
      by_other += solve(c.shape, gas(c.sticking), options).segments;
    }
    EXPECT_LT(1.5 * static_cast<double>(taken), static_cast<double>(by_other)) << c.sticking;
  }
  // A number of rays says what is counted.
  EXPECT_EQ(solve(exact::trench(10), gas(1), {.rays = 1 << 12}).engine, FluxEngine::gather);
}

TEST(Materials, DecideTheSticking) {
  Shape shape = exact::flat_wafer(20, 2);
  shape.mesh.materials.assign(shape.mesh.triangles.size(), 0);
  for (std::size_t f = 0; f < shape.mesh.materials.size(); f += 2) shape.mesh.materials[f] = 1;
  const Species species{.name = "gas", .sticking = {0.0F, 1.0F}};
  const FluxField flux = solve(shape, species, {.rays = 1 << 14});
  EXPECT_NEAR(flux.audit.absorbed / flux.audit.emitted, 0.5, 0.02);
}

TEST(BadInput, IsRefusedWithAClearText) {
  const Shape wafer = exact::flat_wafer(20, 2);
  const auto message = [&](const Shape& shape, const Species& species, FluxOptions options) {
    options.sides.lower = shape.sides.lower;
    options.sides.upper = shape.sides.upper;
    try {
      solve_flux(shape.mesh, {&species, 1}, options);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  using ::testing::HasSubstr;
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(message(wafer, gas(1.5F), {}), HasSubstr("1.500000 is outside [0, 1]"));
  EXPECT_THAT(message(wafer, gas(-0.1F), {}), HasSubstr("outside [0, 1]"));
  EXPECT_THAT(message(wafer, gas(nan), {}), HasSubstr("outside [0, 1]"));
  EXPECT_THAT(message(wafer, gas(1, nan), {}), HasSubstr("cosine power"));
  EXPECT_THAT(message(wafer, {.name = "gas", .sticking = {}}, {}),
              HasSubstr("sticking is missing"));
  EXPECT_THAT(message(wafer, {.name = ""}, {}), HasSubstr("name is missing"));
  EXPECT_THAT(message(wafer, gas(1), {.target_error = 0}), HasSubstr("flux.target_error"));
  EXPECT_THAT(message(wafer, gas(1), {.target_error = nan}), HasSubstr("flux.target_error"));
  EXPECT_THAT(message(wafer, gas(1), {.max_rays = 0}), HasSubstr("flux.max_rays"));
  EXPECT_THAT(message(wafer, gas(1), {.memory_limit = 10}), HasSubstr("flux.memory_limit"));
  EXPECT_THAT(message(wafer, gas(1), {.spacing = -1}), HasSubstr("spacing"));
  EXPECT_THAT(message({{}, wafer.sides}, gas(1), {}), HasSubstr("no triangles"));
  EXPECT_THAT(message({wafer.mesh, {}}, gas(1), {}), HasSubstr("no width along x"));

  Shape bad = wafer;
  bad.mesh.triangles[3] = {0, 1, 1};
  EXPECT_THAT(message(bad, gas(1), {}), HasSubstr("facet 3"));
  bad = wafer;
  bad.mesh.vertices[2].z = nan;
  EXPECT_THAT(message(bad, gas(1), {}), HasSubstr("flux:"));
  bad = wafer;
  bad.sides.upper[0] = 15;
  EXPECT_THAT(message(bad, gas(1), {}), HasSubstr("lateral sides"));
  bad = wafer;
  bad.mesh.materials.assign(wafer.mesh.triangles.size(), 3);
  EXPECT_THAT(message(bad, gas(1), {}), HasSubstr("material number 3"));
}

}  // namespace
}  // namespace scarp
