// The flux carried on the surface as it moves, and how its change in time is taken into account.

#include "apps/simulator/speed_change.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "apps/simulator/simulator.h"
#include "core/random.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using ::testing::Each;
using ::testing::FloatNear;

/// A square of 20 x 20 cells of 1 nm at some height, tilted about the y axis.
TriMesh square(float height, float slope = 0) {
  constexpr std::uint32_t cells = 20;
  TriMesh mesh;
  for (std::uint32_t j = 0; j <= cells; ++j)
    for (std::uint32_t i = 0; i <= cells; ++i)
      mesh.vertices.push_back(
          {static_cast<float>(i), static_cast<float>(j), height + slope * static_cast<float>(i)});
  for (std::uint32_t j = 0; j < cells; ++j) {
    for (std::uint32_t i = 0; i < cells; ++i) {
      const std::uint32_t v = j * (cells + 1) + i;
      const std::uint32_t up = v + cells + 1;
      mesh.triangles.insert(mesh.triangles.end(), {{v, v + 1, up}, {v + 1, up + 1, up}});
    }
  }
  mesh.materials.assign(mesh.triangles.size(), 0);
  return mesh;
}

std::vector<LayerSpeeds> speeds_on(const TriMesh& mesh, const std::function<double(Vec3f)>& speed) {
  CornerSpeeds speeds;
  for (const Triangle& t : mesh.triangles) {
    speeds.emplace_back();
    for (std::size_t c = 0; c < 3; ++c)
      speeds.back()[c] = static_cast<float>(speed(mesh.vertices[t[c]]));
  }
  return {{.speed = std::move(speeds)}};
}

SpeedChange change_between(const TriMesh& before, const std::vector<LayerSpeeds>& then,
                           const TriMesh& now, const std::vector<LayerSpeeds>& speeds, double dt) {
  const std::vector<std::size_t> layers(now.triangles.size());
  return speed_change({before, then}, TriangleTree(before), {now, speeds}, layers, {}, dt, 1);
}

// 0.5 nm/s more everywhere after 0.25 s, whatever the speeds are.
TEST(SpeedChange, IsThatAlongTheWayOfTheSurface) {
  const TriMesh before = square(0);
  const TriMesh now = square(1.5);
  const auto slope = [](Vec3f r) { return -4 + 0.01 * static_cast<double>(r.x); };
  const SpeedChange change =
      change_between(before, speeds_on(before, slope), now,
                     speeds_on(now, [&](Vec3f r) { return slope(r) + 0.5; }), 0.25);
  EXPECT_THAT(change.of_layers[0].of_speed, Each(FloatNear(2 / 3.4F, 0.03F)));
  EXPECT_NEAR(change.typical, 2, 1e-4);
}

TEST(SpeedChange, IsUnknownWhereTheSurfaceWasNotNearOrFacedAnotherWay) {
  const TriMesh now = square(0);
  const auto one = speeds_on(now, [](Vec3f) { return 1; });
  const auto two = speeds_on(now, [](Vec3f) { return 2; });
  EXPECT_GT(change_between(square(-2.5), one, now, two, 1).typical, 0.9);
  EXPECT_EQ(change_between(square(-3.5), one, now, two, 1).typical, 0);
  EXPECT_GT(change_between(square(-1, 0.2F), one, now, two, 1).typical, 0.9);
  EXPECT_EQ(change_between(square(-5, 0.7F), one, now, two, 1).typical, 0);
}

// A tenth of the surface changes: that is what is typical of the change, not the mean of all.
TEST(SpeedChange, IsTypicalOfWhereItHappens) {
  const TriMesh mesh = square(0);
  const auto speeds = speeds_on(mesh, [](Vec3f) { return 1; });
  const auto later =
      speeds_on(mesh, [](Vec3f r) { return r.x < 6.01F && r.y < 6.01F ? 2 : 1.001; });
  EXPECT_NEAR(change_between(mesh, speeds, mesh, later, 1).typical, 0.9, 0.15);
}

// Of facets that particles hit by chance: whatever hits here then and there now, what is added to
// the speeds is what the sums of both differ by, to rounding.
TEST(SpeedChange, OfNoiseAddsUpToNoBias) {
  const TriMesh mesh = square(0);
  RandomStream random({1, 2, 3, 4});
  const auto sparse = [&] {
    std::vector<LayerSpeeds> speeds{{.speed = CornerSpeeds(mesh.triangles.size())}};
    for (auto& corners : speeds[0].speed) corners.fill(random.uniform() < 0.3 ? -1.0F : 0.0F);
    return speeds;
  };
  const std::vector<LayerSpeeds> then = sparse();
  const std::vector<LayerSpeeds> now = sparse();
  const auto sum = [](const std::vector<LayerSpeeds>& speeds) {
    double sum = 0;
    for (const auto& corners : speeds[0].speed) sum += static_cast<double>(corners[0]);
    return sum;
  };
  const SpeedChange change = change_between(mesh, then, mesh, now, 1);
  const double added = sum(changed_speeds(now, change, 0.5)) - sum(now);
  EXPECT_NE(sum(now), sum(then));
  EXPECT_NEAR(added, 0.5 * (sum(now) - sum(then)), 0.03 * std::abs(sum(now)));
}

TEST(SpeedChange, TurnsNoSpeedRoundNorMoreThanDoublesIt) {
  const std::vector<LayerSpeeds> speeds{{.speed = {{2, -2, 0}}, .parts = {{{1, 1, 1}}}}};
  const SpeedChange change{.of_layers = {{.of_speed = {0.25F}, .of_parts = {{-0.5F}}}}};
  const std::vector<LayerSpeeds> soon = changed_speeds(speeds, change, 1);
  EXPECT_THAT(soon[0].speed[0], ::testing::ElementsAre(2.5F, -1.5F, 0));
  EXPECT_THAT(soon[0].parts[0][0], Each(0.5F));
  const std::vector<LayerSpeeds> late = changed_speeds(speeds, change, 9);
  EXPECT_THAT(late[0].speed[0], ::testing::ElementsAre(4, 0, 0));
  EXPECT_THAT(late[0].parts[0][0], Each(0.0F));
}

constexpr const char* filling_trench = R"toml(
[domain]
spacing = "2.5 nm"
extent = ["200 nm"]
mode = "2d"

[[geometry]]
shape = "wafer"
material = "Si"

[[geometry]]
shape = "trench"
width = "80 nm"
depth = "120 nm"

[[step]]
name = "film"
model = "single_particle"
material = "SiO2"
growth_rate = "1 nm/s"
sticking = 0.2
)toml";

/// A run to the end of its recipe.
struct Filled {
  double film = 0;  ///< nm^3 of solid that grew
  std::uint32_t time_steps = 0;
  std::vector<VoidClosure> voids;
};

Filled run_of(const std::string& duration, const std::string& settings, int seed) {
  const std::string text = std::string("[flux]\ntarget_error = 0.004\nseed = ") +
                           std::to_string(seed) + "\n" + settings + filling_trench +
                           "duration = \"" + duration + "\"\n";
  const Recipe recipe = read_text(text);
  State state = start_state(recipe.domain.frame, recipe.start);
  begin_step(state, recipe.steps);
  Survey now = survey(state, recipe);
  const double before = now.volume;
  while (!finished(state, recipe.steps)) {
    advance(state, recipe, now, next_output(state, recipe.outputs.every));
    if (!finished(state, recipe.steps)) begin_step(state, recipe.steps);
    now = survey(state, recipe);
    note_voids(state, now.gas);
  }
  return {now.volume - before, state.time_step, state.voids};
}

struct Estimate {
  double mean = 0;
  double std_error = 0;
};

Estimate film_of(const std::string& settings) {
  constexpr int seeds = 3;
  double sum = 0;
  double squares = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const double film = run_of("25 s", settings, seed).film;
    sum += film;
    squares += film * film;
  }
  const double mean = sum / seeds;
  return {mean, std::sqrt(std::max(0.0, squares / seeds - mean * mean) / (seeds - 1))};
}

// Against time steps that go to 0: from two short ones, to first order.
TEST(CarriedFlux, IsCloserToTheEndInFewerTimeSteps) {
  const std::string plain = "carry_within = 0\n";
  const Estimate tenth = film_of(plain + "[advection]\ncfl = 0.1\n");
  const Estimate twentieth = film_of(plain + "[advection]\ncfl = 0.05\n");
  const double limit = 2 * twentieth.mean - tenth.mean;
  const Estimate first_order = film_of(plain);
  const std::string carried = "carry_within = 0.02\n";
  const Estimate carried_film = film_of(carried);
  const double chance =
      4 * std::hypot(2 * twentieth.std_error, tenth.std_error, carried_film.std_error);
  EXPECT_GT(first_order.mean - limit, 3 * chance);
  EXPECT_LT(std::abs(carried_film.mean - limit), (first_order.mean - limit) / 3 + chance);
  EXPECT_LT(2.5 * run_of("25 s", carried, 1).time_steps, run_of("25 s", plain, 1).time_steps);
}

// How far a flat wafer goes by the flux of its fourth time step. Units: moves of cfl spacings.
double moves_of_a_flux(const std::string& source_power) {
  const Recipe recipe = read_text(
      silicon_wafer +
      "[[step]]\nmodel = \"multi_particle\"\nduration = \"100 s\"\nrate = \"-1 nm/s * Ar\"\n"
      "[[step.ion]]\nname = \"Ar\"\nsticks_to = \"90 deg\"\nsource_power = " +
      source_power + "\n");
  State state = start_state(recipe.domain.frame, recipe.start);
  double begin = 0;
  while (state.time_step < 4) {
    begin = state.time;
    advance(state, recipe, survey(state, recipe), next_output(state, recipe.outputs.every));
  }
  constexpr double speed = 1;  // nm/s
  return (state.time - begin) * speed / (recipe.advection.cfl * recipe.domain.frame.spacing);
}

// A floor below a narrow lobe leaves walls behind that know only of its edge; others do not.
TEST(CarriedFlux, ServesForFewerMovesWhereSpeedsTurnWithTheNormal) {
  EXPECT_NEAR(moves_of_a_flux("1"), 4, 0.4);
  EXPECT_NEAR(moves_of_a_flux("1000"), 2, 0.2);
}

// A void is found in the move that closes it, not some moves later: with carry_within = 0 and moves
// of a quarter of the length this one closes after 72.75 to 73 s (four seeds).
TEST(CarriedFlux, EndsATimeStepWhereAVoidCloses) {
  const Filled filled = run_of("80 s", "", 1);
  ASSERT_EQ(filled.voids.size(), 1U);
  constexpr double of_a_move = 0.4 * 2.5;  // s
  EXPECT_NEAR(filled.voids[0].time, 72.9, of_a_move);
}

// 12 nm of film at 1 nm/s: moves are 1 nm, and time steps begin at 0, 1, 3, 7 and 11 s.
TEST(CarriedFlux, EndsATimeStepWhereAnotherMaterialComesToLight) {
  const Recipe recipe = read_text(R"toml(
[domain]
spacing = "2.5 nm"
extent = ["50 nm"]
mode = "2d"

[[geometry]]
shape = "wafer"
material = "Si"

[[geometry]]
shape = "layer"
material = "SiO2"
thickness = "12 nm"

[[step]]
model = "single_particle"
duration = "20 s"
etch_rate = { SiO2 = "1 nm/s", Si = "1 nm/s" }
sticking = { SiO2 = 0.1, Si = 1 }
)toml");
  State state = start_state(recipe.domain.frame, recipe.start);
  double seen_at = 0;
  while (seen_at == 0 && !finished(state, recipe.steps)) {
    advance(state, recipe, survey(state, recipe), next_output(state, recipe.outputs.every));
    const Survey now = survey(state, recipe);
    if (now.facets.materials.front() == recipe.materials.id("Si")) seen_at = state.time;
  }
  EXPECT_GT(state.time_step, 4U);
  EXPECT_NEAR(seen_at, 12, 1.1);
}

}  // namespace
}  // namespace scarp
