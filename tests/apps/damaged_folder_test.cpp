// A result folder that was damaged goes on to the same bits, or says what to do.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

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
  fs::remove(folder_ / "cut" / "report.html");
  const Outcome run = resume();
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.messages, AllOf(HasSubstr("there is no report.html"), HasSubstr("state_0001")));
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

// Each time step that is saved is an output here: what is changed lies before the second of them,
// or before the last.
TEST_F(DamagedFolder, DoesTimeStepsAgainWhoseDigitsWereChanged) {
  const std::string rows = read_file(folder_ / "whole" / "metrics.csv");
  const auto count = static_cast<std::size_t>(std::ranges::count(rows, '\n')) - 1;
  for (const std::size_t row : {std::size_t{1}, count}) {
    fs::remove(folder_ / "cut" / "summary.json");
    write("cut/metrics.csv", with_other_digit(rows, row));
    const Outcome run = resume();
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_THAT(run.messages, HasSubstr("cut/metrics.csv: lines 2 to " + std::to_string(count + 1) +
                                        " have changed since state_0003.vdb was written"));
    EXPECT_THAT(run.messages, HasSubstr("continuing from an earlier checkpoint"));
    expect_same_run();
  }
}

// What a run that was resumed has written is known as well.
TEST_F(DamagedFolder, NoticesDigitsThatWereChangedInAResumedRun) {
  fs::remove(folder_ / "cut" / "state_0003.vdb");
  for (int n = 0; n < 2; ++n) {
    EXPECT_THAT(resume().messages, Not(HasSubstr("metrics.csv")));
    fs::remove(folder_ / "cut" / "summary.json");
  }
  write("cut/metrics.csv", with_other_digit(read_file(folder_ / "cut" / "metrics.csv"), 1));
  EXPECT_THAT(resume().messages, HasSubstr("have changed since"));
}

// Moved away, as the message says.
TEST_F(DamagedFolder, GoesOnWithoutRowsThatWereMovedAway) {
  fs::remove(folder_ / "cut" / "state_0003.vdb");
  write("cut/metrics.csv", with_other_digit(read_file(folder_ / "whole" / "metrics.csv"), 1));
  fs::rename(folder_ / "cut" / "metrics.csv", folder_ / "moved.csv");
  EXPECT_THAT(resume().messages, HasSubstr("metrics.csv: its rows are lost; it starts again"));
  EXPECT_EQ(summary("cut")["state_hash"], summary("whole")["state_hash"]);
  // The checkpoint at which the file began anew is gone on from again.
  fs::remove(folder_ / "cut" / "summary.json");
  fs::remove(folder_ / "cut" / "state_0003.vdb");
  const auto written = fs::last_write_time(folder_ / "cut" / "state_0002.vdb");
  EXPECT_THAT(resume().messages, HasSubstr("metrics.csv: its rows are lost; it starts again"));
  EXPECT_EQ(fs::last_write_time(folder_ / "cut" / "state_0002.vdb"), written);
}

TEST_F(DamagedFolder, IsNotCompleteByADamagedSummary) {
  write("cut/summary.json", "{");
  EXPECT_EQ(resume().exit_code, 0);
  expect_same_run();
}

TEST_F(DamagedFolder, IsNotCompleteByASummaryOfOtherKinds) {
  for (const char* summary : {R"({"complete": 1, "start_state_hash": ""})",
                              R"({"complete": true, "start_state_hash": null})"}) {
    write("cut/summary.json", summary);
    EXPECT_EQ(resume().exit_code, 0);
    expect_same_run();
  }
}

TEST_F(DamagedFolder, IsNotCompleteByTheSummaryOfAnotherRun) {
  ASSERT_EQ(scarp("run " + small_trench("--set flux.seed=7 -o " + path("other"))).exit_code, 0);
  fs::copy(folder_ / "other" / "summary.json", folder_ / "cut");
  const Outcome compared =
      scarp("compare " + path("cut") + " " + path("whole") + " -o " + path("o"));
  EXPECT_THAT(compared.messages, HasSubstr("cut: is not complete"));
  EXPECT_EQ(scarp("report " + path("cut")).exit_code, 0);
  EXPECT_THAT(read_file(folder_ / "cut" / "report.html"), HasSubstr("is not complete"));
  fs::remove(folder_ / "cut" / "state_0003.vdb");
  EXPECT_EQ(resume().exit_code, 0);
  expect_same_run();
}

// As those that somebody has set aside.
TEST_F(DamagedFolder, PassesOverStatesUnderNamesOfTheirOwn) {
  fs::remove(folder_ / "cut" / "state_0003.vdb");
  for (const char* name : {"state_00000000000000000000009.vdb", "state_00009.vdb",
                           "state_99999999999999999999999.vdb", "state_3.vdb"})
    fs::copy(folder_ / "cut" / "state_0001.vdb", folder_ / "cut" / name);
  const Outcome run = resume();
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.messages, Not(HasSubstr("state_")));
  expect_same_bits("whole", "cut");
  for (const char* command : {"report ", "render ", "section ", "measure "})
    EXPECT_EQ(scarp(command + path("cut")).exit_code, 0) << command;
  const Outcome compared =
      scarp("compare " + path("cut") + " " + path("whole") + " -o " + path("o"));
  EXPECT_EQ(compared.exit_code, 0) << compared.out << compared.messages;
}

TEST_F(DamagedFolder, GoesOnFromNoStateThatWasRenamed) {
  fs::copy(folder_ / "cut" / "state_0001.vdb", folder_ / "cut" / "state_0009.vdb");
  const Outcome run = resume();
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.messages, HasSubstr("state_0009.vdb: holds output 1, so it was renamed; "
                                      "continuing from an earlier checkpoint"));
  expect_same_bits("whole", "cut");
}

// Only the pictures ask for earlier outputs.
TEST_F(DamagedFolder, GoesOnWhereAnEarlierStateIsDamaged) {
  fs::remove(folder_ / "cut" / "state_0003.vdb");
  write("cut/state_0001.vdb", "");
  const Outcome run = resume();
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.messages, AllOf(HasSubstr("state_0001"), HasSubstr("drawn without it")));
  EXPECT_EQ(files("cut").count("summary.json"), 1U);
  expect_same_bits("whole", "cut");
}

TEST_F(DamagedFolder, MeasuresAgainWhatRowsOfMetrologyAreLost) {
  const std::string rows = read_file(folder_ / "whole" / "metrology.csv");
  const std::size_t first = rows.find('\n') + 1;
  const std::size_t second = rows.find("\n1,") + 1;
  for (const std::string& damaged :
       {rows.substr(0, first) + rows.substr(second), rows.substr(0, second) + rows.substr(first),
        rows.substr(0, first - 4), rows.substr(0, second + 9)}) {
    fs::remove(folder_ / "cut" / "summary.json");
    fs::remove(folder_ / "cut" / "state_0003.vdb");
    write("cut/metrology.csv", damaged);
    EXPECT_EQ(resume().exit_code, 0);
    EXPECT_EQ(read_file(folder_ / "cut" / "metrology.csv"), rows);
  }
}

// A checkpoint knows the recipe that it is of.
TEST_F(DamagedFolder, GoesOnWithoutItsRecipe) {
  for (const bool is_lost : {true, false}) {
    const fs::path recipe = folder_ / "cut" / "recipe.toml";
    is_lost ? static_cast<void>(fs::remove(recipe)) : fs::resize_file(recipe, 250);
    fs::remove(folder_ / "cut" / "summary.json");
    fs::remove(folder_ / "cut" / "state_0003.vdb");
    EXPECT_EQ(resume().exit_code, 0);
    expect_same_run();
  }
}

TEST_F(DamagedFolder, IsNotReplacedByAnotherRecipe) {
  for (const std::string& name : files("cut"))
    if (name.ends_with(".vdb")) fs::remove(folder_ / "cut" / name);
  const Outcome other =
      scarp("run " + small_trench("--set step[0].sticking=0.2 --resume -o " + path("cut")));
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.messages, HasSubstr("another recipe"));
  const Outcome same = resume();
  EXPECT_EQ(same.exit_code, 0);
  EXPECT_THAT(same.messages, HasSubstr("the run starts from the beginning"));
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
              HasSubstr("the disk is full; free some space, then continue with: scarp run " +
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
