// Sticking that follows from what arrives: where the equations have one number for the whole
// surface, and where a solution at fixed sticking tells what is right.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "flux/solve.h"
#include "tests/flux/calibration.h"
#include "tests/flux/ion_traces.h"
#include "tests/flux/shapes.h"

namespace scarp {
namespace {

using Engine = FluxOptions::Engine;

constexpr float bare = 0.9F;  // sticking of a bare surface
constexpr int most_updates = 200;

// Langmuir's balance.
struct Langmuir {
  float strength = 3;  // arrivals over what leaves a covered site, on an open wafer

  // The part that is bare.
  float at(float flux) const { return bare / (1 + strength * flux); }
  std::vector<std::vector<float>> operator()(std::span<const std::span<const float>> flux) const {
    std::vector<float> sticking;
    for (const float arrivals : flux[0]) sticking.push_back(at(arrivals));
    return {sticking};
  }
};
constexpr Langmuir langmuir;

struct Solved {
  std::vector<FluxField> flux;
  std::vector<float> sticking;
  int updates = 0;
};

FluxOptions options_of(const exact::Shape& shape, Engine engine) {
  return {.engine = engine, .sides = shape.sides, .spacing = 1, .rays = 1 << 17, .seed = 7};
}

Solved solve_covered(const exact::Shape& shape, const FluxOptions& options,
                     std::span<const Species> species, const Langmuir& balance = langmuir) {
  Solved solved;
  StickingFeedback feedback{.species = {true}, .sticking_at = balance};
  feedback.update = [&](std::span<const std::span<const float>> flux,
                        std::vector<std::vector<float>>& sticking) {
    ++solved.updates;
    float change = 0;
    const std::vector<float> next = balance(flux).front();
    for (std::size_t f = 0; f < next.size(); ++f)
      change = std::max(change, std::abs(next[f] - sticking[0][f]));
    if (change < 1e-5F || solved.updates == most_updates) return false;
    solved.sticking = sticking[0] = next;
    return true;
  };
  solved.flux = solve_flux(shape.mesh, species, options, feedback);
  return solved;
}

Species gas() { return {.name = "gas", .sticking = {1}}; }

TEST(StickingFeedbackTest, AnOpenWaferFitsAtOnce) {
  const exact::Shape wafer = exact::flat_wafer(20, 5);
  const Species species = gas();
  const Solved solved = solve_covered(wafer, options_of(wafer, Engine::automatic), {&species, 1});
  const std::vector<float>& error = solved.flux.front().arrivals().std_error;
  for (std::size_t f = 0; f < error.size(); ++f) {
    const float flux = solved.flux.front().arrivals().mean[f];
    EXPECT_NEAR(flux, 1, 5 * error[f] + 1e-6);
    EXPECT_NEAR(solved.sticking[f], langmuir.at(flux), 1e-5);
  }
}

// Of a sphere every place sees the opening alike: with the part f of the sphere that is open,
// F = f + (1 - f) (1 - s) F.
TEST(StickingFeedbackTest, ASphericalPitHasTheOneSolutionOfItsEquation) {
  constexpr double cut = 0.5;
  constexpr double open = (1 - cut) / 2;
  double flux = 1;
  for (int n = 0; n < 200; ++n)
    flux = open / (1 - (1 - open) * (1 - langmuir.at(static_cast<float>(flux))));
  EXPECT_LT(flux, 0.7);  // far from that of an open wafer

  const exact::Shape pit = exact::spherical_pit(cut);
  const Species species = gas();
  const Solved solved = solve_covered(pit, options_of(pit, Engine::automatic), {&species, 1});
  const std::vector<double> areas = facet_areas(pit.mesh);
  double sum = 0;
  double area = 0;
  const Tally& arrivals = solved.flux.front().arrivals();
  for (std::size_t f = 0; f < pit.mesh.triangles.size(); ++f) {
    if (pit.mesh.vertices[pit.mesh.triangles[f][0]].z > -5) continue;
    sum += areas[f] * arrivals.mean[f];
    area += areas[f];
  }
  // The facets of the sphere lie a little inside it; few particles on a facet make it bare more
  // often than covered.
  EXPECT_NEAR(sum / area, flux, 0.01 * flux);
}

// Where a few particles more let many more pass, an error at the top is a larger one below. At
// sticking that is held it would be stated as two thirds of what it is, and that of the balance as
// five quarters.
TEST(StickingFeedbackTest, ErrorBarsAreTrue) {
  const exact::Shape trench = exact::trench(6, 4, 8, 10);
  const Species species = gas();
  std::vector<exact::Stated> on_patches;
  std::vector<exact::Stated> of_balance;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    FluxOptions options = options_of(trench, Engine::gather);
    options.rays = 1 << 15;
    options.seed = seed;
    const Solved solved = solve_covered(trench, options, {&species, 1}, {.strength = 30});
    on_patches.push_back(exact::on_patches(solved.flux.front().arrivals()));
    const FluxAudit& audit = solved.flux.front().audit;
    of_balance.push_back({{audit.balance_error()}, {audit.balance_std_error}});
  }
  exact::expect_true(exact::calibration_of(on_patches), "patches");
  exact::expect_true(exact::calibration_of(of_balance, {0}), "balance");
}

TEST(StickingFeedbackTest, TheSameStickingGivesTheSameFluxToTheBit) {
  const exact::Shape trench = exact::trench(2);
  const FluxOptions options = options_of(trench, Engine::automatic);
  const Species species = gas();
  const Solved solved = solve_covered(trench, options, {&species, 1});
  StickingFeedback fixed{.species = {true}, .sticking_at = langmuir};
  fixed.update = [&, first = true](auto, std::vector<std::vector<float>>& sticking) mutable {
    sticking[0] = solved.sticking;
    return std::exchange(first, false);
  };
  const FluxField again = solve_flux(trench.mesh, {&species, 1}, options, fixed).front();
  EXPECT_EQ(solved.flux.front().arrivals().mean, again.arrivals().mean);
  EXPECT_EQ(solved.flux.front().arrivals().std_error, again.arrivals().std_error);
  EXPECT_EQ(solved.flux.front().rays, again.rays);
}

TEST(StickingFeedbackTest, BitsDoNotDependOnThreads) {
  const exact::Shape trench = exact::trench(2);
  const Species species = gas();
  std::vector<std::vector<float>> results;
  for (const int threads : {1, 2, 8}) {
    const ThreadLimit limit(threads);
    const Solved solved =
        solve_covered(trench, options_of(trench, Engine::automatic), {&species, 1});
    results.push_back(solved.flux.front().arrivals().mean);
  }
  EXPECT_EQ(results[0], results[1]);
  EXPECT_EQ(results[0], results[2]);
}

// Two ways to the same: on each patch within four standard errors, and forward the sticking fits
// the particles that reach the target.
TEST(StickingFeedbackTest, BothEnginesFindTheSame) {
  const exact::Shape trench = exact::trench(2);
  const Species species = gas();
  FluxOptions options = options_of(trench, Engine::automatic);
  options.rays = 0;
  options.target_error = 0.01;
  const Solved gathered = solve_covered(trench, options, {&species, 1});
  options.engine = Engine::forward;
  // Where a particle that plays roulette on a facet meets it again, two stickings may lead to each
  // other for ever: with these random numbers none does.
  options.seed = 8;
  const Solved traced = solve_covered(trench, options, {&species, 1});
  EXPECT_EQ(gathered.flux.front().engine, FluxEngine::gather);
  ASSERT_EQ(traced.flux.front().engine, FluxEngine::forward);
  EXPECT_TRUE(traced.flux.front().target_reached());
  const Tally& one = gathered.flux.front().arrivals();
  const Tally& other = traced.flux.front().arrivals();
  ASSERT_EQ(one.patch_mean.size(), other.patch_mean.size());
  for (std::size_t p = 0; p < one.patch_mean.size(); ++p)
    EXPECT_NEAR(one.patch_mean[p], other.patch_mean[p],
                4 * std::hypot(one.patch_std_error[p], other.patch_std_error[p]) + 0.005)
        << p;
  for (std::size_t f = 0; f < other.mean.size(); ++f)
    EXPECT_NEAR(traced.sticking[f], langmuir.at(other.mean[f]), 2e-5) << f;
  EXPECT_GE(traced.flux.front().rays, static_cast<std::uint64_t>(traced.updates - 1) << 16);
}

TEST(StickingFeedbackTest, IsNotForIons) {
  const exact::Shape trench = exact::trench(1);
  Species ions = gas();
  ions.ions = Ions{};
  EXPECT_THROW(solve_covered(trench, options_of(trench, Engine::automatic), {&ions, 1}),
               InputError);
}

// In a trench 2 deep the flux at the bottom is another with every number of rays; what is found on
// the way to the target must fit the last of them.
TEST(StickingFeedbackTest, FitsTheRaysThatReachTheTarget) {
  const exact::Shape trench = exact::trench(2);
  FluxOptions options = options_of(trench, Engine::automatic);
  options.rays = 0;
  options.target_error = 0.01;
  const Species species = gas();
  const Solved solved = solve_covered(trench, options, {&species, 1});
  EXPECT_EQ(solved.flux.front().engine, FluxEngine::gather);
  EXPECT_TRUE(solved.flux.front().target_reached());
  const std::vector<float>& arrivals = solved.flux.front().arrivals().mean;
  for (std::size_t f = 0; f < arrivals.size(); ++f)
    EXPECT_NEAR(solved.sticking[f], langmuir.at(arrivals[f]), 2e-5) << f;
}

// What covers the sphere desorbs and sticks again: F_d = (1 - f) ((1 - s) F_d + e). Sticking and
// emission change together, and the flux is that of the last of both.
TEST(StickingFeedbackTest, EmissionFollowsWhatCoversTheSurface) {
  constexpr double cut = 0.5;
  constexpr double open = (1 - cut) / 2;
  const exact::Shape pit = exact::spherical_pit(cut);
  const std::vector<Species> species{
      gas(), {.name = "desorbed", .source = {.kind = SourceLobe::Kind::none}}};
  constexpr std::array<float, 3> covered{0, 0.3F, 0.6F};
  std::size_t turn = 0;
  std::vector<float> last;  // that the feedback was told of
  StickingFeedback feedback{.species = {true, true}};
  feedback.update = [&](std::span<const std::span<const float>> flux,
                        std::vector<std::vector<float>>& sticking) {
    EXPECT_EQ(flux.size(), 2U);
    if (turn == 0) {
      EXPECT_EQ(flux[0].front(), 1);
      EXPECT_EQ(flux[1].front(), 0);
    }
    last.assign(flux[1].begin(), flux[1].end());
    if (turn == covered.size()) return false;
    for (std::vector<float>& one : sticking) one.assign(one.size(), bare * (1 - covered[turn]));
    ++turn;
    return true;
  };
  SurfaceEmission emission{.species = {false, true}};
  emission.of = [&](std::span<const std::span<const float>> flux) {
    std::vector<float> leaves;
    for (std::size_t f = 0; f < flux[0].size(); ++f) {
      const bool is_inside = pit.mesh.vertices[pit.mesh.triangles[f][0]].z < -1e-3F;
      leaves.push_back(is_inside ? covered[turn - 1] : 0);
    }
    return std::vector<std::vector<float>>{leaves};
  };
  const std::vector<FluxField> flux =
      solve_flux(pit.mesh, species, options_of(pit, Engine::automatic), feedback, emission);
  const double reemitted = 1 - bare * (1 - covered.back());
  const auto deep = [](Vec3d r) { return r.z < -5; };
  const double expected_source = open / (1 - (1 - open) * reemitted);
  EXPECT_NEAR(exact::mean_of(pit.mesh, flux[0].arrivals(), deep).value, expected_source,
              0.01 * expected_source);
  const double expected = (1 - open) * covered.back() / (1 - (1 - open) * reemitted);
  EXPECT_NEAR(exact::mean_of(pit.mesh, flux[1].arrivals(), deep).value, expected, 0.01 * expected);
  const std::vector<float>& found = flux[1].arrivals().mean;
  for (std::size_t f = 0; f < found.size(); ++f)
    EXPECT_NEAR(last[f], found[f], 10 * feedback.tolerance * found[f]) << f;
  const FluxAudit& audit = flux[1].audit;
  EXPECT_GT(audit.emitted, 0);
  EXPECT_NEAR(audit.balance_error(), 0, 4 * audit.balance_std_error + 1e-6);
}

// Another gas, whose sticking is its own, and ions are what they are alone.
TEST(StickingFeedbackTest, OthersAreNotTouched) {
  const exact::Shape trench = exact::trench(1);
  FluxOptions options = options_of(trench, Engine::automatic);
  const std::vector<Species> species{
      gas(),
      {.name = "other", .sticking = {0.3F}},
      {.name = "ion", .source = {.cosine_power = 100}, .ions = Ions{}}};
  const Solved solved = solve_covered(trench, options, species);
  const std::vector<FluxField> alone = solve_flux(trench.mesh, species, options);
  for (const std::size_t k : {1, 2})
    EXPECT_EQ(solved.flux[k].arrivals().mean, alone[k].arrivals().mean) << species[k].name;
  EXPECT_NE(solved.flux[0].arrivals().mean, alone[0].arrivals().mean);
}

}  // namespace
}  // namespace scarp
