// scarp run as a user calls it: its files, and the same bits whoever built it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

namespace fs = std::filesystem;

using RunCommand = Program;

TEST_F(RunCommand, ARunWritesItsFiles) {
  const Outcome run = scarp("run " + small_trench("--json -o " + path("r")));
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  EXPECT_EQ(json_of(run)["process_time_s"], 30);
  EXPECT_EQ(json_of(run)["outputs"], 4);
  EXPECT_THAT(files("r"),
              ::testing::IsSupersetOf({"recipe.toml", "metrics.csv", "summary.json", "surface.pvd",
                                       "surface_0003.vtp", "state_0003.vdb", "profile_0003.csv"}));
  const std::string metrics = read_file(folder_ / "r" / "metrics.csv");
  EXPECT_EQ(metrics.rfind("step,step_name,time_s,dt_s,vertices_full,vertices,facets_full,facets,"
                          "simplify_max_distance,segments,rays,flux_error,lost_weight,"
                          "balance_error,t_surface_s,t_simplify_s,t_flux_s,t_map_s,t_advect_s",
                          0),
            0U);
}

TEST_F(RunCommand, TheThreadCountChangesNoBit) {
  ASSERT_EQ(scarp("run " + small_trench("--threads 1 -o " + path("one"))).exit_code, 0);
  ASSERT_EQ(scarp("run " + small_trench("--threads 2 -o " + path("two"))).exit_code, 0);
  expect_same_bits("one", "two");
  EXPECT_EQ(read_file(folder_ / "one" / "surface_0003.vtp"),
            read_file(folder_ / "two" / "surface_0003.vtp"));
}

// Viewers pick outputs by their timestep, and a step that acts at once takes no time.
TEST_F(RunCommand, OutputsAtOneTimeAreToldApart) {
  write("polish.toml", R"(
[domain]
mode = "2d"
spacing = "10 nm"
extent = ["200 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[step]]
name = "fill"
model = "conformal"
thickness = "50 nm"
material = "SiO2"
[[step]]
name = "polish"
model = "planarise"
height = "0 nm"
[[step]]
name = "etch"
model = "isotropic"
duration = "2 s"
etch_rate = "10 nm/s"
[output]
every = "1 s"
)");
  const Outcome run = scarp("run " + path("polish.toml") + " --json -o " + path("r"));
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  EXPECT_EQ(json_of(run)["output_times_s"], (nlohmann::json{0, 0, 0, 1, 2}));
  const std::string series = read_file(folder_ / "r" / "surface.pvd");
  const std::string title = "polish: ";
  const std::vector<std::string> moments{"start, t = 0 s", "after fill, t = 0 s",
                                         "after polish, t = 0 s", "in etch, t = 1 s",
                                         "after etch, t = 2 s"};
  for (std::size_t n = 0; n < moments.size(); ++n) {
    const std::string number = std::to_string(n);
    EXPECT_THAT(series, HasSubstr("timestep=\"" + number + "\" part=\"0\" file=\"surface_000" +
                                  number + ".vtp\""));
    EXPECT_THAT(read_file(folder_ / "r" / ("profile_000" + number + ".svg")),
                HasSubstr(title + moments[n]));
  }
  EXPECT_THAT(read_file(folder_ / "r" / "surface_0003.vtp"),
              HasSubstr("Name=\"process_time_s\" NumberOfTuples=\"1\" format=\"ascii\">1<"));
  // The oxide is there after the first step alone.
  for (const char* number : {"0000", "0001", "0002", "0004"}) {
    const bool is_there = std::string(number) == "0001";
    const std::string stem = std::string("profile_") + number;
    for (const char* ending : {".csv", ".svg"}) {
      EXPECT_EQ(read_file(folder_ / "r" / (stem + ending)).find("SiO2") != std::string::npos,
                is_there)
          << stem << ending;
    }
  }
}

// A prescribed rate asks nothing of the mesh: the surface is the same, and what is measured on it.
TEST_F(RunCommand, SimplificationChangesNothingThatIsMeasured) {
  const std::string etch = std::string(SCARP_SOURCE_DIR) +
                           "/configs/isotropic_etch.toml --set domain.spacing='\"50 nm\"' "
                           "--set step[0].duration='\"33 s\"' --quiet ";
  ASSERT_EQ(scarp("run " + etch + "-o " + path("simplified")).exit_code, 0);
  ASSERT_EQ(scarp("run " + etch + "--set simplify.enabled=false -o " + path("full")).exit_code, 0);
  EXPECT_EQ(summary("simplified")["state_hash"], summary("full")["state_hash"]);
  EXPECT_EQ(summary("simplified")["metrology"], summary("full")["metrology"]);
  EXPECT_LT(read_file(folder_ / "simplified" / "surface_0002.vtp").size(),
            0.7 * static_cast<double>(read_file(folder_ / "full" / "surface_0002.vtp").size()));
}

// Release and native, g++ and clang, today and tomorrow: who changes the numbers on purpose writes
// the new hashes to the file.
TEST_F(RunCommand, EveryBuildGivesTheKnownBits) {
  const std::string hole = std::string(SCARP_SOURCE_DIR) +
                           "/configs/hole_directional_etch.toml --set domain.spacing='\"20 nm\"' "
                           "--set flux.target_error=0.1 --quiet ";
  // A start that is put right where cuts meet (levelset/start/sheets.h).
  write("slot.toml", R"(
[domain]
spacing = "1 nm"
mode = "2d"
extent = ["60 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "layer"
material = "SiO2"
thickness = "10 nm"
[[geometry]]
shape = "trench"
width = "10 nm"
depth = "10 nm"
[[geometry]]
shape = "trench"
width = "40 nm"
depth = "15 nm"
through = ["Si"]
[[step]]
model = "isotropic"
material = "W"
growth_rate = "1 nm/s"
duration = "3 s"
)");
  const std::map<std::string, std::string> runs{
      {"slot_isotropic", path("slot.toml") + " --quiet"},
      {"trench_gather", small_trench()},
      {"trench_forward_periodic",
       small_trench("--set flux.engine='\"forward\"' --set flux.rays=100000 "
                    "--set domain.boundary='[\"periodic\", \"periodic\"]' ")},
      {"hole_beam", hole},
      {"ion_etch", small_ion_etch()}};
  const fs::path known = fs::path(SCARP_SOURCE_DIR) / "tests/reference/state_hash.json";
  nlohmann::json hashes;
  for (const auto& [name, arguments] : runs) {
    const Outcome run = scarp("run " + arguments + " --json -o " + path(name));
    ASSERT_EQ(run.exit_code, 0) << run.messages;
    hashes[name] = json_of(run)["state_hash"];
  }
  EXPECT_EQ(nlohmann::json::parse(read_file(known)), hashes) << hashes.dump(2);
}

TEST_F(RunCommand, TheResolvedRecipeGivesTheSameBits) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("first"))).exit_code, 0);
  ASSERT_EQ(scarp("run " + path("first/recipe.toml") + " --quiet -o " + path("second")).exit_code,
            0);
  const auto first = summary("first");
  const auto second = summary("second");
  EXPECT_EQ(first["state_hash"], second["state_hash"]);
}

TEST_F(RunCommand, ARunLeavesAUsersOwnFilesAlone) {
  fs::create_directories(folder_ / "own");
  write("own/recipe.toml", "# mine");
  const Outcome refused = scarp("run " + small_trench("-o " + path("own")));
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.messages, AllOf(HasSubstr("own/recipe.toml"), HasSubstr("-o")));
  EXPECT_EQ(read_file(folder_ / "own" / "recipe.toml"), "# mine");

  fs::remove(folder_ / "own" / "recipe.toml");
  write("own/profile_mine.csv", "x");
  write("own/surface_0001.vtp.tmp-1-1", "x");
  write("own/surface_scan.vtp", "x");
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("own"))).exit_code, 0);
  EXPECT_THAT(files("own"), ::testing::IsSupersetOf({"profile_mine.csv", "surface_scan.vtp",
                                                     "surface_0001.vtp.tmp-1-1"}));
}

// Where no run has been, a file that is called like an output is the user's.
TEST_F(RunCommand, ARunNeitherDeletesNorReplacesWhatNoRunHasWritten) {
  for (const char* name : {"profile_0009.csv", "surface_0000.vtp", "metrics.csv", "summary.json"}) {
    fs::remove_all(folder_ / "own");
    fs::create_directories(folder_ / "own");
    write(std::string("own/") + name, "mine");
    const Outcome refused = scarp("run " + small_trench("-o " + path("own")));
    EXPECT_EQ(refused.exit_code, 2) << name;
    EXPECT_THAT(refused.messages, AllOf(HasSubstr(std::string("own/") + name), HasSubstr("-o")));
    EXPECT_EQ(files("own"), (std::set<std::string>{".lock", name}));
    EXPECT_EQ(read_file(folder_ / "own" / name), "mine");
  }
}

TEST_F(RunCommand, ARunRemovesTheOutputsOfTheRunThatItReplaces) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  const std::string shorter = " --set step[0].duration='\"10 s\"'";
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r") + shorter)).exit_code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "r" / "profile_0001.csv"));
  EXPECT_FALSE(fs::exists(folder_ / "r" / "profile_0002.csv"));
}

TEST_F(RunCommand, AnOutputIntervalThatFillsTheDiskIsRefused) {
  const Outcome check = scarp("check " + small_trench("--set output.every='\"1e-9 s\"'"));
  EXPECT_EQ(check.exit_code, 2);
  EXPECT_THAT(check.messages, AllOf(HasSubstr("output.every"), HasSubstr("the most is 10000")));
}

TEST_F(RunCommand, AMissedTargetIsAWarning) {
  const Outcome run =
      scarp("run " + small_trench("--set flux.target_error=0.001 --set "
                                  "flux.max_rays=1000 --set flux.engine='\"forward\"' -o " +
                                  path("r")));
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.messages, AllOf(HasSubstr("warning"), HasSubstr("flux.max_rays")));
}

// The wafer shows silicon alone, which the clean leaves; in the cycles it is told of once.
TEST_F(RunCommand, AStepThatMovesNothingIsAWarning) {
  write("r.toml",
        "[domain]\nmode = \"2d\"\nspacing = \"10 nm\"\nextent = [\"100 nm\"]\n"
        "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n"
        "[[step]]\nname = \"round\"\nrepeat = 2\n"
        "[[step.step]]\nname = \"clean\"\nmodel = \"isotropic\"\nduration = \"1 s\"\n"
        "etch_rate = { SiO2 = \"1 nm/s\", default = \"0 nm/s\" }\n"
        "[[step.step]]\nname = \"etch\"\nmodel = \"isotropic\"\nduration = \"1 s\"\n"
        "etch_rate = \"1 nm/s\"\n");
  const Outcome run = scarp("run " + path("r.toml") + " -o " + path("out"));
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.messages, AllOf(HasSubstr("step \"round 1: clean\" moved nothing: the rates of "
                                            "isotropic are 0 on every exposed material (Si)"),
                                  ::testing::Not(HasSubstr("round 2: clean\" moved nothing")),
                                  ::testing::Not(HasSubstr("etch\" moved nothing"))));
  EXPECT_THAT(scarp("check " + path("r.toml")).messages,
              AllOf(HasSubstr("warning: step \"round 1: clean\" moved nothing: "),
                    ::testing::Not(HasSubstr("round 2: clean\" moved nothing")),
                    ::testing::Not(HasSubstr("etch\" moved nothing"))));
}

// In cycles, too, each is told of once.
TEST_F(RunCommand, WhatActsAtOnceInVainIsAWarning) {
  write("r.toml",
        "[domain]\nmode = \"2d\"\nspacing = \"10 nm\"\nextent = [\"400 nm\"]\n"
        "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n"
        "[[geometry]]\nshape = \"stack\"\nmaterials = [\"SiO2\", \"polySi\"]\n"
        "thicknesses = [\"100 nm\", \"100 nm\"]\n"
        "[[geometry]]\nshape = \"trench\"\nwidth = \"200 nm\"\ndepth = \"100 nm\"\n"
        "[[step]]\nname = \"cap\"\nmodel = \"conformal\"\nthickness = \"30 nm\"\n"
        "material = \"Al2O3\"\n"
        "[[step]]\nname = \"twice\"\nrepeat = 2\n"
        "[[step.step]]\nname = \"sealed\"\nmodel = \"strip\"\nmaterial = \"SiO2\"\n"
        "[[step]]\nname = \"buried\"\nmodel = \"conformal\"\nthickness = \"30 nm\"\n"
        "material = \"W\"\non = [\"polySi\", \"SiO2\"]\n"
        "[[step]]\nname = \"wide\"\nmodel = \"fill\"\nheight = \"500 nm\"\nmaterial = \"W\"\n"
        "narrower_than = \"50 nm\"\n"
        "[[step]]\nname = \"low\"\nmodel = \"fill\"\nheight = \"-50 nm\"\nmaterial = \"Cu\"\n"
        "[[step]]\nname = \"elsewhere\"\nmodel = \"fill\"\nheight = \"500 nm\"\n"
        "material = \"Cu\"\non = [\"Si\"]\n"
        "[[step]]\nname = \"high\"\nmodel = \"planarise\"\nheight = \"500 nm\"\n"
        "[[step]]\nname = \"polish\"\nmodel = \"planarise\"\nremoval = \"10 nm\"\n"
        "[[step]]\nname = \"again\"\nmodel = \"planarise\"\nstop_material = \"Al2O3\"\n"
        "[[step]]\nname = \"plug\"\nmodel = \"fill\"\nabove = \"10 nm\"\nmaterial = \"Cu\"\n"
        "[[step]]\nname = \"ash\"\nmodel = \"strip\"\nmaterial = \"Cu\"\n"
        "[[step]]\nname = \"ash again\"\nmodel = \"strip\"\nmaterial = \"Cu\"\n");
  const Outcome run = scarp("run " + path("r.toml") + " -o " + path("out"));
  EXPECT_EQ(run.exit_code, 0);
  const auto says = [&](const std::string& step, const std::string& why) {
    EXPECT_THAT(run.messages, HasSubstr("warning: step \"" + step + "\" moved nothing: " + why));
  };
  says("twice 1: sealed", "gas does not reach the SiO2; open it first, or set buried = true");
  says("buried", "gas does not reach the materials on which it grows (polySi, SiO2); ");
  says("wide", "no opening below its plane is narrower than 50 nm; raise height or narrower_than");
  says("low", "no gas that is joined to the source lies below its plane; raise height");
  says("elsewhere", "below its plane no gas lies straight above its materials (Si); raise height");
  says("high", "the surface lies below 500 nm everywhere; lower height");
  says("again", "nothing lies above the Al2O3; leave the step out");
  says("ash again", "there is no Cu on the wafer; leave the step out");
  for (const char* const moves : {"twice 2: sealed", "cap", "polish", "plug", "ash"})
    EXPECT_THAT(run.messages,
                ::testing::Not(HasSubstr(std::string("step \"") + moves + "\" moved nothing")));
}

// 500 nm at 1 nm/s in place of the longest time, and 10 s that are to come; a time step more, as
// speeds are those before it.
TEST_F(RunCommand, ProgressCountsToTheExpectedEnd) {
  write("r.toml",
        "[domain]\nmode = \"2d\"\nspacing = \"10 nm\"\nextent = [\"100 nm\"]\n"
        "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n"
        "[[step]]\nmodel = \"isotropic\"\nduration = \"9000 s\"\netch_rate = \"1 nm/s\"\n"
        "until = { depth = \"500 nm\" }\n"
        "[[step]]\nmodel = \"isotropic\"\nduration = \"10 s\"\netch_rate = \"1 nm/s\"\n");
  const Outcome run = scarp("run " + path("r.toml") + " -o " + path("out"));
  EXPECT_THAT(run.messages, ::testing::ContainsRegex("t = 4 of about 51[0-9] s "));
  EXPECT_THAT(run.messages, HasSubstr("t = 510 of 510 s "));
}

// A groove that narrows to 60 nm: an etch goes on there, a film does not make it deeper.
TEST_F(RunCommand, AnEtchInAFewSpacingsIsAWarning) {
  const auto messages = [&](const std::string& spacing, const std::string& step) {
    write("groove.toml", R"(
[domain]
mode = "2d"
extent = ["400 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "trench"
width = "200 nm"
depth = "300 nm"
taper = "13 deg"
[output]
every = "10 s"
[[step]]
duration = "30 s"
)" + step);
    return scarp("run " + path("groove.toml") + " --set domain.spacing='\"" + spacing +
                 "\"' --quiet -o " + path("r"))
        .messages;
  };
  const std::string etch = "model = \"directional\"\ndirectional_etch_rate = \"4 nm/s\"\n";
  const std::string film = "model = \"isotropic\"\ngrowth_rate = \"1 nm/s\"\nmaterial = \"SiO2\"\n";
  const std::string unresolved = "trench 1 is still being etched where it is only ";
  EXPECT_THAT(messages("20 nm", etch), HasSubstr(unresolved));
  EXPECT_THAT(messages("10 nm", etch), Not(HasSubstr(unresolved)));
  EXPECT_THAT(messages("20 nm", film), Not(HasSubstr(unresolved)));
}

TEST_F(RunCommand, NamesMayHoldAnyCharacterThatShows) {
  const Outcome run =
      scarp("run " + small_trench("--set title='\"a<b & \\\"c\\\", \u00b5\"' --set "
                                  "step[0].name='\"one, \\\"two\\\" three\"' --json -o " +
                                  path("r")));
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  EXPECT_THAT(json_of(run)["title"], HasSubstr("a<b & \"c\""));
  const std::string metrics = read_file(folder_ / "r" / "metrics.csv");
  EXPECT_THAT(metrics, HasSubstr("0,\"one, \"\"two\"\" three\",5,"));
  const std::string picture = read_file(folder_ / "r" / "profile_0000.svg");
  EXPECT_THAT(picture, HasSubstr("a&lt;b &amp; &quot;c&quot;"));
}

TEST_F(RunCommand, AWrongRecipeIsExitTwoAndLeavesNoFolder) {
  write("bad.toml", "[domain]\nspacing = \"5\"\n");
  const Outcome bad = scarp("run " + path("bad.toml") + " -o " + path("r"));
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_THAT(bad.messages, HasSubstr("bad.toml:2:11: domain.spacing"));
  EXPECT_FALSE(fs::exists(folder_ / "r"));
}

TEST_F(RunCommand, AFolderThatCannotBeMadeIsExitTwo) {
  write("file", "");
  const Outcome run = scarp("run " + small_trench("-o " + path("file/r")));
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.messages, AllOf(HasSubstr("file/r"), HasSubstr("-o")));
}

TEST_F(RunCommand, ARunThatReplacesAnotherSaysSo) {
  std::string loud = small_trench("-o " + path("r"));
  loud.erase(loud.find(" --quiet"), 8);
  EXPECT_THAT(scarp("run " + loud).messages, ::testing::Not(HasSubstr("replaces")));
  EXPECT_THAT(scarp("run " + loud).messages, HasSubstr(path("r") + ": replaces the run"));
}

TEST_F(RunCommand, ResultsNameTheMaterials) {
  const Outcome run = scarp("run " + small_trench("--json -o " + path("r")));
  EXPECT_EQ(json_of(run)["materials"], (nlohmann::json{{"Si", 0}, {"SiO2", 2}}));
  EXPECT_THAT(read_file(folder_ / "r" / "surface_0000.vtp"), HasSubstr("Name=\"material_names\""));
}

}  // namespace
}  // namespace scarp
