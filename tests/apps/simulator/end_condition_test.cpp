#include "apps/simulator/end_condition.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "apps/run/run.h"
#include "core/error.h"
#include "tests/apps/columns.h"
#include "tests/apps/final_state.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

/// 30 nm of oxide on silicon, and resist that is open in the middle.
std::string masked_oxide(bool two_dimensional) {
  return std::string("[domain]\nspacing = \"2 nm\"\n") +
         (two_dimensional ? "mode = \"2d\"\nextent = [\"80 nm\"]\n"
                          : "extent = [\"80 nm\", \"8 nm\"]\n") +
         R"(
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "layer"
material = "SiO2"
thickness = "30 nm"
[[geometry]]
shape = "mask"
material = "resist"
thickness = "20 nm"
opening = { shape = "trench", width = "40 nm" }
)";
}

constexpr const char* etch = R"([[step]]
name = "etch"
model = "directional"
duration = "100 s"
directional_etch_rate = { SiO2 = "1 nm/s", Si = "0.25 nm/s", resist = "0 nm/s" }
)";
constexpr const char* film = R"([[step]]
name = "film"
model = "isotropic"
duration = "100 s"
growth_rate = "1 nm/s"
material = "Si3N4"
)";

/// A step, its end, and when it has to come.
struct Ending {
  const char* step;
  const char* until;
  double reached;
  double end;
};

// Steps of 0.4 spacings: none of these moments is the end of one of them. A film is taken for gone
// when a thousandth of a spacing is left of it.
const std::vector<Ending> endings{
    {etch, "depth = \"13.37 nm\"", 13.37, 13.37},
    {etch, "depth = \"31 nm\"", 34, 34},
    {etch, "depth = \"1.1 nm\", material = \"Si\"", 34.4, 34.4},
    {etch, "depth = \"31.1 nm\", at = [AT(3.3)]", 34.4, 34.4},
    {etch, "exposed = \"Si\"", 30, 30},
    {etch, "exposed = \"Si\", over_etch = \"20 %\"", 30, 36},
    {etch, "exposed = \"Si\", at = [AT(-7)], over_etch = \"12.5 %\"", 30, 33.75},
    {etch, "gone = \"SiO2\", at = [AT(5)]", 30, 30},
    {film, "thickness = \"7.77 nm\"", 7.77, 7.77},
    {film, "thickness = \"7.77 nm\", at = [AT(0)]", 7.77, 7.77},
};

std::string with_place(std::string text, bool two_dimensional) {
  const std::size_t at = text.find("AT(");
  if (at == std::string::npos) return text;
  const std::size_t end = text.find(')', at);
  const std::string x = "\"" + text.substr(at + 3, end - at - 3) + " nm\"";
  return text.replace(at, end + 1 - at, two_dimensional ? x : x + ", \"1.3 nm\"");
}

TEST(EndCondition, IsMetAtItsMomentInTwoAndThreeDimensions) {
  for (const bool two_dimensional : {true, false}) {
    for (const Ending& each : endings) {
      const std::string until = with_place(each.until, two_dimensional);
      SCOPED_TRACE(until);
      const Recipe recipe =
          read_text(masked_oxide(two_dimensional) + each.step + "until = { " + until + " }\n");
      const State state = final_state(recipe);
      ASSERT_EQ(state.ends.size(), 1U);
      const StepEnd& end = state.ends.front();
      EXPECT_FALSE(end.out_of_time);
      // A ten-thousandth of a spacing; through a film a thousandth, at a quarter of the rate; a
      // thousandth of it and of a time step.
      const bool is_measured = is_length(*recipe.steps.front().until);
      const double tolerance = !is_measured        ? 1e-3 * 2 + 1e-3 * 0.8
                               : each.reached > 30 ? 1e-3 * 2 / 0.25
                                                   : 1e-4 * 2;
      ASSERT_TRUE(end.reached.has_value());
      EXPECT_NEAR(*end.reached, each.reached, 1.01 * tolerance);
      EXPECT_NEAR(end.time, each.end, 1.3 * tolerance);
      EXPECT_EQ(end.time, state.time);
    }
  }
}

// Oxide stays under the resist, with walls that gas reaches, until a wet etch has taken it all.
TEST(EndCondition, AMaterialIsGoneOnlyWhenNothingOfItIsSeenAnyMore) {
  const Recipe directional = read_text(masked_oxide(true) + etch + "until = { gone = \"SiO2\" }\n");
  EXPECT_TRUE(final_state(directional).ends.front().out_of_time);
  const Recipe wet = read_text(masked_oxide(true) +
                               "[[step]]\nmodel = \"isotropic\"\nduration = \"100 s\"\n"
                               "etch_rate = { SiO2 = \"1 nm/s\", default = \"0 nm/s\" }\n"
                               "until = { gone = \"SiO2\" }\n");
  // From the opening to the sides of the domain are 20 nm; the last of it goes at the foot, 30 nm
  // below the edge of the resist.
  EXPECT_NEAR(final_state(wet).ends.front().time, std::hypot(20, 30), 1.5);
}

// What is seen from above, not what lies lowest: a trench beside a deeper one.
TEST(EndCondition, AtAPlaceIsThatOfTheFeatureThere) {
  constexpr const char* trenches = R"(
[domain]
spacing = "2 nm"
extent = ["80 nm"]
mode = "2d"
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "trench"
width = "20 nm"
depth = "30 nm"
center = "-20 nm"
[[step]]
model = "isotropic"
duration = "100 s"
growth_rate = "1 nm/s"
material = "SiO2"
)";
  const auto end = [&](const std::string& until) {
    return final_state(read_text(trenches + ("until = { " + until + " }\n"))).time;
  };
  // Over the gap, closed after 10 s, arcs about its edges meet at the root of t^2 - 10^2.
  EXPECT_NEAR(end("thickness = \"9 nm\", at = [\"-20 nm\"]"), 9, 0.01);
  EXPECT_NEAR(end("thickness = \"36 nm\", at = [\"-20 nm\"]"), std::hypot(10, 6), 0.7);
  EXPECT_NEAR(end("thickness = \"12 nm\""), 12, 1e-3);
}

TEST(EndCondition, SaysWhatItWaitsForAndWhere) {
  const Materials materials;
  EndCondition condition{.kind = EndCondition::Kind::exposed, .material = materials.id("SiO2")};
  EXPECT_EQ(text_of(condition, materials, {}), "SiO2 exposed");
  condition.place = {1000, -20};
  EXPECT_EQ(text_of(condition, materials, {}), "SiO2 exposed at (1 um, -20 nm)");
  EXPECT_EQ(text_of(condition, materials, {.two_dimensional = true}), "SiO2 exposed at x = 1 um");
}

// The mean over a surface with noise of 1 % is not what ends the step, but its highest point: it
// ends early, by a little less than that over eight seeds.
TEST(EndCondition, OfAFilmIsMetWithinTheErrorOfTheFlux) {
  const std::string text = R"(
[domain]
spacing = "2 nm"
extent = ["40 nm", "40 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[flux]
engine = "forward"
target_error = 0.01
[[step]]
model = "single_particle"
duration = "1 min"
growth_rate = "1 nm/s"
material = "SiO2"
until = { thickness = "20 nm" }
)";
  constexpr int seeds = 8;
  double mean = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    Recipe recipe = read_text(text);
    recipe.flux.options.seed = static_cast<std::uint64_t>(seed);
    mean += final_state(recipe).time / seeds;
  }
  EXPECT_NEAR(mean, 20, 0.01 * 20);
}

struct Mistake {
  const char* step;
  const char* until;
  const char* message;
};

const std::vector<Mistake> mistakes{
    {etch, "exposed = \"SiGe\"",
     "until.exposed: there is no SiGe on the wafer when the step begins; there is Si, SiO2, "
     "resist"},
    {etch, "depth = \"1 nm\", material = \"SiGe\"",
     "until.material: there is no SiGe on the wafer"},
    {etch, "thickness = \"1 nm\"", "until.thickness: the step deposits nothing"},
    {film, "depth = \"1 nm\"", "until.depth: the step etches nothing"},
    {film, "gone = \"SiO2\"", "until.gone: the step etches nothing"},
    {film, "exposed = \"Si3N4\"", "until.exposed: the step etches nothing"},
    {etch, "depth = \"1 nm\", exposed = \"Si\"",
     "until.exposed: depth and exposed exclude each other"},
    {etch, "depth = \"1 nm\", over_etch = \"5 %\"", "until.over_etch: goes with exposed and gone"},
    {etch, "gone = \"SiO2\", material = \"Si\"", "until.material: goes with depth"},
    {etch, "exposed = \"Si\", over_etch = 20", "20 has no unit; write for example \"20 %\""},
    {etch, "exposed = \"Si\", over_etch = \"5 nm\"", "is a length; a percentage is wanted"},
    {etch, "exposed = \"Si\", over_etch = \"-1 %\"", "is outside [0, 1000 %]"},
    {etch, "depth = \"0 nm\"", "until.depth: \"0 nm\" is outside"},
    {etch, "depth = \"1 nm\", at = [\"41 nm\"]", "until.at[0]: 41 nm lies outside the domain"},
    {etch, "", "until: missing; say what ends the step"},
    {etch, "dept = \"1 nm\"", "until.dept: unknown key (did you mean depth?)"},
    {"[[step]]\nmodel = \"planarise\"\nheight = \"1 nm\"\n", "depth = \"1 nm\"",
     "until: planarise acts at once"},
};

TEST(EndCondition, ThatCannotBeIsTold) {
  for (const Mistake& mistake : mistakes) {
    SCOPED_TRACE(mistake.until);
    try {
      read_text(masked_oxide(true) + mistake.step + "until = { " + mistake.until + " }\n");
      FAIL() << "is accepted";
    } catch (const InputError& error) {
      const std::string text = error.what();
      EXPECT_THAT(text, HasSubstr("step[0]"));
      EXPECT_THAT(text, HasSubstr(mistake.message));
      EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    }
  }
}

// In the first round of a cycle the film is not there yet when the step begins that takes it off.
TEST(EndCondition, MayWaitForWhatACycleDeposits) {
  EXPECT_NO_THROW(read_text(masked_oxide(true) + R"([[step]]
repeat = 2
[[step.step]]
model = "isotropic"
duration = "10 s"
etch_rate = { Si3N4 = "1 nm/s", default = "0 nm/s" }
until = { gone = "Si3N4" }
[[step.step]]
model = "isotropic"
duration = "2 s"
growth_rate = "1 nm/s"
material = "Si3N4"
)"));
}

class EndConditionRun : public Program {
 protected:
  /// In the rows of metrics.csv that say any.
  std::vector<std::string> causes_of_repeats(const std::string& run) const {
    std::vector<std::string> causes = columns_of(folder_ / run / "metrics.csv")["repeat_ended_by"];
    std::erase(causes, "");
    return causes;
  }
};

/// Films of 3 nm that are cleared again, and deeper each time: three steps of two cycles.
std::string cycles() {
  return masked_oxide(true) + R"([[step]]
name = "cycle"
repeat = 2
[[step.step]]
name = "film"
model = "isotropic"
duration = "9 s"
growth_rate = "1 nm/s"
material = "polymer"
until = { thickness = "3.1 nm" }
[[step.step]]
name = "clear"
model = "directional"
duration = "50 s"
directional_etch_rate = { polymer = "1 nm/s", default = "0 nm/s" }
until = { exposed = "SiO2", over_etch = "50 %" }
[[step.step]]
name = "etch"
model = "single_particle"
duration = "50 s"
etch_rate = { SiO2 = "1 nm/s", default = "0 nm/s" }
sticking = 0.2
until = { depth = "5 nm" }
[output]
every = "1.3 s"
)";
}

// A fin is etched from both sides on a floor that is not, or a hundred times more slowly: its
// flanks meet between two nodes at the foot, where up to a spacing of it seemed left.
TEST_F(EndConditionRun, AFinIsGoneWhenItsFlanksMeet) {
  const std::string fin =
      read_file(std::string(SCARP_SOURCE_DIR) + "/tests/reference/ends/film_gone.toml");
  write("fin.toml", fin);
  for (const double spacing : {10.0, 12.5}) {
    for (const double width : {195, 200, 207, 217}) {
      for (const char* const floor : {"0", "0.01"}) {
        std::filesystem::remove_all(folder_ / "run");
        const Outcome outcome = scarp(
            "run " + path("fin.toml") + " --quiet -o " + path("run") +
            fmt::format(" --set 'domain.spacing=\"{} nm\"' --set 'geometry[1].width=\"{} nm\"'"
                        " --set 'step[0].etch_rate.Si=\"{} nm/s\"'",
                        spacing, width, floor));
        ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
        const double reached = summary("run")["steps"][0]["reached_s"];
        EXPECT_NEAR(reached, width / 2, 0.1 * spacing) << spacing << " " << width << " " << floor;
      }
    }
  }
}

// By upwind differences feet were left behind, up to half a spacing beside a slow floor; WENO5 let
// them get ahead.
TEST_F(EndConditionRun, AFinIsGoneInTimeByAllSchemes) {
  write("fin.toml",
        read_file(std::string(SCARP_SOURCE_DIR) + "/tests/reference/ends/film_gone.toml"));
  constexpr double spacing = 10;
  for (const char* const scheme : {"first_order", "weno5"}) {
    for (const double middle : {0.0, 1.0, 2.5, 5.0}) {
      for (const char* const floor : {"0", "0.1"}) {
        std::filesystem::remove_all(folder_ / "run");
        const Outcome outcome = scarp(
            "run " + path("fin.toml") + " --quiet -o " + path("run") +
            fmt::format(" --set 'geometry[1].center=\"{} nm\"' --set 'advection.scheme=\"{}\"'"
                        " --set 'step[0].etch_rate.Si=\"{} nm/s\"'",
                        middle, scheme, floor));
        ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
        const double reached = summary("run")["steps"][0]["reached_s"];
        EXPECT_NEAR(reached, 100, 0.05 * spacing) << scheme << " " << middle << " " << floor;
      }
    }
  }
}

TEST_F(EndConditionRun, SaysInItsResultsWhenAndWhyEachStepEnded) {
  write("r.toml", cycles());
  const Outcome run = scarp("run " + path("r.toml") + " -o " + path("out"));
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  EXPECT_THAT(run.messages, HasSubstr("step \"cycle 1: film\" ended at t = 3.1 s: a thickness of "
                                      "3.1 nm"));
  const auto steps = summary("out")["steps"];
  ASSERT_EQ(steps.size(), 6U);
  double start = 0;
  for (std::size_t n = 0; n < 6; ++n) {
    EXPECT_EQ(steps[n]["start_s"].get<double>(), start);
    start = steps[n]["end_s"];
    EXPECT_EQ(steps[n]["ended_by"], n % 3 == 0 ? "thickness" : n % 3 == 1 ? "exposed" : "depth");
  }
  EXPECT_NEAR(steps[1]["reached_s"].get<double>(), 6.2, 0.01);
  EXPECT_NEAR(steps[1]["end_s"].get<double>(), 6.2 + 1.55, 0.02);
  // One row of each step ends it, and says why.
  std::istringstream rows(read_file(folder_ / "out" / "metrics.csv"));
  std::vector<std::string> causes;
  for (std::string row; std::getline(rows, row);) {
    for (const char* cause : {",thickness,", ",exposed,", ",depth,", ",duration,"})
      if (row.find(cause) != std::string::npos) causes.emplace_back(cause);
  }
  EXPECT_EQ(causes, (std::vector<std::string>{",thickness,", ",exposed,", ",depth,", ",thickness,",
                                              ",exposed,", ",depth,"}));
}

// Also where the middle of the fin lies between two nodes, which turn to gas at once if it is
// half-way.
TEST_F(EndConditionRun, AFinIsGoneInTimeWhereverItsMiddleLies) {
  write("fin.toml",
        read_file(std::string(SCARP_SOURCE_DIR) + "/tests/reference/ends/film_gone.toml"));
  constexpr double spacing = 10;
  for (const double width : {195, 200, 207}) {
    for (const double middle : {2.0, 2.5, 3.0, 4.0, 5.0, 6.0}) {
      for (const char* const floor : {"0", "0.01"}) {
        std::filesystem::remove_all(folder_ / "run");
        const Outcome outcome = scarp(
            "run " + path("fin.toml") + " --quiet -o " + path("run") +
            fmt::format(" --set 'geometry[1].width=\"{} nm\"' --set 'geometry[1].center=\"{} nm\"'"
                        " --set 'step[0].etch_rate.Si=\"{} nm/s\"'",
                        width, middle, floor));
        ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
        const double reached = summary("run")["steps"][0]["reached_s"];
        EXPECT_NEAR(reached, width / 2, 0.1 * spacing) << width << " " << middle << " " << floor;
      }
    }
  }
}

// Wherever it was interrupted: between its steps, before its end, and in the over-etch.
TEST_F(EndConditionRun, GoesOnWithTheSameBitsAfterAnInterruption) {
  write("r.toml", cycles());
  ASSERT_EQ(scarp("run " + path("r.toml") + " --quiet -o " + path("whole")).exit_code, 0);
  const auto whole = summary("whole");
  const int outputs = whole["outputs"];
  ASSERT_GT(outputs, 12);
  for (int kept = 1; kept < outputs; kept += 5) {
    SCOPED_TRACE(kept);
    fs::remove_all(folder_ / "cut");
    fs::copy(folder_ / "whole", folder_ / "cut", fs::copy_options::recursive);
    fs::remove(folder_ / "cut" / "summary.json");
    for (int n = kept; n < outputs; ++n) {
      const std::string number = std::to_string(10000 + n).substr(1);
      fs::remove(folder_ / "cut" / ("state_" + number + ".vdb"));
    }
    ASSERT_EQ(scarp("run " + path("r.toml") + " --quiet --resume -o " + path("cut")).exit_code, 0);
    expect_same_bits("whole", "cut");
    EXPECT_EQ(summary("cut")["steps"], whole["steps"]);
  }
}

TEST_F(EndConditionRun, WarnsWhereTheDurationCameFirstOrNothingWasLeftToDo) {
  write("r.toml", masked_oxide(true) + std::string(etch) +
                      "until = { exposed = \"Si\", over_etch = \"10 %\" }\n" + etch +
                      "until = { exposed = \"Si\" }\n");
  const auto run = [&](const std::string& duration) {
    return scarp("run " + path("r.toml") + " --set step[0].duration='\"" + duration + "\"' -o " +
                 path("out"));
  };
  EXPECT_THAT(run("10 s").messages,
              AllOf(HasSubstr("step \"etch\" ended at t = 10 s by its duration of 10 s, before Si "
                              "exposed; raise"),
                    Not(HasSubstr("took no time"))));
  EXPECT_EQ(summary("out")["steps"][0]["ended_by"], "duration");
  EXPECT_EQ(summary("out")["steps"][0]["reached_s"], nullptr);
  EXPECT_THAT(run("31 s").messages,
              AllOf(HasSubstr("before Si exposed (at 29.99"), HasSubstr("10 % of over-etch; raise"),
                    HasSubstr("step \"etch\" took no time: Si exposed when it began")));
  EXPECT_EQ(summary("out")["steps"][1]["start_s"], summary("out")["steps"][1]["end_s"]);
  EXPECT_THAT(run("50 s").messages, AllOf(HasSubstr("step \"etch\" ended at t = 32.9"),
                                          Not(HasSubstr("by its duration"))));
}

TEST_F(EndConditionRun, IsPrintedAndForeseenByCheck) {
  for (const Ending& each : endings) {
    const std::string until = with_place(each.until, true);
    SCOPED_TRACE(until);
    write("r.toml", masked_oxide(true) + each.step + "until = { " + until + " }\n");
    const auto check = json_of(scarp("check --json " + path("r.toml")));
    EXPECT_THAT(check["recipe"].get<std::string>(), HasSubstr("[step.until]\n"));
    ASSERT_EQ(check["ends"].size(), 1U);
    EXPECT_NEAR(check["ends"][0]["expected_s"].get<double>(), each.end, 0.05 * each.end);
    EXPECT_LT(check["time_steps"].get<double>(), 60);
  }
  EXPECT_THAT(
      scarp("check " + path("r.toml")).out,
      HasSubstr(
          "#   film: a thickness of 7.77 nm at x = 0 nm, after about 7.77 s, at most 100 s\n"));
}

/// Rounds of 2 nm and 1 nm of oxide, as long as a condition wants.
std::string rounds(int repeat, const std::string& until) {
  return masked_oxide(true) + "[[step]]\nname = \"round\"\nrepeat = " + std::to_string(repeat) +
         "\n" + until + R"([[step.step]]
name = "fast"
model = "isotropic"
duration = "1 s"
etch_rate = { SiO2 = "2 nm/s", default = "0 nm/s" }
[[step.step]]
name = "slow"
model = "isotropic"
duration = "1 s"
etch_rate = { SiO2 = "1 nm/s", default = "0 nm/s" }
[[step]]
name = "after"
model = "isotropic"
duration = "1 s"
etch_rate = { SiO2 = "0.5 nm/s", default = "0 nm/s" }
[output]
every = "0.7 s"
)";
}

// 3 nm in a round: 8 nm take three of them, and all goes on as if there were no more.
TEST_F(EndConditionRun, RoundsGoOnUntilTheConditionHolds) {
  write("until.toml", rounds(10, "until = { depth = \"8 nm\" }\n"));
  write("three.toml", rounds(3, ""));
  const Outcome run = scarp("run " + path("until.toml") + " -o " + path("until"));
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  EXPECT_THAT(run.messages,
              HasSubstr("\"round\" ended after 3 rounds at t = 6 s: a depth of 8 nm"));
  ASSERT_EQ(scarp("run " + path("three.toml") + " --quiet -o " + path("three")).exit_code, 0);
  EXPECT_EQ(summary("until")["state_hash"], summary("three")["state_hash"]);
  EXPECT_EQ(summary("until")["repeats"],
            nlohmann::json::parse(
                R"([{"name": "round", "rounds": 3, "end_s": 6.0, "ended_by": "depth"}])"));
  EXPECT_EQ(summary("three")["repeats"], nlohmann::json::array());
  EXPECT_EQ(causes_of_repeats("until"), (std::vector<std::string>{"depth"}));
  EXPECT_TRUE(causes_of_repeats("three").empty());
  EXPECT_EQ(summary("until")["steps"], summary("three")["steps"]);
  ASSERT_EQ(summary("until")["steps"].size(), 7U);

  const Outcome few = scarp(
      "run " + path("until.toml") +
      " --set step[0].until='{ depth = \"40 nm\" }' --set step[0].repeat=2 -o " + path("few"));
  EXPECT_THAT(few.messages,
              HasSubstr("\"round\" made 2 rounds before a depth of 40 nm; raise its repeat"));
  EXPECT_EQ(summary("few")["repeats"][0]["ended_by"], "repeat");
  EXPECT_EQ(causes_of_repeats("few"), (std::vector<std::string>{"repeat"}));
}

TEST_F(EndConditionRun, RoundsGoOnWithTheSameBitsAfterAnInterruption) {
  write("r.toml", rounds(10, "until = { depth = \"8 nm\" }\n"));
  ASSERT_EQ(scarp("run " + path("r.toml") + " --quiet -o " + path("whole")).exit_code, 0);
  const int outputs = summary("whole")["outputs"];
  for (int kept = 2; kept < outputs; kept += 4) {
    SCOPED_TRACE(kept);
    fs::remove_all(folder_ / "cut");
    fs::copy(folder_ / "whole", folder_ / "cut", fs::copy_options::recursive);
    fs::remove(folder_ / "cut" / "summary.json");
    for (int n = kept; n < outputs; ++n)
      fs::remove(folder_ / "cut" / ("state_" + std::to_string(10000 + n).substr(1) + ".vdb"));
    ASSERT_EQ(scarp("run " + path("r.toml") + " --quiet --resume -o " + path("cut")).exit_code, 0);
    expect_same_bits("whole", "cut");
    EXPECT_EQ(summary("cut")["steps"], summary("whole")["steps"]);
    EXPECT_EQ(summary("cut")["repeats"], summary("whole")["repeats"]);
  }
}

TEST(EndCondition, OfRoundsThatCannotBeIsTold) {
  const auto expect = [](const std::string& until, const std::string& message) {
    EXPECT_THAT([&] { read_text(rounds(3, until)); }, ThrowsMessage<InputError>(HasSubstr(message)))
        << until;
  };
  expect("until = { exposed = \"Si\", over_etch = \"5 %\" }\n",
         "step[0].until.over_etch: rounds are whole, so there is no over-etch");
  expect("until = { exposed = \"Cu\" }\n", "step[0].until.exposed: there is no Cu on the wafer");
  expect("until = { }\n", "step[0].until: missing; say what ends the step");
  EXPECT_THAT(
      [] {
        read_text(masked_oxide(true) +
                  "[[step]]\nrepeat = 2\nuntil = { exposed = \"Si\" }\n[[step.step]]\nrepeat = 3\n"
                  "until = { exposed = \"Si\" }\n[[step.step.step]]\nmodel = \"isotropic\"\n"
                  "duration = \"1 s\"\netch_rate = \"1 nm/s\"\n");
      },
      ThrowsMessage<InputError>(HasSubstr("step[0].step[0].until: only one level of nested repeats "
                                          "may have until; leave it out here or outside")));
}

}  // namespace
}  // namespace scarp
