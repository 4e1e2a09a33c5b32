// The program as a user calls it: exit codes, files, and nothing half written.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>

#include "tests/temporary_folder.h"

namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

namespace fs = std::filesystem;

struct Outcome {
  int exit_code = 0;
  std::string out;
  std::string messages;
};

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

class CommandLine : public ::testing::Test {
 protected:
  Outcome scarp(const std::string& arguments) const {
    const fs::path messages = folder_ / "messages.txt";
    const std::string line =
        std::string(SCARP_BINARY) + " " + arguments + " 2>" + messages.string();
    FILE* pipe = popen(line.c_str(), "r");
    Outcome outcome;
    std::array<char, 4096> buffer{};
    for (std::size_t n = 0; (n = fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
      outcome.out.append(buffer.data(), n);
    }
    outcome.exit_code = WEXITSTATUS(pclose(pipe));
    outcome.messages = text_of(messages);
    return outcome;
  }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  std::set<std::string> files(const std::string& name) const {
    std::set<std::string> found;
    for (const auto& entry : fs::directory_iterator(folder_ / name)) {
      found.insert(entry.path().filename().string());
    }
    return found;
  }

  // A trench run that takes about a second.
  std::string small_trench(const std::string& more = "") const {
    return std::string(SCARP_SOURCE_DIR) +
           "/configs/trench_deposition.toml --set domain.spacing='\"0.4 um\"' "
           "--set domain.extent='[\"10 um\", \"2 um\"]' --set flux.target_error=0.1 "
           "--set step[0].duration='\"30 s\"' --set output.every='\"10 s\"' --quiet " +
           more;
  }

  scarp::TemporaryFolder folder_;
};

nlohmann::json json_of(const Outcome& outcome) { return nlohmann::json::parse(outcome.out); }

// metrics.csv without the columns that hold wall times.
std::string metrics_without_times(const fs::path& file) {
  std::istringstream in(text_of(file));
  std::string kept;
  std::set<std::size_t> times;
  std::string line;
  for (bool head = true; std::getline(in, line); head = false) {
    std::istringstream cells(line);
    std::string cell;
    for (std::size_t column = 0; std::getline(cells, cell, ','); ++column) {
      if (head && cell.rfind("t_", 0) == 0) times.insert(column);
      if (!times.contains(column)) kept += cell + ',';
    }
    kept += '\n';
  }
  return kept;
}

TEST_F(CommandLine, ARunWritesItsFiles) {
  const Outcome run = scarp("run " + small_trench("--json -o " + path("r")));
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  EXPECT_EQ(json_of(run)["process_time_s"], 30);
  EXPECT_EQ(json_of(run)["outputs"], 4);
  EXPECT_THAT(files("r"),
              ::testing::IsSupersetOf({"recipe.toml", "metrics.csv", "summary.json", "surface.pvd",
                                       "surface_0003.vtp", "state_0003.vdb", "profile_0003.csv"}));
  const std::string metrics = text_of(folder_ / "r" / "metrics.csv");
  EXPECT_EQ(metrics.rfind("step,step_name,time_s,dt_s,vertices_full,vertices,facets_full,facets,"
                          "simplify_max_distance,segments,rays,flux_error,lost_weight,"
                          "balance_error,t_surface_s,t_simplify_s,t_flux_s,t_map_s,t_advect_s",
                          0),
            0U);
}

TEST_F(CommandLine, TheThreadCountChangesNoBit) {
  ASSERT_EQ(scarp("run " + small_trench("--threads 1 -o " + path("one"))).exit_code, 0);
  ASSERT_EQ(scarp("run " + small_trench("--threads 2 -o " + path("two"))).exit_code, 0);
  const auto one = nlohmann::json::parse(text_of(folder_ / "one" / "summary.json"));
  const auto two = nlohmann::json::parse(text_of(folder_ / "two" / "summary.json"));
  EXPECT_EQ(one["state_hash"], two["state_hash"]);
  EXPECT_EQ(metrics_without_times(folder_ / "one" / "metrics.csv"),
            metrics_without_times(folder_ / "two" / "metrics.csv"));
  EXPECT_EQ(text_of(folder_ / "one" / "surface_0003.vtp"),
            text_of(folder_ / "two" / "surface_0003.vtp"));
}

// Viewers pick outputs by their timestep, and a step that acts at once takes no time.
TEST_F(CommandLine, OutputsAtOneTimeAreToldApart) {
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
  const std::string series = text_of(folder_ / "r" / "surface.pvd");
  const std::string title = "polish: ";
  const std::vector<std::string> moments{"start, t = 0 s", "after fill, t = 0 s",
                                         "after polish, t = 0 s", "in etch, t = 1 s",
                                         "after etch, t = 2 s"};
  for (std::size_t n = 0; n < moments.size(); ++n) {
    const std::string number = std::to_string(n);
    EXPECT_THAT(series, HasSubstr("timestep=\"" + number + "\" part=\"0\" file=\"surface_000" +
                                  number + ".vtp\""));
    EXPECT_THAT(text_of(folder_ / "r" / ("profile_000" + number + ".svg")),
                HasSubstr(title + moments[n]));
  }
  EXPECT_THAT(text_of(folder_ / "r" / "surface_0003.vtp"),
              HasSubstr("Name=\"process_time_s\" NumberOfTuples=\"1\" format=\"ascii\">1<"));
  // The oxide is there after the first step alone.
  for (const char* number : {"0000", "0001", "0002", "0004"}) {
    const bool is_there = std::string(number) == "0001";
    const std::string stem = std::string("profile_") + number;
    for (const char* ending : {".csv", ".svg"}) {
      EXPECT_EQ(text_of(folder_ / "r" / (stem + ending)).find("SiO2") != std::string::npos,
                is_there)
          << stem << ending;
    }
  }
}

// Release and native, g++ and clang, today and tomorrow: who changes the numbers on purpose writes
// the new hashes to the file.
TEST_F(CommandLine, EveryBuildGivesTheKnownBits) {
  const std::string hole = std::string(SCARP_SOURCE_DIR) +
                           "/configs/hole_directional_etch.toml --set domain.spacing='\"20 nm\"' "
                           "--set flux.target_error=0.1 --quiet ";
  const std::map<std::string, std::string> runs{
      {"trench_gather", small_trench()},
      {"trench_forward_periodic",
       small_trench("--set flux.engine='\"forward\"' --set flux.rays=100000 "
                    "--set domain.boundary='[\"periodic\", \"periodic\"]' ")},
      {"hole_beam", hole}};
  const fs::path known = fs::path(SCARP_SOURCE_DIR) / "tests/reference/state_hash.json";
  nlohmann::json hashes;
  for (const auto& [name, arguments] : runs) {
    const Outcome run = scarp("run " + arguments + " --json -o " + path(name));
    ASSERT_EQ(run.exit_code, 0) << run.messages;
    hashes[name] = json_of(run)["state_hash"];
  }
  EXPECT_EQ(nlohmann::json::parse(text_of(known)), hashes) << hashes.dump(2);
}

TEST_F(CommandLine, TheResolvedRecipeGivesTheSameBits) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("first"))).exit_code, 0);
  ASSERT_EQ(scarp("run " + path("first/recipe.toml") + " --quiet -o " + path("second")).exit_code,
            0);
  const auto first = nlohmann::json::parse(text_of(folder_ / "first" / "summary.json"));
  const auto second = nlohmann::json::parse(text_of(folder_ / "second" / "summary.json"));
  EXPECT_EQ(first["state_hash"], second["state_hash"]);
}

// As if the process had died between two outputs: what came after the last checkpoint is done
// again.
TEST_F(CommandLine, AResumedRunGivesTheSameBits) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("whole"))).exit_code, 0);
  fs::copy(folder_ / "whole", folder_ / "cut", fs::copy_options::recursive);
  for (const char* late :
       {"summary.json", "state_0002.vdb", "state_0003.vdb", "surface_0003.vtp"}) {
    fs::remove(folder_ / "cut" / late);
  }
  ASSERT_EQ(scarp("run " + small_trench("--resume -o " + path("cut"))).exit_code, 0);
  EXPECT_EQ(files("cut"), files("whole"));
  EXPECT_EQ(text_of(folder_ / "cut" / "state_0003.vdb").size(),
            text_of(folder_ / "whole" / "state_0003.vdb").size());
  const auto whole = nlohmann::json::parse(text_of(folder_ / "whole" / "summary.json"));
  const auto cut = nlohmann::json::parse(text_of(folder_ / "cut" / "summary.json"));
  EXPECT_EQ(whole["state_hash"], cut["state_hash"]);
  EXPECT_EQ(metrics_without_times(folder_ / "whole" / "metrics.csv"),
            metrics_without_times(folder_ / "cut" / "metrics.csv"));
}

// A strip of resist falls when it is undercut, then a cavity is closed under its neck.
constexpr const char* falling_strip_and_void = R"(
[domain]
spacing = "2 nm"
extent = ["120 nm"]
mode = "2d"
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "layer"
material = "Si3N4"
thickness = "24 nm"
[[geometry]]
shape = "trench"
width = "60 nm"
depth = "50 nm"
through = ["Si"]
[[geometry]]
shape = "trench"
width = "16 nm"
depth = "27 nm"
[[geometry]]
shape = "mask"
material = "resist"
thickness = "8 nm"
resist = { shape = "trench", width = "8 nm", center = "40 nm" }
[[step]]
model = "isotropic"
duration = "6 s"
etch_rate = { Si3N4 = "1 nm/s", default = "0 nm/s" }
[[step]]
model = "isotropic"
duration = "20 s"
growth_rate = "1 nm/s"
material = "SiO2"
[output]
every = "2 s"
)";

TEST_F(CommandLine, VoidsAndIslandsAreReportedAndKeptThroughAnInterruption) {
  write("r.toml", falling_strip_and_void);
  const Outcome run = scarp("run " + path("r.toml") + " -o " + path("whole"));
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  EXPECT_THAT(run.messages,
              AllOf(HasSubstr("1 piece of solid cut off from the wafer"), HasSubstr("1 void")));
  const auto whole = nlohmann::json::parse(text_of(folder_ / "whole" / "summary.json"));
  EXPECT_EQ(whole["islands_removed"]["count"], 1);
  // 8 nm x 8 nm, and what was left of the nitride; in a slice of 2 nm.
  EXPECT_NEAR(whole["islands_removed"]["volume_nm3"].get<double>(), 8 * 8 * 2, 0.2 * 8 * 8 * 2);
  ASSERT_GE(whole["void_count"], 1);
  // Half the neck, wider by what was etched; half a spacing and a time step more or less.
  EXPECT_NEAR(whole["voids"][0]["closed_at_s"].get<double>(), 6 + 8 + 6, 1 + 0.8);
  EXPECT_GT(whole["voids"][0]["volume_nm3"].get<double>(), 500);
  EXPECT_LT(whole["voids"][0]["lowest_nm"].get<double>(),
            whole["voids"][0]["highest_nm"].get<double>());

  // Stopped after the void was closed, at the last output but one.
  fs::copy(folder_ / "whole", folder_ / "cut", fs::copy_options::recursive);
  fs::remove(folder_ / "cut" / "summary.json");
  fs::remove(folder_ / "cut" / "state_0013.vdb");
  ASSERT_EQ(scarp("run " + path("r.toml") + " --resume -o " + path("cut")).exit_code, 0);
  const auto cut = nlohmann::json::parse(text_of(folder_ / "cut" / "summary.json"));
  for (const char* same : {"state_hash", "islands_removed", "void_count", "voids"}) {
    EXPECT_EQ(whole[same], cut[same]) << same;
  }
  EXPECT_EQ(metrics_without_times(folder_ / "whole" / "metrics.csv"),
            metrics_without_times(folder_ / "cut" / "metrics.csv"));
}

TEST_F(CommandLine, ResumingAFinishedRunChangesNothing) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  const auto before = fs::last_write_time(folder_ / "r" / "summary.json");
  EXPECT_EQ(scarp("run " + small_trench("--resume -o " + path("r"))).exit_code, 0);
  EXPECT_EQ(fs::last_write_time(folder_ / "r" / "summary.json"), before);
}

TEST_F(CommandLine, ResumingAnotherRecipeIsRefused) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  fs::remove(folder_ / "r" / "summary.json");
  const Outcome other =
      scarp("run " + small_trench("--set step[0].sticking=0.2 --resume -o " + path("r")));
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.messages, AllOf(HasSubstr("another recipe"), HasSubstr("--resume")));
}

TEST_F(CommandLine, AnInterruptedRunLeavesACheckpointAndGoesOn) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("whole"))).exit_code, 0);
  const std::string run = "run " + small_trench("-o " + path("cut"));
  const std::string line = "timeout --foreground --signal=INT --preserve-status 0.3 " +
                           std::string(SCARP_BINARY) + " " + run + " 2>/dev/null";
  const int status = WEXITSTATUS(std::system(line.c_str()));
  ASSERT_TRUE(status == 130 || status == 0);
  EXPECT_EQ(scarp(run + " --resume").exit_code, 0);
  const auto whole = nlohmann::json::parse(text_of(folder_ / "whole" / "summary.json"));
  const auto cut = nlohmann::json::parse(text_of(folder_ / "cut" / "summary.json"));
  EXPECT_EQ(whole["state_hash"], cut["state_hash"]);
  EXPECT_EQ(metrics_without_times(folder_ / "whole" / "metrics.csv"),
            metrics_without_times(folder_ / "cut" / "metrics.csv"));
}

class DamagedFolder : public CommandLine {
 protected:
  // A finished run and a copy of it that seems to have stopped early.
  void SetUp() override {
    ASSERT_EQ(scarp("run " + small_trench("-o " + path("whole"))).exit_code, 0);
    fs::copy(folder_ / "whole", folder_ / "cut", fs::copy_options::recursive);
    fs::remove(folder_ / "cut" / "summary.json");
  }

  Outcome resume() const { return scarp("run " + small_trench("--resume -o " + path("cut"))); }

  void expect_same_run() const {
    EXPECT_EQ(files("cut"), files("whole"));
    const auto whole = nlohmann::json::parse(text_of(folder_ / "whole" / "summary.json"));
    const auto cut = nlohmann::json::parse(text_of(folder_ / "cut" / "summary.json"));
    EXPECT_EQ(whole["state_hash"], cut["state_hash"]);
    EXPECT_EQ(metrics_without_times(folder_ / "whole" / "metrics.csv"),
              metrics_without_times(folder_ / "cut" / "metrics.csv"));
    EXPECT_EQ(text_of(folder_ / "whole" / "surface.pvd"), text_of(folder_ / "cut" / "surface.pvd"));
  }
};

TEST_F(DamagedFolder, GoesOnFromTheCheckpointBeforeADamagedOne) {
  fs::resize_file(folder_ / "cut" / "state_0003.vdb", 3000);
  write("cut/state_0002.vdb", "");
  const Outcome run = resume();
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.messages, AllOf(HasSubstr("state_0003.vdb"), HasSubstr("earlier checkpoint")));
  expect_same_run();
}

TEST_F(DamagedFolder, NeedsNoCheckpointButTheLast) {
  write("cut/state_0001.vdb", "");
  EXPECT_EQ(resume().exit_code, 0);
}

TEST_F(DamagedFolder, DoesTimeStepsAgainWhoseRowsAreLost) {
  const fs::path metrics = folder_ / "cut" / "metrics.csv";
  fs::resize_file(metrics, fs::file_size(metrics) - 5);
  EXPECT_EQ(resume().exit_code, 0);
  expect_same_run();
}

TEST_F(DamagedFolder, DoesTimeStepsAgainWhoseRowsAreNotInOrder) {
  const fs::path metrics = folder_ / "cut" / "metrics.csv";
  std::string rows = text_of(metrics);
  const std::size_t last = rows.rfind('\n', rows.size() - 2);
  const std::size_t before = rows.rfind('\n', last - 1);
  write("cut/metrics.csv", rows.erase(before, last - before));
  EXPECT_EQ(resume().exit_code, 0);
  expect_same_run();
}

TEST_F(DamagedFolder, IsNotCompleteByADamagedSummary) {
  write("cut/summary.json", "{");
  EXPECT_EQ(resume().exit_code, 0);
  expect_same_run();
}

TEST_F(DamagedFolder, SaysWhatToDoWhenNoCheckpointIsWhole) {
  for (const char* state :
       {"state_0000.vdb", "state_0001.vdb", "state_0002.vdb", "state_0003.vdb"}) {
    write(std::string("cut/") + state, "something else");
  }
  const Outcome run = resume();
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.messages, HasSubstr("without --resume"));
  EXPECT_TRUE(fs::exists(folder_ / "cut" / "surface_0003.vtp"));
}

TEST_F(DamagedFolder, OnAFullDiskSaysHowToGoOn) {
  fs::remove(folder_ / "cut" / "state_0003.vdb");
  fs::remove(folder_ / "cut" / "surface_0003.vtp");
  fs::create_symlink("/dev/full", folder_ / "cut" / "surface_0003.vtp");
  const Outcome run = resume();
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.messages,
              HasSubstr("the disk is full; free some space, then go on with: scarp run " +
                        path("cut/recipe.toml") + " --resume -o " + path("cut")));
  fs::remove(folder_ / "cut" / "surface_0003.vtp");
  EXPECT_EQ(resume().exit_code, 0);
  expect_same_run();
}

TEST_F(DamagedFolder, DropsWhatAKilledProcessWasWriting) {
  write("cut/surface_0001.vtp.tmp-123-0", "half");
  write("cut/notes.tmp-1", "a user's own");
  EXPECT_EQ(resume().exit_code, 0);
  EXPECT_FALSE(fs::exists(folder_ / "cut" / "surface_0001.vtp.tmp-123-0"));
  EXPECT_TRUE(fs::exists(folder_ / "cut" / "notes.tmp-1"));
}

TEST_F(CommandLine, ARunLeavesAUsersOwnFilesAlone) {
  fs::create_directories(folder_ / "own");
  write("own/recipe.toml", "# mine");
  const Outcome refused = scarp("run " + small_trench("-o " + path("own")));
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.messages, AllOf(HasSubstr("own/recipe.toml"), HasSubstr("-o")));
  EXPECT_EQ(text_of(folder_ / "own" / "recipe.toml"), "# mine");

  fs::remove(folder_ / "own" / "recipe.toml");
  write("own/profile_mine.csv", "x");
  write("own/surface_0001.vtp.tmp-1-1", "x");
  write("own/surface_scan.vtp", "x");
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("own"))).exit_code, 0);
  EXPECT_THAT(files("own"), ::testing::IsSupersetOf({"profile_mine.csv", "surface_scan.vtp",
                                                     "surface_0001.vtp.tmp-1-1"}));
}

// Where no run has been, a file that is called like an output is the user's.
TEST_F(CommandLine, ARunNeitherDeletesNorReplacesWhatNoRunHasWritten) {
  for (const char* name : {"profile_0009.csv", "surface_0000.vtp", "metrics.csv", "summary.json"}) {
    fs::remove_all(folder_ / "own");
    fs::create_directories(folder_ / "own");
    write(std::string("own/") + name, "mine");
    const Outcome refused = scarp("run " + small_trench("-o " + path("own")));
    EXPECT_EQ(refused.exit_code, 2) << name;
    EXPECT_THAT(refused.messages, AllOf(HasSubstr(std::string("own/") + name), HasSubstr("-o")));
    EXPECT_EQ(files("own"), (std::set<std::string>{".lock", name}));
    EXPECT_EQ(text_of(folder_ / "own" / name), "mine");
  }
}

TEST_F(CommandLine, ARunRemovesTheOutputsOfTheRunThatItReplaces) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  const std::string shorter = " --set step[0].duration='\"10 s\"'";
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r") + shorter)).exit_code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "r" / "profile_0001.csv"));
  EXPECT_FALSE(fs::exists(folder_ / "r" / "profile_0002.csv"));
}

TEST_F(CommandLine, AMeshThatFacesDownIsRefused) {
  write("down.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 3 2 1\nf 4 3 1\n");
  for (const char* engine : {"gather", "forward"}) {
    const Outcome flux = scarp("flux " + path("down.obj") + " --engine " + engine + " --json");
    EXPECT_EQ(flux.exit_code, 2) << engine;
    EXPECT_THAT(flux.messages, HasSubstr("down.obj: is inside out")) << engine;
  }
}

// Every time step is an output here, which has its own checkpoint.
TEST_F(CommandLine, AnInterruptAtAnOutputEndsTheRun) {
  // In the foreground, or timeout would send the signal twice, and the second one kills.
  const std::string line =
      "timeout --foreground --signal=INT --kill-after=5 1 " + std::string(SCARP_BINARY) + " run " +
      small_trench("--set output.every='\"0.01 s\"' -o " + path("r")) + " 2>" + path("messages");
  std::system((line + " || true").c_str());
  EXPECT_THAT(text_of(folder_ / "messages"), HasSubstr("interrupted; go on with"));
  EXPECT_FALSE(fs::exists(folder_ / "r" / "summary.json"));
}

TEST_F(CommandLine, AnOutputIntervalThatFillsTheDiskIsRefused) {
  const Outcome check = scarp("check " + small_trench("--set output.every='\"1e-9 s\"'"));
  EXPECT_EQ(check.exit_code, 2);
  EXPECT_THAT(check.messages, AllOf(HasSubstr("output.every"), HasSubstr("at most 10000")));
}

TEST_F(CommandLine, AMissedTargetIsAWarning) {
  const Outcome run =
      scarp("run " + small_trench("--set flux.target_error=0.001 --set "
                                  "flux.max_rays=1000 --set flux.engine='\"forward\"' -o " +
                                  path("r")));
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.messages, AllOf(HasSubstr("warning"), HasSubstr("flux.max_rays")));
}

TEST_F(CommandLine, AResultThatCannotBePrintedIsExitThree) {
  EXPECT_EQ(scarp("models >/dev/full").exit_code, 3);
  EXPECT_EQ(scarp("models --json >/dev/full").exit_code, 3);
}

TEST_F(CommandLine, NamesMayHoldAnyCharacter) {
  const Outcome run =
      scarp("run " + small_trench("--set title='\"a<b & \\\"c\\\", \\u0001 \u00b5\"' --set "
                                  "step[0].name='\"one, \\\"two\\\"\\nthree\"' --json -o " +
                                  path("r")));
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  EXPECT_THAT(json_of(run)["title"], HasSubstr("a<b & \"c\""));
  const std::string metrics = text_of(folder_ / "r" / "metrics.csv");
  EXPECT_THAT(metrics, HasSubstr("0,\"one, \"\"two\"\" three\",5,"));
  const std::string picture = text_of(folder_ / "r" / "profile_0000.svg");
  EXPECT_THAT(picture, HasSubstr("a&lt;b &amp; \"c\""));
  EXPECT_EQ(picture.find('\x01'), std::string::npos);
}

TEST_F(CommandLine, AWrongRecipeIsExitTwoAndLeavesNoFolder) {
  write("bad.toml", "[domain]\nspacing = \"5\"\n");
  const Outcome bad = scarp("run " + path("bad.toml") + " -o " + path("r"));
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_THAT(bad.messages, HasSubstr("bad.toml:2:11: domain.spacing"));
  EXPECT_FALSE(fs::exists(folder_ / "r"));
}

TEST_F(CommandLine, AFolderThatCannotBeMadeIsExitTwo) {
  write("file", "");
  const Outcome run = scarp("run " + small_trench("-o " + path("file/r")));
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.messages, AllOf(HasSubstr("file/r"), HasSubstr("-o")));
}

TEST_F(CommandLine, AnUnknownOptionIsExitTwo) {
  EXPECT_EQ(scarp("run --fast").exit_code, 2);
  EXPECT_EQ(scarp("").exit_code, 2);
  EXPECT_EQ(scarp("--help").exit_code, 0);
}

// A square pyramid without its base; one more triangle on an edge makes it non-manifold.
constexpr const char* pyramid =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 0.5\n"
    "f 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";

TEST_F(CommandLine, DistanceOfAMeshToItselfIsZero) {
  write("a.obj", pyramid);
  const Outcome distance = scarp("distance " + path("a.obj") + " " + path("a.obj") + " --json");
  ASSERT_EQ(distance.exit_code, 0) << distance.messages;
  EXPECT_EQ(json_of(distance)["symmetric_max"], 0);
  EXPECT_EQ(json_of(distance)["forward"]["p99"], 0);
}

TEST_F(CommandLine, FluxOnAConvexBumpHasNothingReEmittedInto) {
  write("a.obj", pyramid);
  const Outcome flux = scarp("flux " + path("a.obj") + " --engine forward --rays 20000 --json -o " +
                             path("flux.csv"));
  ASSERT_EQ(flux.exit_code, 0) << flux.messages;
  const auto result = json_of(flux);
  EXPECT_EQ(result["engine"], "forward");
  EXPECT_EQ(result["facets"], 4);
  EXPECT_EQ(result["lost"], 0);
  EXPECT_NEAR(result["absorbed"].get<double>() + result["escaped"].get<double>(), 1, 1e-9);
  EXPECT_EQ(text_of(folder_ / "flux.csv").rfind("facet,x,y,z,nx,ny,nz,area,flux,std_error\n", 0),
            0U);
}

/// A unit cube; vertex 8 is its corner (1, 1, 1).
std::string cube(bool inside_out, const std::string& eighth = "1 1 1") {
  std::string text =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv " + eighth + "\n";
  const std::array<std::array<int, 3>, 12> facets{{{1, 3, 4},
                                                   {1, 4, 2},
                                                   {5, 6, 8},
                                                   {5, 8, 7},
                                                   {1, 2, 6},
                                                   {1, 6, 5},
                                                   {3, 7, 8},
                                                   {3, 8, 4},
                                                   {1, 5, 7},
                                                   {1, 7, 3},
                                                   {2, 4, 8},
                                                   {2, 8, 6}}};
  for (auto [a, b, c] : facets) {
    if (inside_out) std::swap(b, c);
    text += "f " + std::to_string(a) + ' ' + std::to_string(b) + ' ' + std::to_string(c) + '\n';
  }
  return text;
}

TEST_F(CommandLine, FluxRefusesAMeshThatIsInsideOut) {
  write("right.obj", cube(false));
  write("wrong.obj", cube(true));
  for (const char* engine : {" --engine forward --rays 10000", " --engine gather"}) {
    EXPECT_EQ(scarp("flux " + path("right.obj") + engine).exit_code, 0) << engine;
    const Outcome flux = scarp("flux " + path("wrong.obj") + engine + " -o " + path("flux.csv"));
    EXPECT_EQ(flux.exit_code, 2) << engine;
    EXPECT_EQ(flux.out, "") << engine;
    EXPECT_THAT(flux.messages, AllOf(HasSubstr("wrong.obj: is inside out"), HasSubstr("100 %"),
                                     HasSubstr("turn its triangles over")));
    EXPECT_FALSE(fs::exists(folder_ / "flux.csv"));
  }
}

TEST_F(CommandLine, FluxRefusesVerticesTooFarAway) {
  write("far.obj", cube(false, "5e31 5e31 5e31"));
  const Outcome flux = scarp("flux " + path("far.obj") + " --rays 1000");
  EXPECT_EQ(flux.exit_code, 2);
  EXPECT_THAT(flux.messages, AllOf(HasSubstr("far.obj: vertex 7"), HasSubstr("scale the mesh")));
}

TEST_F(CommandLine, FluxBooksWhatPassesThroughAHoleWithEveryEngine) {
  const std::string text = pyramid;
  write("hole.obj", text.substr(0, text.find("f 4 1 5")));
  for (const char* engine : {" --engine forward --rays 30000", " --engine gather"}) {
    const Outcome flux = scarp("flux " + path("hole.obj") + " --json" + engine);
    ASSERT_EQ(flux.exit_code, 0) << engine << flux.messages;
    EXPECT_NEAR(json_of(flux)["lost"].get<double>(), 0.25, 0.02) << engine;
    EXPECT_NEAR(json_of(flux)["balance_error"].get<double>(), 0, 0.02) << engine;
    EXPECT_THAT(flux.messages, ::testing::ContainsRegex("warning: 2[0-9] % of the particles"));
  }
}

// A needle: hardly a ray from its flanks finds the sky.
TEST_F(CommandLine, FluxThatDoesNotBalanceIsExitThree) {
  std::string needle = pyramid;
  needle.replace(needle.find("0.5 0.5 0.5"), 11, "0.5 0.5 2e4");
  write("needle.obj", needle);
  const Outcome flux =
      scarp("flux " + path("needle.obj") + " --engine gather --rays 100 -o " + path("flux.csv"));
  EXPECT_EQ(flux.exit_code, 3) << flux.messages;
  EXPECT_THAT(flux.messages, HasSubstr("the particles do not balance: "));
  EXPECT_FALSE(fs::exists(folder_ / "flux.csv"));
}

TEST_F(CommandLine, FluxSaysIfMoreRaysThanAskedWereNeeded) {
  write("a.obj", cube(false));
  const std::string line = "flux " + path("a.obj") + " --json ";
  const Outcome gather = scarp(line + "--engine gather --rays 10");
  EXPECT_GE(json_of(gather)["rays"], 4 * 12);
  EXPECT_THAT(gather.messages,
              AllOf(HasSubstr(" rays instead of 10:"), HasSubstr("4 leave each piece of a facet")));
  EXPECT_THAT(scarp(line + "--engine gather --max-rays 10").messages,
              HasSubstr(" rays instead of 10:"));
  const Outcome forward = scarp(line + "--engine forward --rays 100");
  EXPECT_EQ(json_of(forward)["rays"], 128);
  EXPECT_THAT(forward.messages, HasSubstr("note: 128 rays instead of 100: they come in whole"));
  EXPECT_EQ(scarp(line + "--engine gather --rays 1000").messages, "");
  EXPECT_EQ(scarp(line + "--engine forward --rays 100 --quiet").messages, "");
}

TEST_F(CommandLine, SimplifyWritesAMeshAndSaysWhatStoppedIt) {
  write("a.obj", pyramid);
  const Outcome simplify = scarp("simplify " + path("a.obj") + " " + path("b.ply") + " --json");
  ASSERT_EQ(simplify.exit_code, 0) << simplify.messages;
  const auto result = json_of(simplify);
  for (const char* key : {"method", "vertices_in", "vertices_out", "facets_in", "facets_out",
                          "seconds", "max_distance", "reverse_max_distance", "stopped_by"}) {
    EXPECT_TRUE(result.contains(key)) << key;
  }
  EXPECT_TRUE(fs::exists(folder_ / "b.ply"));
}

TEST_F(CommandLine, SizesThatMakeNoSenseAreExitTwo) {
  write("a.obj", pyramid);
  const std::string simplify = "simplify " + path("a.obj") + " " + path("b.ply");
  for (const char* option : {" --l0 inf", " --l0 -1", " --step-length nan", " --l-max -1",
                             " --remove 1", " --max-error -1"}) {
    const Outcome outcome = scarp(simplify + option);
    EXPECT_EQ(outcome.exit_code, 2) << option;
    EXPECT_LT(outcome.messages.size(), 300U) << option;
  }
  EXPECT_FALSE(fs::exists(folder_ / "b.ply"));
}

TEST_F(CommandLine, ANonManifoldMeshIsRefusedWithThePlace) {
  write("bad.obj", std::string(pyramid) + "v 0.5 0 1\nf 1 2 6\n");
  const Outcome simplify = scarp("simplify " + path("bad.obj") + " " + path("b.ply"));
  EXPECT_EQ(simplify.exit_code, 2);
  EXPECT_THAT(simplify.messages, HasSubstr("manifold"));
  EXPECT_FALSE(fs::exists(folder_ / "b.ply"));
}

TEST_F(CommandLine, AFileThatOpensButCannotBeReadIsExitTwo) {
  fs::create_symlink("/proc/self/mem", path("mem.obj"));
  for (const std::string& command : {std::string("check /proc/self/mem"),
                                     "check " + folder_.string(), "flux " + path("mem.obj")}) {
    const Outcome outcome = scarp(command);
    EXPECT_EQ(outcome.exit_code, 2) << command;
    EXPECT_THAT(outcome.messages, HasSubstr("cannot be read: ")) << command;
  }
}

TEST_F(CommandLine, BadMeshFilesAreExitTwo) {
  write("empty.obj", "");
  write("cut.obj", "v 0 0 0\nv 1 0 0\nf 1 2 9\n");
  write("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  for (const char* name : {"empty.obj", "cut.obj", "nan.obj", "missing.obj", "a.unknown"}) {
    const Outcome flux = scarp("flux " + path(name) + " --rays 100");
    EXPECT_EQ(flux.exit_code, 2) << name;
    EXPECT_THAT(flux.messages, HasSubstr(name));
  }
}

TEST_F(CommandLine, ZeroRaysAndStickingOutsideItsRangeAreExitTwo) {
  write("a.obj", pyramid);
  EXPECT_EQ(scarp("flux " + path("a.obj") + " --rays 0").exit_code, 2);
  EXPECT_EQ(scarp("flux " + path("a.obj") + " --rays 100 --sticking 1.5").exit_code, 2);
  EXPECT_EQ(scarp("flux " + path("a.obj") + " --rays 100 --sticking nan").exit_code, 2);
}

TEST_F(CommandLine, AnOptionOutOfRangeIsNamedWithWhatIsAllowed) {
  write("a.obj", pyramid);
  const std::string flux = "flux " + path("a.obj") + " --rays 100 ";
  const std::string simplify = "simplify " + path("a.obj") + " " + path("b.ply");
  const std::map<std::string, std::string> messages{
      {flux + "--sticking 2", "--sticking: \"2\" is not a number in [0, 1]\n"},
      {flux + "--threads abc", "--threads: \"abc\" is not a number above 0\n"},
      {flux + "--threads 0", "--threads: \"0\" is not a number above 0\n"},
      {flux + "--engine 1", "--engine: \"1\" is none of auto, forward, gather\n"},
      {flux + "--boundary open", "--boundary: \"open\" is none of periodic, reflective\n"},
      {simplify + " --remove 1.5", "--remove: \"1.5\" is not a number in [0, 1)\n"}};
  for (const auto& [line, message] : messages) {
    const Outcome outcome = scarp(line);
    EXPECT_EQ(outcome.exit_code, 2) << line;
    EXPECT_THAT(outcome.messages, HasSubstr(message)) << line;
  }
  EXPECT_EQ(scarp(flux + "--engine forward --boundary periodic").exit_code, 0);
}

TEST_F(CommandLine, QuietKeepsResults) {
  write("a.obj", pyramid);
  EXPECT_THAT(scarp("flux " + path("a.obj") + " --rays 100 --quiet").out, HasSubstr("absorbed"));
  EXPECT_THAT(scarp("simplify " + path("a.obj") + " " + path("b.ply") + " --quiet").out,
              HasSubstr("vertices_out"));
  EXPECT_THAT(scarp("check " + small_trench()).out, HasSubstr("# Cost"));
  EXPECT_THAT(scarp("preview " + small_trench("-o " + path("p"))).out, HasSubstr("preview.svg"));
  EXPECT_EQ(scarp("run " + small_trench("-o " + path("r"))).out, "");
}

TEST_F(CommandLine, AFixedNumberOfRaysHasNoTarget) {
  write("a.obj", pyramid);
  EXPECT_TRUE(
      json_of(scarp("flux " + path("a.obj") + " --rays 100 --json"))["target_reached"].is_null());
  EXPECT_EQ(json_of(scarp("flux " + path("a.obj") + " --json"))["target_reached"], true);
}

TEST_F(CommandLine, ARunThatReplacesAnotherSaysSo) {
  std::string loud = small_trench("-o " + path("r"));
  loud.erase(loud.find(" --quiet"), 8);
  EXPECT_THAT(scarp("run " + loud).messages, ::testing::Not(HasSubstr("replaces")));
  EXPECT_THAT(scarp("run " + loud).messages, HasSubstr(path("r") + ": replaces the run"));
}

TEST_F(CommandLine, ResultsNameTheMaterials) {
  const Outcome run = scarp("run " + small_trench("--json -o " + path("r")));
  EXPECT_EQ(json_of(run)["materials"], (nlohmann::json{{"Si", 0}, {"SiO2", 2}}));
  EXPECT_THAT(text_of(folder_ / "r" / "surface_0000.vtp"), HasSubstr("Name=\"material_names\""));
}

TEST_F(CommandLine, NegativeCountsAreExitTwo) {
  write("a.obj", pyramid);
  for (const char* count : {"0", "-5"}) {
    const std::string line = "simplify " + path("a.obj") + " " + path("b.ply") + " --vertices ";
    EXPECT_EQ(scarp(line + count).exit_code, 2) << count;
  }
  EXPECT_EQ(scarp("flux " + path("a.obj") + " --rays 100 --seed -1").exit_code, 2);
}

TEST_F(CommandLine, AFullDiskIsExitThree) {
  write("a.obj", pyramid);
  fs::create_symlink("/dev/full", folder_ / "full.ply");
  const Outcome simplify = scarp("simplify " + path("a.obj") + " " + path("full.ply"));
  EXPECT_EQ(simplify.exit_code, 3);
  EXPECT_THAT(simplify.messages, HasSubstr("the disk is full"));
}

TEST_F(CommandLine, ModelsPrintsAPage) {
  const Outcome page = scarp("models single_particle");
  EXPECT_EQ(page.exit_code, 0);
  EXPECT_THAT(page.out, AllOf(HasSubstr("sticking"), HasSubstr("growth_rate")));
  EXPECT_EQ(scarp("models no_such_model").exit_code, 2);
}

TEST_F(CommandLine, ModelsWithoutANamePrintsAllParameters) {
  EXPECT_THAT(scarp("models").out, AllOf(HasSubstr("beam.tilt"), HasSubstr("source_power"),
                                         HasSubstr("Limits: "), HasSubstr("Source: ")));
  const auto models = json_of(scarp("models --json"));
  for (const auto& parameter : models["single_particle"]["parameters"]) {
    EXPECT_EQ(parameter["by_material"],
              parameter["name"] != "source_power" && parameter["name"] != "material");
  }
}

TEST_F(CommandLine, CheckPrintsTheRecipeThatIsRun) {
  const Outcome check = scarp("check " + small_trench());
  ASSERT_EQ(check.exit_code, 0) << check.messages;
  write("resolved.toml", check.out);
  EXPECT_EQ(scarp("check " + path("resolved.toml") + " --quiet").exit_code, 0);
}

TEST_F(CommandLine, PreviewWritesTheStartGeometryAndLeavesARunAlone) {
  fs::create_directories(folder_ / "out");
  write("out/metrics.csv", "kept");
  const Outcome outcome = scarp("preview " + small_trench("--json -o " + path("out")));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
  EXPECT_EQ(files("out"),
            (std::set<std::string>{"metrics.csv", "preview.csv", "preview.svg", "preview.vtp"}));
  const nlohmann::json result = json_of(outcome);
  EXPECT_NEAR(result["lowest_nm"], -8000, 1);
  EXPECT_NEAR(result["highest_nm"], 0, 1);
  ASSERT_EQ(result["layers"].size(), 1U);
  EXPECT_EQ(result["layers"][0]["material"], "Si");
  EXPECT_NEAR(result["layers"][0]["volume_nm3"], -4000.0 * 8000 * 2000, 0.01 * 6.4e10);
}

}  // namespace
