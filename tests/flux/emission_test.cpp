// Particles that facets send out of their own, with both engines.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "core/running_statistics.h"
#include "tests/flux/ion_traces.h"

namespace scarp {
namespace {

using exact::Shape;
using Engine = FluxOptions::Engine;

/// So much per area where it is wanted; nothing from above unless said otherwise.
template <class Taken>
Species emitter(const Shape& shape, float sticking, float strength, const Taken& taken) {
  Species species{
      .name = "atoms", .source = {.kind = SourceLobe::Kind::none}, .sticking = {sticking}};
  for (std::size_t f = 0; f < shape.mesh.triangles.size(); ++f) {
    const auto [a, b, c] = corners(shape.mesh, f);
    species.emission.push_back(taken((a + b + c) / 3.0) ? strength : 0.0F);
  }
  return species;
}

bool is_inside(Vec3d r) { return r.z < -1e-3; }

/// Two walls that meet at an angle, alike along y.
Shape groove(double depth) {
  constexpr double half = 10;
  constexpr double length = 8;
  exact::Builder builder;
  builder.grid({-half, 0, 0}, {half, 0, -depth}, 16, {0, length, 0}, 2);
  builder.grid({0, 0, -depth}, {half, 0, depth}, 16, {0, length, 0}, 2);
  return {builder.mesh, {.lower = {-half, 0}, .upper = {half, length}}};
}

class Emission : public ::testing::TestWithParam<Engine> {};

/// The mean over a part of the surface of runs with several seeds.
template <class Taken>
RunningStatistics over_seeds(const Shape& shape, const Species& species, FluxOptions options,
                             const Taken& taken) {
  RunningStatistics found;
  for (options.seed = 1; options.seed <= 12; ++options.seed) {
    const FluxField flux = exact::trace(shape, species, options);
    EXPECT_EQ(flux.audit.lost(), 0);
    EXPECT_NEAR(flux.audit.balance_error(), 0, 4 * flux.audit.balance_std_error + 1e-7);
    found.add(exact::mean_of(shape.mesh, flux.arrivals(), taken).value);
  }
  return found;
}

// Of two long walls that meet at an angle of twice alpha each sees 1 - sin(alpha) of the other.
TEST_P(Emission, OfAGrooveReachesTheOtherWall) {
  for (const double depth : {5.0, 20.0}) {
    const Shape shape = groove(depth);
    const double expected = 0.7 * (1 - 10 / std::hypot(10, depth));
    const Species atoms = emitter(shape, 1, 0.7F, is_inside);
    for (const bool two_dimensional : {false, true}) {
      const RunningStatistics found = over_seeds(
          shape, atoms, {.engine = GetParam(), .two_dimensional = two_dimensional, .rays = 1 << 14},
          is_inside);
      EXPECT_NEAR(found.mean(), expected, 4 * found.std_error()) << depth;
      EXPECT_LT(found.std_error(), 5e-3 * expected);
    }
  }
}

// One wall alone: what it emits arrives on the other.
TEST_P(Emission, OfOneWallOfAGrooveArrivesOnTheOther) {
  const Shape shape = groove(20);
  const auto left = [](Vec3d r) { return r.x < 0; };
  const auto right = [](Vec3d r) { return r.x > 0; };
  const Species atoms = emitter(shape, 1, 0.7F, left);
  const FluxOptions options{.engine = GetParam(), .rays = 1 << 14};
  const RunningStatistics found = over_seeds(shape, atoms, options, right);
  EXPECT_NEAR(found.mean(), 0.7 * (1 - 10 / std::hypot(10, 20)), 4 * found.std_error());
  EXPECT_EQ(over_seeds(shape, atoms, options, left).mean(), 0);
}

// Every point of a sphere sees every part of it alike: with f the part that is missing, what is
// emitted all over arrives all over as F = (1 - f) G / (1 - (1 - s) (1 - f)).
TEST_P(Emission, OfASphericalPitArrivesAllOver) {
  struct Case {
    double cut;
    float sticking;
    SourceLobe::Kind kind;
  };
  for (const Case c : {Case{0, 1, SourceLobe::Kind::none}, Case{0.5, 0.2F, SourceLobe::Kind::none},
                       Case{0.5, 0.2F, SourceLobe::Kind::cosine}}) {
    const Shape pit = exact::spherical_pit(c.cut);
    Species atoms = emitter(pit, c.sticking, 2, is_inside);
    atoms.source.kind = c.kind;
    const double missing = (1 - c.cut) / 2;
    const double from_above = c.kind == SourceLobe::Kind::none ? 0 : missing;
    const double expected =
        (from_above + 2 * (1 - missing)) / (1 - (1 - c.sticking) * (1 - missing));
    const auto bottom = [&](Vec3d r) { return r.z < -7 - 10 * c.cut; };
    const auto rim = [](Vec3d r) { return r.z < -0.01 && r.z > -4; };
    const FluxOptions options{.engine = GetParam(), .rays = 1 << 14};
    const RunningStatistics low = over_seeds(pit, atoms, options, bottom);
    const RunningStatistics high = over_seeds(pit, atoms, options, rim);
    EXPECT_NEAR(low.mean(), expected, 4 * low.std_error() + 0.01 * expected) << c.cut;
    EXPECT_NEAR(high.mean(), expected, 4 * high.std_error() + 0.01 * expected) << c.cut;
    EXPECT_LT(low.std_error(), 0.01 * expected);
  }
}

// Emitted = taken up again + escaped, and most of it on a bottom that is deep.
TEST_P(Emission, IsConserved) {
  const Shape shape = exact::trench(2);
  const auto bottom = [](Vec3d r) { return r.z < -39.9; };
  const Species atoms = emitter(shape, 0.4F, 3, bottom);
  const FluxField flux =
      exact::trace(shape, atoms, {.engine = GetParam(), .rays = 1 << 16, .seed = 5});
  const FluxAudit& audit = flux.audit;
  EXPECT_EQ(audit.lost(), 0);
  EXPECT_NEAR((audit.absorbed + audit.escaped - audit.roulette) / audit.emitted, 1,
              4 * audit.balance_std_error + 1e-9);
  EXPECT_GT(audit.escaped, 0);
  double absorbed = 0;
  double squares = 0;
  const std::vector<double> areas = facet_areas(shape.mesh);
  for (std::size_t f = 0; f < areas.size(); ++f) {
    absorbed += 0.4 * areas[f] * flux.arrivals().mean[f];
    squares += std::pow(0.4 * areas[f] * flux.arrivals().std_error[f], 2);
  }
  const double emitted = 3.0 * 20 * 8;
  EXPECT_NEAR(absorbed / emitted, audit.absorbed / audit.emitted, 1e-5);
  EXPECT_LT(std::sqrt(squares) / emitted, 0.01);
}

TEST_P(Emission, DoesNotDependOnTheNumberOfThreads) {
  const Shape shape = exact::trench(2);
  const Species atoms = emitter(shape, 0.4F, 1, is_inside);
  std::vector<FluxField> runs;
  for (const int threads : {1, 3}) {
    const ThreadLimit limit(threads);
    runs.push_back(exact::trace(shape, atoms, {.engine = GetParam(), .rays = 1 << 15}));
  }
  EXPECT_EQ(runs[0].arrivals().mean, runs[1].arrivals().mean);
  EXPECT_EQ(runs[0].arrivals().std_error, runs[1].arrivals().std_error);
}

INSTANTIATE_TEST_SUITE_P(Engines, Emission, ::testing::Values(Engine::forward, Engine::gather),
                         [](const auto& info) {
                           return info.param == Engine::forward ? "forward" : "gather";
                         });

// On all facets within the errors that they state.
TEST(EmissionEngines, AgreeAndStateTrueErrors) {
  const Shape shape = exact::hole(1, 11, 2);
  Species atoms = emitter(shape, 0.3F, 1, [](Vec3d r) { return r.z < -10; });
  for (const auto kind : {SourceLobe::Kind::none, SourceLobe::Kind::cosine}) {
    atoms.source.kind = kind;
    const auto trace = [&](Engine engine, std::uint64_t rays) {
      return exact::trace(shape, atoms, {.engine = engine, .rays = rays});
    };
    const FluxField forward = trace(Engine::forward, 1 << 18);
    const FluxField gathered = trace(Engine::gather, 1 << 17);
    EXPECT_EQ(gathered.engine, FluxEngine::gather);
    double squares = 0;
    int count = 0;
    for (std::size_t f = 0; f < shape.mesh.triangles.size(); ++f) {
      const double error =
          std::hypot(forward.arrivals().std_error[f], gathered.arrivals().std_error[f]);
      if (error == 0 || error > 0.2 * gathered.arrivals().mean[f]) continue;
      const double z = (forward.arrivals().mean[f] - gathered.arrivals().mean[f]) / error;
      EXPECT_LT(std::abs(z), 6) << f;
      squares += z * z;
      ++count;
    }
    ASSERT_GT(count, 300);
    EXPECT_NEAR(squares / count, 1, 0.1 + 5 * std::sqrt(2.0 / count));
    EXPECT_NEAR(forward.audit.escaped / forward.audit.emitted,
                gathered.audit.escaped / gathered.audit.emitted, 5e-3);
  }
  // There is no exchange under a source that leans.
  atoms.source.direction = normalized(Vec3d{0.1, 0, -1});
  atoms.source.rotating = true;
  EXPECT_EQ(exact::trace(shape, atoms, {.rays = 32}).engine, FluxEngine::forward);
}

TEST(EmissionTarget, IsReached) {
  const Shape shape = exact::trench(2, 4, 8, 10);
  const Species atoms = emitter(shape, 0.5F, 1, is_inside);
  for (const Engine engine : {Engine::forward, Engine::gather}) {
    const FluxField flux = exact::trace(shape, atoms, {.engine = engine, .target_error = 0.02});
    EXPECT_TRUE(flux.target_reached());
    EXPECT_LE(flux.error, 0.02);
  }
}

TEST(EmissionEngines, NothingArrivesOfNothing) {
  const Shape wafer = exact::flat_wafer(20, 2);
  const Species atoms = emitter(wafer, 1, 0, exact::everywhere);
  for (const Engine engine : {Engine::automatic, Engine::forward, Engine::gather}) {
    const FluxField flux = exact::trace(wafer, atoms, {.engine = engine});
    EXPECT_EQ(flux.arrivals().mean, std::vector<float>(8));
    EXPECT_EQ(flux.arrivals().std_error, std::vector<float>(8));
    EXPECT_EQ(flux.arrivals().patch_mean.size(), flux.arrivals().patch_std_error.size());
    EXPECT_FALSE(flux.arrivals().patch_mean.empty());
    EXPECT_EQ(flux.audit.balance_error(), 0);
    EXPECT_EQ(flux.audit.balance_std_error, 0);
    EXPECT_TRUE(flux.target_reached());

    // The same where the sticking follows what arrives, as that of what desorbs in a cycle.
    const StickingFeedback feedback{.species = {true}, .update = [](auto, auto&) { return false; }};
    const FluxOptions options{.engine = engine, .sides = wafer.sides, .spacing = 1};
    const FluxField fed = solve_flux(wafer.mesh, {&atoms, 1}, options, feedback).front();
    EXPECT_EQ(fed.arrivals().mean, std::vector<float>(8));
    EXPECT_EQ(fed.audit.balance_error(), 0);
    EXPECT_EQ(fed.audit.balance_std_error, 0);
  }
}

/// The atoms that follow from what arrives: half of it on facets that are taken.
struct Followed {
  std::vector<FluxField> flux;
  std::vector<float> emission;
};

template <class Taken>
Followed follow(const Shape& shape, float sticking, const FluxOptions& options,
                const Taken& taken) {
  const Species gas{.name = "gas", .sticking = {1}};
  const Species atoms{
      .name = "atoms", .source = {.kind = SourceLobe::Kind::none}, .sticking = {sticking}};
  // The one that follows need not be the last.
  const std::vector<Species> species{atoms, gas};
  Followed result;
  SurfaceEmission emission{.species = {true, false}};
  emission.of = [&](std::span<const std::span<const float>> flux) {
    EXPECT_EQ(flux.size(), 2U);
    for (std::size_t f = 0; f < flux[1].size(); ++f) {
      const auto [a, b, c] = corners(shape.mesh, f);
      result.emission.push_back(taken((a + b + c) / 3.0) ? 0.5F * flux[1][f] : 0.0F);
    }
    return std::vector<std::vector<float>>{result.emission};
  };
  FluxOptions all = options;
  all.sides = shape.sides;
  all.spacing = 1;
  result.flux = solve_flux(shape.mesh, species, all, {}, emission);
  return result;
}

// As if the emission that follows had been known from the beginning, to the last bit.
TEST(SurfaceEmissionTest, IsThatOfWhatArrives) {
  const Shape shape = exact::trench(2);
  for (const Engine engine : {Engine::forward, Engine::gather}) {
    const FluxOptions options{
        .engine = engine, .sides = shape.sides, .spacing = 1, .rays = 1 << 15};
    const Followed found = follow(shape, 0.4F, options, is_inside);
    EXPECT_FALSE(found.emission.empty());
    Species atoms{.name = "atoms",
                  .source = {.kind = SourceLobe::Kind::none},
                  .sticking = {0.4F},
                  .emission = found.emission};
    const FluxField known = solve_flux(shape.mesh, {&atoms, 1}, options).front();
    EXPECT_EQ(found.flux[0].arrivals().mean, known.arrivals().mean);
    EXPECT_EQ(found.flux[0].arrivals().std_error, known.arrivals().std_error);
    // What the gas sent out has arrived or left.
    const FluxAudit& audit = found.flux[0].audit;
    EXPECT_NEAR(audit.balance_error(), 0, 4 * audit.balance_std_error + 1e-9);
  }
}

TEST(SurfaceEmissionTest, OfNothingIsNothing) {
  const Shape shape = exact::trench(2);
  const Followed found = follow(shape, 1, {.rays = 1 << 12}, [](Vec3d) { return false; });
  for (const float mean : found.flux[0].arrivals().mean) EXPECT_EQ(mean, 0);
  EXPECT_GT(found.flux[1].arrivals().mean.front(), 0);
}

TEST(EmissionInput, IsRefusedWithAClearText) {
  using testing::HasSubstr;
  const Shape wafer = exact::flat_wafer(20, 2);
  const auto message = [&](const Species& species) {
    try {
      exact::trace(wafer, species, {.rays = 32});
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const auto with = [&](std::vector<float> emission) {
    return Species{.name = "atoms",
                   .source = {.kind = SourceLobe::Kind::none},
                   .emission = std::move(emission)};
  };
  const std::size_t count = wafer.mesh.triangles.size();
  std::vector<float> some(count, 1.0F);
  EXPECT_EQ(message(with(some)), "accepted");
  EXPECT_THAT(message(with({})), HasSubstr("species atoms: it has no source: nothing comes"));
  EXPECT_EQ(message(with(std::vector<float>(count))), "accepted");
  EXPECT_THAT(message(with({1})), HasSubstr("emission has 1 entries for 8 facets"));
  some[3] = -1;
  EXPECT_THAT(message(with(some)), HasSubstr("negative or not finite"));
  some[3] = std::numeric_limits<float>::infinity();
  EXPECT_THAT(message(with(some)), HasSubstr("negative or not finite"));
  some[3] = 1;
  Species ions = with(some);
  ions.ions = Ions{};
  EXPECT_THAT(message(ions), HasSubstr("only neutrals can be emitted"));
}

}  // namespace
}  // namespace scarp
