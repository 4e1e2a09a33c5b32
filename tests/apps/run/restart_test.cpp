// Runs that were interrupted go on to the same bits.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>

#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

using RestartedRun = Program;

// As if the process had died between two outputs: what came after the last checkpoint is done
// again.
TEST_F(RestartedRun, AResumedRunGivesTheSameBits) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("whole"))).exit_code, 0);
  fs::copy(folder_ / "whole", folder_ / "cut", fs::copy_options::recursive);
  for (const char* late :
       {"summary.json", "state_0002.vdb", "state_0003.vdb", "surface_0003.vtp"}) {
    fs::remove(folder_ / "cut" / late);
  }
  ASSERT_EQ(scarp("run " + small_trench("--resume -o " + path("cut"))).exit_code, 0);
  EXPECT_EQ(files("cut"), files("whole"));
  EXPECT_EQ(read_file(folder_ / "cut" / "state_0003.vdb").size(),
            read_file(folder_ / "whole" / "state_0003.vdb").size());
  expect_same_bits("whole", "cut");
}

// Two cycles, each of a film and an etch with ions; the process dies in the second one.
TEST_F(RestartedRun, IonsInCyclesGoOnWithTheSameBits) {
  write("cycles.toml", R"(
[domain]
spacing = "20 nm"
extent = ["400 nm"]
mode = "2d"
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "resist"
thickness = "100 nm"
opening = { shape = "trench", width = "200 nm" }
[flux]
rays = 10000
[[step]]
repeat = 2
[[step.step]]
model = "multi_particle"
duration = "2 s"
material = "polymer"
rate = "2 nm/s * C4F8 + 1 nm/s * Ar"
[[step.step.neutral]]
name = "C4F8"
sticking = 0.1
[[step.step.ion]]
name = "Ar"
[[step.step]]
model = "multi_particle"
duration = "4 s"
rate = { polymer = "-3 nm/s * etch", Si = "-1 nm/s * F^0.5 * etch", resist = "0" }
[[step.step.neutral]]
name = "F"
sticking = 0.3
[[step.step.ion]]
name = "Ar"
[[step.step.ion.yield]]
name = "etch"
amplitude = 1
threshold = "15 eV"
angular = "enhanced"
)");
  ASSERT_EQ(scarp("run " + path("cycles.toml") + " --quiet -o " + path("whole")).exit_code, 0);
  fs::copy(folder_ / "whole", folder_ / "cut", fs::copy_options::recursive);
  for (const char* late : {"summary.json", "state_0003.vdb", "state_0004.vdb"})
    fs::remove(folder_ / "cut" / late);
  const std::string resume = "run " + path("cycles.toml") + " --quiet --resume -o " + path("cut");
  ASSERT_EQ(scarp(resume).exit_code, 0);
  expect_same_bits("whole", "cut");
}

TEST_F(RestartedRun, ResumingAFinishedRunChangesNothing) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  const auto before = fs::last_write_time(folder_ / "r" / "summary.json");
  EXPECT_EQ(scarp("run " + small_trench("--resume -o " + path("r"))).exit_code, 0);
  EXPECT_EQ(fs::last_write_time(folder_ / "r" / "summary.json"), before);
}

TEST_F(RestartedRun, ResumingAFinishedRunNamesWhatItLacks) {
  const std::string section = "--set output.sections='[\"x = 1 um\"]' ";
  ASSERT_EQ(scarp("run " + small_trench(section + "-o " + path("r"))).exit_code, 0);
  const auto resume = [&] {
    const Outcome resumed = scarp("run " + small_trench(section + "--resume -o " + path("r")));
    EXPECT_EQ(resumed.exit_code, 0);
    return resumed.messages;
  };
  EXPECT_EQ(resume(), "");
  // Without those two a run is not finished; the page is made again.
  const std::set<std::string> needed{".lock", "recipe.toml", "summary.json", "metrics.csv",
                                     "report.html"};
  for (const std::string& name : files("r")) {
    if (needed.contains(name)) continue;
    fs::rename(folder_ / "r" / name, folder_ / "moved");
    EXPECT_THAT(resume(), AllOf(HasSubstr("without " + name + ";"), HasSubstr("--resume")));
    fs::rename(folder_ / "moved", folder_ / "r" / name);
  }
  for (const std::string& name : files("r"))
    if (name.ends_with(".svg")) fs::remove(folder_ / "r" / name);
  EXPECT_THAT(resume(), HasSubstr("profiles.svg, profile_0000.svg, profile_0001.svg, "
                                  "profile_0002.svg, profile_0003.svg, section_1.svg and 4 more"));
}

TEST_F(RestartedRun, ResumingNamesEarlierFilesThatAreMissing) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  // What the next output writes anew is not missed.
  for (const char* name : {"summary.json", "state_0003.vdb", "surface.pvd", "profiles.svg"})
    ASSERT_TRUE(fs::remove(folder_ / "r" / name));
  fs::copy(folder_ / "r", folder_ / "whole", fs::copy_options::recursive);
  EXPECT_THAT(scarp("run " + small_trench("--resume -o " + path("whole"))).messages,
              Not(HasSubstr("without")));
  for (const char* name : {"surface_0001.vtp", "state_0001.vdb", "profile_0002.csv"})
    ASSERT_TRUE(fs::remove(folder_ / "r" / name));
  const Outcome resumed = scarp("run " + small_trench("--resume -o " + path("r")));
  EXPECT_EQ(resumed.exit_code, 0);
  EXPECT_THAT(resumed.messages,
              HasSubstr("r: the run continues, but without surface_0001.vtp, state_0001.vdb, "
                        "profile_0002.csv; run without --resume"));
}

TEST_F(RestartedRun, ResumingNamesEarlierFilesThatWereChanged) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  const std::string metrology = read_file(folder_ / "r" / "metrology.csv");
  for (const char* name : {"summary.json", "state_0003.vdb"})
    ASSERT_TRUE(fs::remove(folder_ / "r" / name));
  const auto flip = [&](const std::string& name) {
    std::string bytes = read_file(folder_ / "r" / name);
    bytes[bytes.size() / 2] ^= 1;
    write("r/" + name, bytes);
  };
  for (const char* name : {"surface_0001.vtp", "profile_0002.csv", "surface_0003.vtp"}) flip(name);
  // One that is measured again.
  flip("metrology.csv");
  const Outcome resumed = scarp("run " + small_trench("--resume -o " + path("r")));
  EXPECT_EQ(resumed.exit_code, 0);
  EXPECT_THAT(resumed.messages,
              HasSubstr("r: the run continues, but with other content than it wrote in "
                        "profile_0002.csv, surface_0001.vtp; run without --resume"));
  EXPECT_EQ(read_file(folder_ / "r" / "metrology.csv"), metrology);
}

TEST_F(RestartedRun, RowsWithTheLineEndsOfWindowsAreThoseOfTheRun) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  const std::string rows = read_file(folder_ / "r" / "metrics.csv");
  for (const char* name : {"summary.json", "state_0003.vdb"})
    ASSERT_TRUE(fs::remove(folder_ / "r" / name));
  std::string saved;
  for (const char c : rows) saved += c == '\n' ? std::string("\r\n") : std::string(1, c);
  write("r/metrics.csv", saved);
  const Outcome resumed = scarp("run " + small_trench("--resume -o " + path("r")));
  EXPECT_EQ(resumed.exit_code, 0);
  EXPECT_THAT(resumed.messages, Not(HasSubstr("earlier checkpoint")));
  EXPECT_EQ(read_file(folder_ / "r" / "metrics.csv").find('\r'), std::string::npos);
}

TEST_F(RestartedRun, ARowThatIsMissingIsNamed) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  for (const char* name : {"summary.json", "state_0003.vdb"})
    ASSERT_TRUE(fs::remove(folder_ / "r" / name));
  std::string rows = read_file(folder_ / "r" / "metrics.csv");
  const std::size_t second = rows.find('\n', rows.find('\n') + 1) + 1;
  rows.erase(second, rows.find('\n', second) + 1 - second);
  write("r/metrics.csv", rows);
  EXPECT_THAT(scarp("run " + small_trench("--resume -o " + path("r"))).messages,
              HasSubstr("state_0002.vdb: line 3 of metrics.csv is not the row of time step 1,"));
}

TEST_F(RestartedRun, AFolderOrAPipeInThePlaceOfAFileIsRefused) {
  const std::string run = "run " + small_trench("-o " + path("r"));
  ASSERT_EQ(scarp(run).exit_code, 0);
  for (const char* name : {"summary.json", "state_0003.vdb", "surface_0003.vtp"})
    ASSERT_TRUE(fs::remove(folder_ / "r" / name));
  fs::create_directories(folder_ / "r" / "profile_0005.csv" / "inner");
  ASSERT_EQ(mkfifo((folder_ / "r" / "surface_0003.vtp").c_str(), 0600), 0);
  for (const std::string& command : {run, run + " --resume"}) {
    const Outcome refused = scarp(command);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.messages, HasSubstr("r/profile_0005.csv: is a folder, in the place of"));
  }
  fs::remove_all(folder_ / "r" / "profile_0005.csv");
  EXPECT_THAT(scarp(run + " --resume").messages, HasSubstr("r/surface_0003.vtp: is a pipe, in"));
  EXPECT_TRUE(fs::exists(folder_ / "r" / "state_0002.vdb"));
}

TEST_F(RestartedRun, ADamagedRecipeOfTheRunIsWrittenAnew) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  const std::string recipe = read_file(folder_ / "r" / "recipe.toml");
  ASSERT_TRUE(fs::remove(folder_ / "r" / "summary.json"));
  write("r/recipe.toml", "a = [");
  const Outcome resumed = scarp("run " + small_trench("--resume -o " + path("r")));
  EXPECT_EQ(resumed.exit_code, 0);
  EXPECT_THAT(resumed.messages,
              HasSubstr(path("r/recipe.toml") + ": is damaged, and is written again ("));
  EXPECT_EQ(read_file(folder_ / "r" / "recipe.toml"), recipe);
}

TEST_F(RestartedRun, ResumingAFinishedRunTellsOfDigitsThatWereChanged) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  const std::string rows = with_other_digit(read_file(folder_ / "r" / "metrics.csv"), 1);
  write("r/metrics.csv", rows);
  const Outcome resumed = scarp("run " + small_trench("--resume -o " + path("r")));
  EXPECT_EQ(resumed.exit_code, 0);
  EXPECT_THAT(resumed.messages, HasSubstr("r/metrics.csv: was changed since"));
  EXPECT_EQ(read_file(folder_ / "r" / "metrics.csv"), rows);
}

TEST_F(RestartedRun, ResumingAnotherRecipeIsRefused) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  fs::remove(folder_ / "r" / "summary.json");
  const Outcome other =
      scarp("run " + small_trench("--set step[0].sticking=0.2 --resume -o " + path("r")));
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.messages, AllOf(HasSubstr("another recipe"), HasSubstr("--resume"),
                                    HasSubstr("step[0].sticking is 0.2, there 0.1")));
}

// Of a recipe elsewhere a name relative to where one stands would be another file.
TEST_F(RestartedRun, AStateToStartFromIsNamedByItsWholePath) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  fs::remove(folder_ / "r" / "summary.json");
  const std::string from_here = fs::relative(folder_ / "r").string();
  ASSERT_NE(from_here.front(), '/');
  EXPECT_THAT(
      scarp("run " + small_trench("--set flux.seed=2 --resume -o " + from_here)).messages,
      HasSubstr("start = \"" + (fs::canonical(folder_ / "r") / "state_0003.vdb").string() + '"'));
}

TEST_F(RestartedRun, AnInterruptedRunLeavesACheckpointAndGoesOn) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("whole"))).exit_code, 0);
  const std::string run = "run " + small_trench("-o " + path("cut"));
  const std::string line = "timeout --foreground --signal=INT --preserve-status 0.3 " +
                           std::string(SCARP_BINARY) + " " + run + " 2>/dev/null";
  const int status = WEXITSTATUS(std::system(line.c_str()));
  ASSERT_TRUE(status == 130 || status == 0);
  EXPECT_EQ(scarp(run + " --resume").exit_code, 0);
  expect_same_bits("whole", "cut");
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

TEST_F(RestartedRun, VoidsAndIslandsAreReportedAndKeptThroughAnInterruption) {
  write("r.toml", falling_strip_and_void);
  const Outcome run = scarp("run " + path("r.toml") + " -o " + path("whole"));
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  EXPECT_THAT(run.messages,
              AllOf(HasSubstr("1 piece of solid cut off from the wafer"), HasSubstr("1 void")));
  const auto whole = summary("whole");
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
  const auto cut = summary("cut");
  for (const char* same : {"state_hash", "islands_removed", "void_count", "voids"}) {
    EXPECT_EQ(whole[same], cut[same]) << same;
  }
  EXPECT_EQ(metrics_without_times(folder_ / "whole" / "metrics.csv"),
            metrics_without_times(folder_ / "cut" / "metrics.csv"));
}

// Every time step is an output here, which has its own checkpoint.
TEST_F(RestartedRun, AnInterruptAtAnOutputEndsTheRun) {
  // In the foreground, or timeout would send the signal twice, and the second one kills.
  const std::string line =
      "timeout --foreground --signal=INT --kill-after=5 1 " + std::string(SCARP_BINARY) + " run " +
      small_trench("--set output.every='\"0.01 s\"' -o " + path("r")) + " 2>" + path("messages");
  std::system((line + " || true").c_str());
  EXPECT_THAT(read_file(folder_ / "messages"), HasSubstr("interrupted; continue with"));
  EXPECT_FALSE(fs::exists(folder_ / "r" / "summary.json"));
}

}  // namespace
}  // namespace scarp
