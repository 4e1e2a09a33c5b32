// Runs that were interrupted or whose folder was damaged go on to the same bits.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

namespace fs = std::filesystem;

using Restart = Program;

// As if the process had died between two outputs: what came after the last checkpoint is done
// again.
TEST_F(Restart, AResumedRunGivesTheSameBits) {
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
TEST_F(Restart, IonsInCyclesGoOnWithTheSameBits) {
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

TEST_F(Restart, ResumingAFinishedRunChangesNothing) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  const auto before = fs::last_write_time(folder_ / "r" / "summary.json");
  EXPECT_EQ(scarp("run " + small_trench("--resume -o " + path("r"))).exit_code, 0);
  EXPECT_EQ(fs::last_write_time(folder_ / "r" / "summary.json"), before);
}

TEST_F(Restart, ResumingAnotherRecipeIsRefused) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  fs::remove(folder_ / "r" / "summary.json");
  const Outcome other =
      scarp("run " + small_trench("--set step[0].sticking=0.2 --resume -o " + path("r")));
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.messages, AllOf(HasSubstr("another recipe"), HasSubstr("--resume")));
}

TEST_F(Restart, AnInterruptedRunLeavesACheckpointAndGoesOn) {
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

TEST_F(Restart, VoidsAndIslandsAreReportedAndKeptThroughAnInterruption) {
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
TEST_F(Restart, AnInterruptAtAnOutputEndsTheRun) {
  // In the foreground, or timeout would send the signal twice, and the second one kills.
  const std::string line =
      "timeout --foreground --signal=INT --kill-after=5 1 " + std::string(SCARP_BINARY) + " run " +
      small_trench("--set output.every='\"0.01 s\"' -o " + path("r")) + " 2>" + path("messages");
  std::system((line + " || true").c_str());
  EXPECT_THAT(read_file(folder_ / "messages"), HasSubstr("interrupted; go on with"));
  EXPECT_FALSE(fs::exists(folder_ / "r" / "summary.json"));
}

class DamagedFolder : public Program {
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
    expect_same_bits("whole", "cut");
    EXPECT_EQ(read_file(folder_ / "whole" / "surface.pvd"),
              read_file(folder_ / "cut" / "surface.pvd"));
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
  std::string rows = read_file(metrics);
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

}  // namespace
}  // namespace scarp
