#include "apps/simulator/simulator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "apps/simulator/surface_speeds.h"
#include "core/error.h"
#include "core/running_statistics.h"
#include "core/system/temporary_folder.h"
#include "flux/solve.h"
#include "levelset/operations/layer_steps.h"
#include "tests/apps/final_state.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

/// The layers at the end of a recipe.
Layers final_layers(const std::string& text) {
  const Recipe recipe = read_text(text);
  State state = start_state(recipe.domain.frame, recipe.start);
  begin_step(state, recipe.steps);
  while (!finished(state, recipe.steps)) {
    advance(state, recipe, survey(state, recipe), std::numeric_limits<double>::infinity());
  }
  return std::move(state.layers);
}

constexpr const char* coated_hole = R"(
[domain]
spacing = "5 nm"
extent = ["200 nm", "200 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "hole"
radius = "60 nm"
depth = "100 nm"
[[step]]
model = "conformal"
thickness = "THICK"
material = "SiO2"
[[step]]
model = "isotropic"
duration = "1 s"
etch_rate = "1 nm/s"
)";

// Facets lie within 0.1 spacings of the surface, but with a film on it within 0.05 of the film.
TEST(Simplification, BindsItsErrorToTheThinnestFilm) {
  for (const auto& [thickness, bound] : {std::pair{"5 nm", 0.25}, {"8 nm", 0.4}, {"40 nm", 0.5}}) {
    std::string text = coated_hole;
    text.replace(text.find("THICK"), 5, thickness);
    const Recipe recipe = read_text(text);
    const Survey now = survey(
        prepared_state(recipe.domain.frame, recipe.start, recipe.steps, recipe.materials), recipe);
    EXPECT_LE(now.simplify_max_distance, 1.1 * bound) << thickness;
    EXPECT_GT(now.simplify_max_distance, 0.4 * bound) << thickness;
    EXPECT_LT(now.facets.triangles.size(), now.facets_full / 2) << thickness;
  }
}

/// Height of the highest surface below z = 0, at a place. Units: nm.
double height(const LevelSet& phi, double x) {
  double upper = 0;
  while (phi.distance({x, 0, upper - 0.25}) > 0) upper -= 0.25;
  double lower = upper - 0.25;
  for (int n = 0; n < 30; ++n) {
    const double middle = 0.5 * (lower + upper);
    (phi.distance({x, 0, middle}) > 0 ? upper : lower) = middle;
  }
  return lower;
}

constexpr const char* tapered_trench = R"(
[domain]
spacing = "1 nm"
extent = ["60 nm"]
mode = "2d"

[[geometry]]
shape = "wafer"
material = "Si"

[[geometry]]
shape = "trench"
width = "24.6 nm"
depth = "10.3 nm"
taper = "20 deg"

[[step]]
model = "directional"
duration = "8 s"
directional_etch_rate = "1 nm/s"
)";

// The mesh may be kept until it is the bound and more behind the surface.
TEST(Simplification, WithAWideBoundTheSurfaceStillMovesAllTheWay) {
  for (const char* bound : {"0.1", "1", "10"}) {
    const Layers layers = final_layers(std::string(R"(
[domain]
spacing = "0.1 um"
extent = ["0.2 um", "0.2 um"]
boundary = ["periodic", "reflective"]
[[geometry]]
shape = "wafer"
material = "Si"
[simplify]
max_error = )") + bound + R"(
[flux]
target_error = 0.02
[[step]]
model = "single_particle"
duration = "20 s"
etch_rate = { Si = "10 nm/s" }
sticking = 0.5
)");
    EXPECT_NEAR(layers.top().distance({0, 0, -200}), 0, 0.5) << bound;
  }
}

// Two films in each round, and both are stripped.
TEST(Layers, ThatAreGoneDoNotPileUpInCycles) {
  const State end = final_state(read_text(R"(
[domain]
spacing = "5 nm"
extent = ["100 nm"]
mode = "2d"
[[geometry]]
shape = "wafer"
material = "Si"
[[step]]
repeat = 4
[[step.step]]
model = "conformal"
thickness = "10 nm"
material = "SiO2"
[[step.step]]
model = "conformal"
thickness = "10 nm"
material = "Si3N4"
[[step.step]]
model = "isotropic"
duration = "30 s"
etch_rate = { SiO2 = "1 nm/s", Si3N4 = "1 nm/s", default = "0 nm/s" }
)"));
  EXPECT_LE(end.layers.stack.size(), 3U);
  EXPECT_NEAR(highest_point(end.layers), 0, 0.1);
}

TEST(Directional, EtchKeepsSlopesAndSinksEverythingAlike) {
  const double mouth = 0.5 * 24.6;
  const double taper = std::tan(20 * std::numbers::pi / 180);
  const double foot = mouth - 10.3 * taper;
  for (const std::string visibility : {"true", "false"}) {
    const Layers layers = final_layers(tapered_trench + ("visibility = " + visibility));
    for (double x = -28.7; x < 29; x += 0.4) {
      const double r = std::abs(x);
      const double before = r > mouth ? 0 : r > foot ? (r - mouth) / taper : -10.3;
      const bool at_edge = std::abs(r - mouth) < 1.2 || std::abs(r - foot) < 1.2;
      EXPECT_NEAR(height(layers.top(), x), before - 8, at_edge ? 0.8 : 0.15)
          << x << " " << visibility;
    }
  }
}

constexpr const char* tilted_beam = R"(
[domain]
spacing = "1 nm"
extent = ["80 nm"]
boundary = ["periodic"]
mode = "2d"

[[geometry]]
shape = "wafer"
material = "Si"

[[geometry]]
shape = "mask"
material = "resist"
thickness = "5 nm"
opening = { shape = "trench", width = "30 nm" }

[[step]]
model = "directional"
duration = "20 s"
directional_etch_rate = { Si = "1 nm/s", resist = "0 nm/s" }
[[step.beam]]
tilt = "30 deg"
)";

TEST(Directional, TiltedBeamCutsAlongItself) {
  const LevelSet phi = final_layers(tilted_beam).top().copy();
  const double slope = std::tan(std::numbers::pi / 6);
  // A beam at 30 degrees sinks a flat bottom by its cosine.
  for (double x = 4; x < 13; x += 0.7) {
    EXPECT_NEAR(height(phi, x), -20 * std::cos(std::numbers::pi / 6), 0.05) << x;
  }
  // The shadow of the mask's upper edge at (-15, 5) on the left.
  for (double x = -10.5; x < -4; x += 0.3) {
    EXPECT_NEAR(height(phi, x), 5 - (x + 15) / slope, 0.2) << x;
  }
  // On the right the beam reaches below the mask, past its lower edge at (15, 0).
  for (double z = -14; z < -2; z += 0.4) {
    const double wall = 15 - z * slope;
    EXPECT_GT(phi.distance({wall - 0.4, 0, z}), 0) << z;
    EXPECT_LT(phi.distance({wall + 0.4, 0, z}), 0) << z;
  }
}

// A cavity 61.2 nm wide under a neck of 20.4 nm, coated until it is closed and etched open again.
constexpr const char* necked_cavity = R"(
[domain]
spacing = "1 nm"
extent = ["120 nm"]
mode = "2d"

[[geometry]]
shape = "wafer"
material = "Si"

[[geometry]]
shape = "layer"
material = "Si3N4"
thickness = "12 nm"

[[geometry]]
shape = "trench"
width = "61.2 nm"
depth = "50.3 nm"
through = ["Si"]

[[geometry]]
shape = "trench"
width = "20.4 nm"
depth = "15 nm"

[[step]]
model = "isotropic"
duration = "14 s"
growth_rate = "1 nm/s"
material = "SiO2"

[[step]]
model = "isotropic"
duration = "30 s"
etch_rate = "1 nm/s"
)";

TEST(Void, ClosesInTimeStaysAsItIsAndOpensAgain) {
  const Recipe recipe = read_text(necked_cavity);
  State state = start_state(recipe.domain.frame, recipe.start);
  std::vector<Region> seen;
  double closed_at = 0;
  double opened_at = 0;
  while (!finished(state, recipe.steps)) {
    begin_step(state, recipe.steps);
    const Survey now = survey(state, recipe);
    const VoidChanges changes = note_voids(state, now.gas);
    if (!changes.closed.empty() && seen.empty()) closed_at = state.time;
    ASSERT_EQ(state.voids.size(), now.gas.voids.size());
    for (std::size_t n = 0; n < state.voids.size(); ++n) {
      EXPECT_EQ(state.voids[n].time, closed_at);
      // The seam in the neck may leave a pocket of a spacing or two.
      if (now.gas.voids[n].volume > 10) seen.push_back(now.gas.voids[n]);
    }
    if (changes.opened > 0 && !seen.empty()) opened_at = state.time;
    advance(state, recipe, now, std::numeric_limits<double>::infinity());
  }
  // Half the neck at 1 nm/s, half a spacing more or less, and the time step in which it was seen.
  EXPECT_NEAR(closed_at, 10.2, 0.5 + 0.4);
  // In the last time steps before it opens nothing but a spacing is left above it.
  ASSERT_GE(seen.size(), 30U);
  seen.resize(seen.size() - 3);
  for (const Region& same : seen) {
    EXPECT_EQ(same.volume, seen.front().volume);
    EXPECT_EQ(same.lower, seen.front().lower);
    EXPECT_EQ(same.upper, seen.front().upper);
  }
  EXPECT_NEAR(seen.front().lower, -50.3 + 10.2, 0.5 + 0.4);
  // The dent above the neck, where two arcs of the film's thickness meet, comes down to the void.
  const double dent = 12 + std::sqrt(14 * 14 - 10.2 * 10.2);
  EXPECT_NEAR(opened_at, 14 + dent - seen.front().upper, 1);
  EXPECT_TRUE(state.voids.empty());
}

// Trench isolation: a nitride stop layer, a trench through it, oxide all over it, polished back.
constexpr const char* isolation = R"(
[domain]
spacing = "1 nm"
extent = ["60 nm"]
mode = "2d"

[[geometry]]
shape = "wafer"
material = "Si"

[[geometry]]
shape = "layer"
material = "Si3N4"
thickness = "6 nm"

[[geometry]]
shape = "trench"
width = "16.4 nm"
depth = "20 nm"

[[step]]
model = "conformal"
thickness = "11 nm"
material = "SiO2"

[[step]]
model = "planarise"
duration = "30 s"
)";

constexpr const char* strip_nitride = R"(
[[step]]
model = "isotropic"
duration = "4 s"
etch_rate = { Si3N4 = "1 nm/s", SiO2 = "0 nm/s", Si = "0 nm/s" }
)";

TEST(LayerSteps, PolishDownToAHeightByAnAmountOrToAMaterial) {
  for (const char* plane :
       {"height = \"6 nm\"", "removal = \"11 nm\"", "stop_material = \"Si3N4\""}) {
    const Layers layers = final_layers(isolation + std::string(plane));
    ASSERT_EQ(layers.stack.size(), 3U);
    for (int i = 0; i <= 60; ++i) {
      ASSERT_NEAR(layers.top().node(i, 0, 7), 1 - 1e-3, 1e-5) << plane;
      ASSERT_EQ(layers.top().node(i, 0, 6) < 0, true) << plane;
    }
    // Oxide is left in the trench only.
    EXPECT_NEAR(layers.stack[1].phi.distance({20, 0, 6}), -1e-3, 1e-4);
    EXPECT_GT(layers.stack[1].phi.distance({0, 0, 4}), 3);
  }
}

TEST(LayerSteps, TakeOneTimeStepAndTheirDurationAndOthersGoOn) {
  const Recipe recipe = read_text(isolation + std::string("height = \"6 nm\"\n") + strip_nitride);
  EXPECT_EQ(recipe.steps[0].duration, 0);
  State state = start_state(recipe.domain.frame, recipe.start);
  std::vector<double> times;
  while (!finished(state, recipe.steps)) {
    begin_step(state, recipe.steps);
    const Survey now = survey(state, recipe);
    note_voids(state, now.gas);
    EXPECT_EQ(facet_speeds(state, now).size(), now.facets.triangles.size());
    advance(state, recipe, now, std::numeric_limits<double>::infinity());
    times.push_back(state.time);
  }
  ASSERT_GE(times.size(), 12U);
  EXPECT_EQ(times[0], 0);
  EXPECT_EQ(times[1], 30);
  EXPECT_EQ(times.back(), 34);
  EXPECT_EQ(state.time_step, times.size());
  // The nitride is thinner by 4 nm, the oxide stands up.
  EXPECT_NEAR(state.layers.top().distance({25, 0, 2}), 0, 0.01);
  EXPECT_NEAR(state.layers.top().distance({0, 0, 6}), -1e-3, 1e-4);
}

TEST(LayerSteps, ThatComeFirstBelongToWhatAPreviewShows) {
  const Recipe recipe = read_text(isolation + std::string("removal = \"3 nm\"\n") + strip_nitride);
  const State prepared =
      prepared_state(recipe.domain.frame, recipe.start, recipe.steps, recipe.materials);
  EXPECT_EQ(prepared.step, 2U);
  EXPECT_EQ(start_state(recipe.domain.frame, recipe.start).layers.stack.size(), 2U);
  ASSERT_EQ(prepared.layers.stack.size(), 3U);
  EXPECT_NEAR(prepared.layers.top().distance({25, 0, 14}), -1e-3, 1e-4);
}

TEST(LayerSteps, AStopMaterialThatIsGoneEndsTheRun) {
  const Recipe recipe = read_text(isolation + std::string("height = \"-2 nm\"\n") +
                                  "[[step]]\nmodel = \"planarise\"\nstop_material = \"Si3N4\"\n");
  EXPECT_THROW(prepared_state(recipe.domain.frame, recipe.start, recipe.steps, recipe.materials),
               NumericalError);
}

constexpr const char* masked_wafer = R"(
[domain]
spacing = "10 nm"
extent = ["800 nm"]
mode = "2d"

[[geometry]]
shape = "wafer"
material = "Si"

[[geometry]]
shape = "mask"
material = "resist"
thickness = "63 nm"
taper = "6 deg"
opening = { shape = "trench", width = "187 nm" }

[[step]]
duration = "1 h"
)";

TEST(Mask, OfRateZeroLosesNotOneBitInAnHour) {
  const std::string isotropic =
      "model = \"isotropic\"\netch_rate = { Si = \"0.05 nm/s\", resist = \"0 nm/s\" }\n";
  const std::string directional =
      "model = \"directional\"\ndirectional_etch_rate = { Si = \"0.1 nm/s\", resist = \"0 nm/s\" "
      "}\n";
  for (const std::string& step : {isotropic, directional}) {
    const Recipe recipe = read_text(masked_wafer + step);
    const Layers start = start_state(recipe.domain.frame, recipe.start).layers;
    const Layers end = final_layers(masked_wafer + step);
    int compared = 0;
    for (int i = 0; i <= 80; ++i) {
      for (int k = 1; k < 10; ++k) {
        for (const auto& [di, dk] : {std::pair{1, 0}, std::pair{0, 1}}) {
          const std::array<float, 2> before{start.top().node(i, 0, k),
                                            start.top().node(i + di, 0, k + dk)};
          if ((before[0] < 0) == (before[1] < 0)) continue;
          ++compared;
          EXPECT_EQ(end.top().node(i, 0, k), before[0]) << step << i << " " << k;
          EXPECT_EQ(end.top().node(i + di, 0, k + dk), before[1]) << step << i << " " << k;
        }
      }
    }
    EXPECT_GT(compared, 60);
    // And something was etched: 180 nm down and sideways, or 360 nm down.
    EXPECT_GT(end.top().distance({0, 0, -150}), 0) << step;
    EXPECT_EQ(end.stack.size(), start.stack.size());
  }
}

// SF6/O2 on Si at steady coverages. Fluxes of ions 12, of O 100 (1e15 /cm2/s) and the density of
// Si, 5.02 (1e22 /cm3), are those of Belen et al. 2005; their quotients are nm/s.
constexpr const char* plasma_etch = R"toml(
[[geometry]]
shape = "wafer"
material = "Si"
[flux]
rays = 200000
[[step]]
model = "multi_particle"
duration = "1 s"
[[step.neutral]]
name = "F"
sticking = 0.3
[[step.neutral]]
name = "O"
[[step.ion]]
name = "ion"
source_power = 1e5
[[step.ion.yield]]
name = "sputtered"
amplitude = 0.0337
threshold = "20 eV"
angular = "sputter"
[[step.ion.yield]]
name = "etched"
amplitude = 7
threshold = "15 eV"
angular = "enhanced"
[[step.ion.yield]]
name = "cleaned"
amplitude = 3
threshold = "10 eV"
angular = "enhanced"
)toml";

struct OpenWafer {
  double f_flux;
  const char* energy_deviation;
  double rate;  // nm/s
};

// With 1800 of F and the sticking of F in the balance of its coverage or not, which is as 1260.
constexpr std::array open_wafers{OpenWafer{1800, "0 eV", 58.0683},
                                 OpenWafer{1260, "10 eV", 47.6859}};

TEST(MultiParticle, EtchesAnOpenWaferAtTheKnownRate) {
  const TemporaryFolder folder;
  for (const std::string domain :
       {"extent = [\"200 nm\", \"200 nm\"]", "extent = [\"1 um\"]\nmode = \"2d\""}) {
    std::ofstream(folder / "r.toml") << "[domain]\nspacing = \"10 nm\"\n" << domain << plasma_etch;
    for (const OpenWafer& wafer : open_wafers) {
      const std::string f = "F * " + std::to_string(wafer.f_flux);
      const std::string rate = "-1 nm/s / 5.02 * (12 * sputtered + (75 + 12 * etched) * " + f +
                               " / (" + f +
                               " + (300 + 24 * etched) * (1 + 100 * O / (0.04 + 12 * cleaned))))";
      const Recipe recipe = read_recipe(recipe_in(
          folder / "r.toml",
          {"step[0].rate=\"" + rate + '"',
           std::string("step[0].ion[0].energy_deviation=\"") + wafer.energy_deviation + '"'}));
      const State state = start_state(recipe.domain.frame, recipe.start);
      RunningStatistics etched;
      for (const float speed : facet_speeds(state, survey(state, recipe))) etched.add(-speed);
      EXPECT_NEAR(etched.mean(), wafer.rate, 4 * etched.std_error() + 1e-3 * wafer.rate) << domain;
      EXPECT_LT(etched.std_error(), 2e-3 * wafer.rate);
    }
  }
}

const std::string film_on_silicon = silicon_wafer + R"([[geometry]]
shape = "layer"
material = "SiO2"
thickness = "100 nm"
[flux]
rays = 1000
[[step]]
model = "multi_particle"
duration = "1 s"
[[step.neutral]]
name = "F"
)";

std::string failure_of(const std::string& rates) {
  const Recipe recipe = read_text(film_on_silicon + "[step.rate]\n" + rates);
  try {
    survey(start_state(recipe.domain.frame, recipe.start), recipe);
  } catch (const NumericalError& error) {
    return error.what();
  }
  return "none";
}

// That of silicon counts, too, which is not seen yet.
TEST(MultiParticle, ARateThatIsNotFiniteIsToldWithItsFormulaBeforeItMovesAnything) {
  using ::testing::AllOf;
  using ::testing::HasSubstr;
  EXPECT_EQ(failure_of("Si = \"0\"\nSiO2 = \"-1 nm/s * F\"\n"), "none");
  EXPECT_THAT(failure_of("Si = \"-1 nm/s * (F - F) / (F - F)\"\nSiO2 = \"0\"\n"),
              AllOf(HasSubstr("speed is not finite on facet 0 at ("),
                    HasSubstr("nm, material Si, rate \"-1 nm/s * (F - F) / (F - F)\"")));
  EXPECT_THAT(failure_of("Si = \"0\"\nSiO2 = \"-1 nm/s / (F - F)\"\n"),
              HasSubstr("material SiO2, rate \"-1 nm/s / (F - F)\""));
  EXPECT_THAT(failure_of("Si = \"1 nm/s\"\nSiO2 = \"2 nm/s * F\"\n"),
              AllOf(HasSubstr("the surface grows, by 2 nm/s"), HasSubstr("no material"),
                    HasSubstr("material SiO2, rate \"2 nm/s * F\"")));
}

constexpr const char* coated_trench = R"(
[domain]
spacing = "1 nm"
extent = ["40 nm"]
mode = "2d"

[[geometry]]
shape = "wafer"
material = "Si"

[[geometry]]
shape = "trench"
width = "20 nm"
depth = "30 nm"

[[step]]
model = "single_particle"
duration = "10 s"
growth_rate = "1 nm/s"
material = "SiO2"
sticking = 0.3
)";

/// The first time step of a recipe with these settings in front.
Survey first_survey(const std::string& settings) {
  const Recipe recipe = read_text(settings + coated_trench);
  State state = start_state(recipe.domain.frame, recipe.start);
  begin_step(state, recipe.steps);
  return survey(state, recipe);
}

std::uint64_t rays_of(const Survey& survey) { return survey.flux.front().rays; }

// Asking the model for speeds was once in no column of metrics.csv.
TEST(SurveyTimer, CountsEveryStageThatRan) {
  const Survey now = first_survey("");
  for (const char* const stage : {"surface", "simplify", "flux", "map"})
    EXPECT_GT(now.timer.seconds(stage), 0) << stage;
}

TEST(PositionError, IsThatOfTheDistanceMovedInATimeStep) {
  const Survey now = first_survey("[flux]\nposition_error = 0.001\n");
  EXPECT_TRUE(now.flux.front().target_reached());
  ASSERT_TRUE(position_error(now, now.planned_dt).has_value());
  EXPECT_LE(*position_error(now, now.planned_dt), 0.001);
  // A growth of 1 nm/s: it is the error of the flux, in parts of the source's, times dt.
  const std::vector<float> moved(now.facets.triangles.size(), static_cast<float>(now.planned_dt));
  const Recipe recipe = read_text(coated_trench);
  FluxOptions options = recipe.flux.options;
  options.target_error = 0.001;
  options.responses = {{moved}};
  const std::vector<FluxField> flux =
      solve_flux(now.facets, recipe.steps[0].model->species(), options);
  EXPECT_NEAR(*flux[0].response_error, *position_error(now, now.planned_dt), 1e-5);
  EXPECT_EQ(flux[0].arrivals().mean, now.flux[0].arrivals().mean);
  EXPECT_FALSE(position_error(first_survey(""), 1).has_value());
}

TEST(PositionError, TakesFewerRaysWhereTheSurfaceMovesLittle) {
  const std::string target = "[flux]\nposition_error = 0.0005\n";
  const Survey whole = first_survey(target);
  const Survey cut = first_survey(target + "[output]\nevery = \"0.02 s\"\n");
  EXPECT_NEAR(cut.planned_dt, 0.02, 1e-12);
  EXPECT_GT(whole.planned_dt, 0.2);
  EXPECT_TRUE(cut.flux.front().target_reached());
  EXPECT_LT(2 * rays_of(cut), rays_of(whole));
  EXPECT_LT(2 * rays_of(cut), rays_of(first_survey("[flux]\ntarget_error = 0.003\n")));
}

TEST(PositionError, HoldsForTheTimeStepThatIsTaken) {
  const Recipe recipe =
      read_text(std::string("[flux]\nposition_error = \"0.002 nm\"\n") + coated_trench);
  State state = start_state(recipe.domain.frame, recipe.start);
  begin_step(state, recipe.steps);
  for (int n = 0; n < 4; ++n) {
    const Survey now = survey(state, recipe);
    const Move move = advance(state, recipe, now, next_output(state, recipe.outputs.every));
    EXPECT_LE(move.dt, now.planned_dt);
    EXPECT_LE(*position_error(now, move.dt), 0.002);
  }
}

// On a flat wafer F is 1, and a thousandth below the rate is 1 / 0.
TEST(PositionError, IsFoundBesideAPoleOfARate) {
  const Recipe recipe = read_text(R"toml(
[domain]
spacing = "1 nm"
extent = ["20 nm"]
mode = "2d"

[[geometry]]
shape = "wafer"
material = "Si"

[flux]
position_error = 0.01

[[step]]
model = "multi_particle"
duration = "1 s"
rate = "-1 nm/s / max(F - 0.9995, 0)"
[[step.neutral]]
name = "F"
)toml");
  const Survey now = survey(start_state(recipe.domain.frame, recipe.start), recipe);
  ASSERT_TRUE(position_error(now, now.planned_dt).has_value());
  EXPECT_LE(*position_error(now, now.planned_dt), 0.01);
}

TEST(PositionError, IsATargetInPlaceOfTheOthers) {
  const auto message = [](const std::string& settings) {
    try {
      read_text("[flux]\n" + settings + coated_trench);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_EQ(message("position_error = 0.01\n"), "no error");
  EXPECT_THAT(
      message("position_error = 0.01\ntarget_error = 0.1\n"),
      testing::HasSubstr("flux.target_error: position_error and target_error exclude each other"));
  EXPECT_THAT(message("position_error = 0.01\nrays = 9\n"),
              testing::HasSubstr("flux.rays: position_error and rays exclude each other"));
  EXPECT_THAT(message("position_error = 0\n"),
              testing::HasSubstr("flux.position_error: 0 is outside [1e-6, 1]"));
  EXPECT_THAT(message("position_error = \"2 nm\"\n"), testing::HasSubstr("is outside"));
}

}  // namespace
}  // namespace scarp
