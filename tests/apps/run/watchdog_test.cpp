#include "apps/run/watchdog.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <sstream>

#include "core/error.h"
#include "flux/solve.h"
#include "mesh/files/mesh_file.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double no_limit = std::numeric_limits<double>::infinity();

std::string growing_film(const std::string& rate) {
  return "[domain]\nspacing = \"10 nm\"\nextent = [\"200 nm\"]\nmode = \"2d\"\n"
         "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n"
         "[[step]]\nname = \"film\"\nmodel = \"isotropic\"\nduration = \"20 s\"\nmaterial = "
         "\"SiO2\"\ngrowth_rate = \"" +
         rate + "\"\n";
}

// A run as the program makes it, with a say in what the watchdog is shown.
std::string messages_of(const std::string& text, const std::function<void(Survey&)>& change) {
  const Recipe recipe = read_text(text);
  std::ostringstream messages;
  Watchdog watchdog(recipe.steps, recipe.materials, recipe.domain.frame.spacing,
                    Log(messages, Log::Level::everything));
  State state = start_state(recipe.domain.frame, recipe.start);
  begin_step(state, recipe.steps);
  while (true) {
    Survey now = survey(state, recipe);
    Survey shown = survey(state, recipe);
    change(shown);
    watchdog.look_at(state, shown);
    if (finished(state, recipe.steps)) break;
    const std::size_t step = state.step;
    const Move move = advance(state, recipe, now, no_limit);
    watchdog.note(shown, move, step);
    if (!finished(state, recipe.steps)) begin_step(state, recipe.steps);
  }
  watchdog.sum_up();
  return messages.str();
}

// A flat film of 200 nm x 10 nm x 20 nm.
TEST(Watchdog, IsSilentWhereTheSolidGrowsByWhatSpeedsSay) {
  EXPECT_EQ(messages_of(growing_film("1 nm/s"), [](Survey&) {}), "");
  const Recipe recipe = read_text(growing_film("1 nm/s"));
  State state = start_state(recipe.domain.frame, recipe.start);
  begin_step(state, recipe.steps);
  const Survey first = survey(state, recipe);
  EXPECT_NEAR(first.growth.net, 200 * 10 * 1.0, 1e-3);
  EXPECT_EQ(first.growth.gross, first.growth.net);
  while (!finished(state, recipe.steps)) advance(state, recipe, survey(state, recipe), no_limit);
  EXPECT_NEAR(survey(state, recipe).volume - first.volume, 200 * 10 * 20.0, 1);
}

TEST(Watchdog, TellsOfSolidThatIsNotWhatSpeedsSay) {
  const std::string messages =
      messages_of(growing_film("1 nm/s"), [](Survey& shown) { shown.growth.net *= 0.8; });
  EXPECT_THAT(messages,
              AllOf(HasSubstr("step \"film\""), HasSubstr("8e+03 nm^3 more"),
                    HasSubstr("0.2 of the volume that moved"), HasSubstr("domain.spacing")));
  EXPECT_EQ(messages_of(growing_film("1 nm/s"), [](Survey& shown) { shown.growth.net *= 0.95; }),
            "");
}

// A film of 300 nm in all between silicon and a mask, opened, and undercut by three quarters of a
// spacing twice.
std::string undercut_film(const std::string& thickness, const std::string& spacing = "10 nm") {
  const std::string undercut =
      "[[step]]\nname = \"undercut\"\nmodel = \"isotropic\"\nduration = \"7.5 s\"\n"
      "etch_rate = { Si = \"1 nm/s\", default = \"0 nm/s\" }\n";
  return "[domain]\nspacing = \"" + spacing +
         "\"\nextent = [\"400 nm\"]\nmode = \"2d\"\n"
         "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n"
         "[[geometry]]\nshape = \"layer\"\nmaterial = \"SiO2\"\nthickness = \"" +
         thickness +
         "\"\n[[geometry]]\nshape = \"mask\"\nmaterial = \"resist\"\nthickness = \"100 nm\"\n"
         "opening = { shape = \"trench\", width = \"100 nm\" }\n"
         "[[step]]\nname = \"open\"\nmodel = \"directional\"\nduration = \"20 s\"\n"
         "directional_etch_rate = { SiO2 = \"1 nm/s\", Si = \"0.1 nm/s\", default = \"0 nm/s\" "
         "}\n" +
         undercut + undercut;
}

TEST(Watchdog, TellsOfAFilmThatGoesWithWhatHoldsIt) {
  const std::string messages = messages_of(undercut_film("4 nm"), [](Survey&) {});
  EXPECT_THAT(messages,
              AllOf(HasSubstr("step \"undercut\": "), HasSubstr(" nm^3 of SiO2 disappeared, 0."),
                    HasSubstr("where rates allow 0: "), HasSubstr("domain.spacing")));
  EXPECT_THAT(messages, Not(ContainsRegex("\"open\": [^\n]* disappeared")));
  EXPECT_THAT(messages, Not(HasSubstr("of resist")));
  EXPECT_THAT(messages_of(undercut_film("20 nm"), [](Survey&) {}),
              Not(HasSubstr("where rates allow")));
  EXPECT_EQ(messages_of(undercut_film("40 nm"), [](Survey&) {}), "");
}

// A gap of one and a half spacings below it, whose edges are on nodes.
TEST(Watchdog, TellsOfAFilmThatAStepDoesNotEtchAndTheSpacingThatWouldDo) {
  const std::string messages = messages_of(undercut_film("20 nm"), [](Survey&) {});
  EXPECT_THAT(
      messages,
      ContainsRegex("step \"undercut\": .* nm.3 of SiO2 disappeared, 0.03[0-9] of it, though "
                    "the step does not etch it: .* domain.spacing, to about 2.9 nm"));
  EXPECT_EQ(messages_of(undercut_film("20 nm", "2.5 nm"), [](Survey&) {}), "");
}

TEST(Watchdog, CountsTimeStepsWhoseParticlesAreNotAllThere) {
  const std::string messages = messages_of(growing_film("1 nm/s"), [](Survey& shown) {
    shown.flux = {FluxField{.audit = {.emitted = 100, .absorbed = 50, .escaped = 48}}};
  });
  EXPECT_THAT(messages,
              AllOf(HasSubstr("time step 0 of step \"film\""), HasSubstr("0.02 of the particles"),
                    HasSubstr("are missing"), HasSubstr("5 of 5 time steps")));
}

TEST(Watchdog, AllowsParticlesTheErrorOfTheirFlux) {
  const auto with = [](double escaped, double error) {
    return messages_of(growing_film("1 nm/s"), [=](Survey& shown) {
      shown.flux = {
          FluxField{.audit = {.emitted = 100, .absorbed = 50, .escaped = escaped}, .error = error}};
    });
  };
  EXPECT_EQ(with(48, 0.021), "");
  EXPECT_THAT(with(48, 0.019), HasSubstr("are missing"));
  EXPECT_THAT(with(44, 0.5), HasSubstr("are missing"));
}

TEST(Watchdog, AllowsParticlesFiveStandardErrors) {
  FluxAudit audit{.emitted = 100, .absorbed = 50, .escaped = 49, .balance_std_error = 0.0019};
  EXPECT_TRUE(is_balanced(audit));
  audit.balance_std_error = 0.0017;
  EXPECT_FALSE(is_balanced(audit));
}

// A slab of a trench twice as deep as wide, of 272 facets: the standard error of its balance is
// known to a sixth or so, and seeds pass five of it now and then.
TEST(Watchdog, TakesNoValidMeshForUnbalancedByChance) {
  const TriMesh mesh =
      read_mesh(std::filesystem::path(SCARP_SOURCE_DIR) / "tests/reference/errors/trench_2.obj");
  const Box box = bounding_box(mesh);
  const Species gas{.name = "gas", .sticking = {0.3F}};
  FluxOptions options{
      .engine = FluxOptions::Engine::gather,
      .sides = {.lower = {box.lower.x, box.lower.y}, .upper = {box.upper.x, box.upper.y}},
      .target_error = 0.02};
  double largest = 0;
  for (options.seed = 1; options.seed <= 400; ++options.seed) {
    FluxField field = solve_flux(mesh, {&gas, 1}, options).front();
    largest =
        std::max(largest, std::abs(field.audit.balance_error()) / field.audit.balance_std_error);
    EXPECT_TRUE(is_balanced(field)) << options.seed;
    // Nor is it close: half as much again is balanced, too.
    field.audit.escaped += 0.5 * field.audit.balance_error() * field.audit.emitted;
    EXPECT_TRUE(is_balanced(field)) << options.seed;
  }
  EXPECT_LT(largest, 5);
}

// Of a step of 20 s: 5 nm at 1e8 nm/s are four hundred million.
TEST(Watchdog, EndsARunWhoseTimeStepsHaveCollapsed) {
  const Recipe recipe = read_text(growing_film("1 nm/s"));
  State state = start_state(recipe.domain.frame, recipe.start);
  begin_step(state, recipe.steps);
  std::ostringstream messages;
  Watchdog watchdog(recipe.steps, recipe.materials, recipe.domain.frame.spacing,
                    Log(messages, Log::Level::everything));
  const auto look_at_speeds = [&](float factor) {
    Survey now = survey(state, recipe);
    for (LayerSpeeds& layer : now.speeds_of_layers)
      for (auto& corners : layer.speed)
        for (float& speed : corners) speed *= factor;
    now.longest_dt /= static_cast<double>(factor);
    watchdog.look_at(state, now);
  };
  look_at_speeds(1e5F);
  EXPECT_EQ(messages.str(), "");
  look_at_speeds(1e6F);
  EXPECT_THAT(messages.str(), AllOf(HasSubstr("of them to the end of the step"),
                                    HasSubstr("1e+06 nm/s on facet"), HasSubstr("material Si")));
  EXPECT_THAT([&] { look_at_speeds(1e8F); },
              testing::ThrowsMessage<NumericalError>(
                  AllOf(HasSubstr("time step 0 of step \"film\""), HasSubstr("t = 0 s"),
                        HasSubstr("1e+08 nm/s on facet"), HasSubstr("material Si"))));
}

// What the watchdog says of a surface whose phi is this, at two moments.
std::string messages_of_phi(const std::function<double(Vec3d)>& distance) {
  const Recipe recipe = read_text(growing_film("1 nm/s"));
  State state = start_state(recipe.domain.frame, recipe.start);
  begin_step(state, recipe.steps);
  const Survey now = survey(state, recipe);
  state.layers.top() = LevelSet(recipe.domain.frame, distance, -200, 200, 4);
  std::ostringstream messages;
  Watchdog watchdog(recipe.steps, recipe.materials, recipe.domain.frame.spacing,
                    Log(messages, Log::Level::everything));
  watchdog.look_at(state, now);
  watchdog.look_at(state, now);
  watchdog.sum_up();
  return messages.str();
}

// Of 21 columns of nodes four, and the upper nodes of the one beside them.
TEST(Watchdog, CountsSurfacesOnWhichPhiIsNoDistance) {
  const auto with_slope = [](double slope) {
    return [slope](Vec3d r) { return (r.x < -65 ? slope : 1) * (r.z - 1); };
  };
  EXPECT_EQ(messages_of_phi(with_slope(1.5)), "");
  EXPECT_THAT(messages_of_phi(with_slope(3)),
              AllOf(HasSubstr("warning: time step 0 of step \"film\", t = 0 s: |grad phi| is 3"),
                    HasSubstr("on 0.21 of the surface"), HasSubstr("domain.spacing"),
                    HasSubstr("2 of 2 surfaces: |grad phi| is not 1 on a part of it, 0.21")));
}

// Edges that a strip leaves are as the grid has them: no time step did it, and none mends it.
TEST(Watchdog, TakesNoEdgesThatAStepAtOnceLeavesForBadTimeSteps) {
  const Recipe recipe = read_text(
      "[domain]\nspacing = \"10 nm\"\nextent = [\"200 nm\"]\nmode = \"2d\"\n"
      "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n"
      "[[step]]\nmodel = \"planarise\"\nheight = \"1 um\"\n");
  State state = start_state(recipe.domain.frame, recipe.start);
  begin_step(state, recipe.steps);
  Survey now = survey(state, recipe);
  const Move move = advance(state, recipe, now, no_limit);
  state.layers.top() = LevelSet(
      recipe.domain.frame, [](Vec3d r) { return 6 * (r.z - 1); }, -200, 200, 4);
  std::ostringstream messages;
  Watchdog watchdog(recipe.steps, recipe.materials, recipe.domain.frame.spacing,
                    Log(messages, Log::Level::everything));
  watchdog.note(now, move, 0);
  watchdog.look_at(state, survey(state, recipe));
  EXPECT_THAT(messages.str(), Not(HasSubstr("grad phi")));
}

TEST(Watchdog, EndsARunOnWhoseSurfacePhiIsNoDistance) {
  EXPECT_THAT([] { messages_of_phi([](Vec3d r) { return 3 * (r.z - 1); }); },
              testing::ThrowsMessage<NumericalError>(
                  AllOf(HasSubstr("time step 0 of step \"film\""), HasSubstr("t = 0 s"),
                        HasSubstr("|grad phi| is 3 at ("), HasSubstr("on 1 of the surface"))));
}

// An open mesh, one that is turned inside out somewhere, one with facets without area, and one that
// is not finite.
TEST(Watchdog, EndsARunWhoseMeshIsNoSurface) {
  const auto says = [](const std::function<void(TriMesh&)>& change) {
    try {
      messages_of(growing_film("1 nm/s"), [&](Survey& shown) { change(shown.facets); });
    } catch (const NumericalError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const auto with_place = [](const std::string& what) {
    return AllOf(HasSubstr("time step 0 of step \"film\", t = 0 s: " + what + " at ("),
                 HasSubstr(") nm of the mesh of "));
  };
  EXPECT_THAT(says([](TriMesh& mesh) { mesh.triangles.erase(mesh.triangles.begin() + 8); }),
              with_place("the facets of an edge do not close the surface"));
  EXPECT_THAT(says([](TriMesh& mesh) { std::swap(mesh.triangles[8][0], mesh.triangles[8][1]); }),
              with_place("the facets of an edge do not close the surface"));
  EXPECT_THAT(says([](TriMesh& mesh) {
                mesh.vertices[mesh.triangles[8][0]] = mesh.vertices[mesh.triangles[8][1]];
              }),
              with_place("a facet has no area"));
  EXPECT_THAT(says([](TriMesh& mesh) { mesh.vertices[7].z = -no_limit; }),
              with_place("a vertex is not finite"));
}

// On an open wafer F is 1, and its error taken for at least a thousandth.
TEST(Watchdog, TellsOfFacetsThatATargetInPositionLeavesOut) {
  const auto messages_of_rate = [](const std::string& rate) {
    return messages_of(
        "[domain]\nspacing = \"10 nm\"\nextent = [\"200 nm\"]\nmode = \"2d\"\n"
        "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n"
        "[flux]\nposition_error = \"1 nm\"\n[[step]]\nname = \"etch\"\nmodel = "
        "\"multi_particle\"\nduration = \"10 s\"\n[[step.neutral]]\nname = \"F\"\n"
        "[step.rate]\nSi = \"" +
            rate + "\"\n",
        [](Survey&) {});
  };
  EXPECT_THAT(messages_of_rate("-1 nm/s * sqrt(F - 0.9995)"),
              AllOf(HasSubstr("time step 0 of step \"etch\", t = 0 s: on 1 of the facets"),
                    HasSubstr("the rate is not finite for a flux within its error"),
                    HasSubstr("flux.position_error leaves them out")));
  EXPECT_EQ(messages_of_rate("-1 nm/s * sqrt(F - 0.99)"), "");
}

using WatchedRun = Program;

// A rate that is harmless on an open wafer and has no bound in the shade.
TEST_F(WatchedRun, EndsWhereItsTimeStepsCollapse) {
  write("r.toml",
        "[domain]\nspacing = \"10 nm\"\nextent = [\"200 nm\"]\nmode = \"2d\"\n"
        "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n"
        "[[geometry]]\nshape = \"trench\"\nwidth = \"60 nm\"\ndepth = \"300 nm\"\n"
        "[flux]\nrays = 1000\n[[step]]\nname = \"etch\"\nmodel = \"multi_particle\"\nduration = "
        "\"10 s\"\n[[step.neutral]]\nname = \"F\"\nsticking = 0.9\n"
        "[step.rate]\nSi = \"-1 nm/s * exp(30 * (1 - F))\"\n");
  const Outcome run = scarp("run " + path("r.toml") + " --quiet -o " + path("r"));
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.messages,
              AllOf(HasSubstr("time step 0 of step \"etch\""),
                    HasSubstr("of them to the end of the step"), HasSubstr("material Si")));
}

}  // namespace
}  // namespace scarp
