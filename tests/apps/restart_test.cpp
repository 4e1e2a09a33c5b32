// Runs that were interrupted or whose folder was damaged go on to the same bits.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "apps/restart.h"
#include "apps/results.h"
#include "apps/run.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

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

TEST_F(Restart, ResumingAFinishedRunNamesWhatItLacks) {
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

TEST_F(Restart, ResumingNamesEarlierFilesThatAreMissing) {
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
              HasSubstr("r: the run goes on, but without surface_0001.vtp, state_0001.vdb, "
                        "profile_0002.csv; run without --resume"));
}

TEST_F(Restart, ResumingNamesEarlierFilesThatWereChanged) {
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
              HasSubstr("r: the run goes on, but with other content than it wrote in "
                        "profile_0002.csv, surface_0001.vtp; run without --resume"));
  EXPECT_EQ(read_file(folder_ / "r" / "metrology.csv"), metrology);
}

TEST_F(Restart, RowsWithTheLineEndsOfWindowsAreThoseOfTheRun) {
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

TEST_F(Restart, ARowThatIsMissingIsNamed) {
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

TEST_F(Restart, AFolderOrAPipeInThePlaceOfAFileIsRefused) {
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

TEST_F(Restart, ADamagedRecipeOfTheRunIsWrittenAnew) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  const std::string recipe = read_file(folder_ / "r" / "recipe.toml");
  ASSERT_TRUE(fs::remove(folder_ / "r" / "summary.json"));
  write("r/recipe.toml", "a = [");
  const Outcome resumed = scarp("run " + small_trench("--resume -o " + path("r")));
  EXPECT_EQ(resumed.exit_code, 0);
  EXPECT_THAT(resumed.messages,
              HasSubstr(path("r/recipe.toml") + ": is damaged, and is written anew ("));
  EXPECT_EQ(read_file(folder_ / "r" / "recipe.toml"), recipe);
}

// Replaces the first digit of a row's process time.
std::string changed(std::string rows, std::size_t row) {
  std::size_t place = 0;
  for (std::size_t n = 0; n < row; ++n) place = rows.find('\n', place) + 1;
  const std::size_t digit = rows.find(',', rows.find(',', place) + 1) + 1;
  rows[digit] = rows[digit] == '9' ? '8' : '9';
  return rows;
}

TEST_F(Restart, ResumingAFinishedRunTellsOfDigitsThatWereChanged) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  const std::string rows = changed(read_file(folder_ / "r" / "metrics.csv"), 1);
  write("r/metrics.csv", rows);
  const Outcome resumed = scarp("run " + small_trench("--resume -o " + path("r")));
  EXPECT_EQ(resumed.exit_code, 0);
  EXPECT_THAT(resumed.messages, HasSubstr("r/metrics.csv: was changed since"));
  EXPECT_EQ(read_file(folder_ / "r" / "metrics.csv"), rows);
}

TEST_F(Restart, ResumingAnotherRecipeIsRefused) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  fs::remove(folder_ / "r" / "summary.json");
  const Outcome other =
      scarp("run " + small_trench("--set step[0].sticking=0.2 --resume -o " + path("r")));
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.messages, AllOf(HasSubstr("another recipe"), HasSubstr("--resume"),
                                    HasSubstr("step[0].sticking is 0.2, there 0.1")));
}

// Of a recipe elsewhere a name relative to where one stands would be another file.
TEST_F(Restart, AStateToStartFromIsNamedByItsWholePath) {
  ASSERT_EQ(scarp("run " + small_trench("-o " + path("r"))).exit_code, 0);
  fs::remove(folder_ / "r" / "summary.json");
  const std::string from_here = fs::relative(folder_ / "r").string();
  ASSERT_NE(from_here.front(), '/');
  EXPECT_THAT(
      scarp("run " + small_trench("--set flux.seed=2 --resume -o " + from_here)).messages,
      HasSubstr("start = \"" + (fs::canonical(folder_ / "r") / "state_NNNN.vdb").string() + '"'));
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

// Time steps of 4 s between outputs at 30 s and 60 s.
constexpr const char* slow_etch = R"(
[domain]
spacing = "10 nm"
extent = ["200 nm"]
mode = "2d"
[[geometry]]
shape = "wafer"
material = "Si"
[[step]]
model = "isotropic"
duration = "60 s"
etch_rate = "1 nm/s"
[output]
every = "30 s"
)";

struct ProcessDied {};

class Checkpoints : public ::testing::Test {
 protected:
  // Looks into the folder after every time step, before what is written after it; dies where
  // that is false.
  RunEnd run_with(const std::string& output, const std::function<bool(const State&)>& look,
                  RunOptions options = {}) {
    options.progress = [&](const State& state, const Survey&) {
      if (!look(state)) throw ProcessDied();
    };
    return run(recipe(output), folder_ / "r", options);
  }

  static Recipe recipe(const std::string& output) { return read_text(slow_etch + output); }
  bool has(const std::string& name) const { return fs::exists(folder_ / "r" / name); }
  // The last time step that a checkpoint between outputs holds.
  std::uint32_t saved_time_step(const Recipe& recipe) const {
    const std::vector<fs::path> states{folder_ / "r" / interrupted_state};
    return newest_restart(states, std::nullopt, recipe, {})->state.time_step;
  }

  TemporaryFolder folder_;
};

TEST_F(Checkpoints, AreWrittenAtOutputsAlone) {
  run_with("", [&](const State&) {
    EXPECT_FALSE(has(interrupted_state));
    return true;
  });
}

// After every time step: that of the one before is there, and the one before that as well.
TEST_F(Checkpoints, AreWrittenByWallTimeAndTheOneBeforeIsKept) {
  const Recipe known = recipe("checkpoint_wall_time = \"0 s\"\n");
  int looks = 0;
  run_with("checkpoint_wall_time = \"0 s\"\n", [&](const State& state) {
    if (state.time < 30) {
      EXPECT_EQ(has(interrupted_state), state.time_step > 1);
      EXPECT_EQ(has(earlier_interrupted_state), state.time_step > 2);
      if (state.time_step > 1) {
        EXPECT_EQ(saved_time_step(known), state.time_step - 1);
      }
      ++looks;
    }
    return true;
  });
  EXPECT_GE(looks, 6);
  EXPECT_FALSE(has(interrupted_state));
  EXPECT_FALSE(has(earlier_interrupted_state));
}

// 4 s at a time, every 10 s: after the time steps to 12 s and 20 s.
TEST_F(Checkpoints, AreWrittenByProcessTimeWithoutCuttingTimeSteps) {
  std::vector<double> saved;
  const std::string every = "checkpoint_every = \"10 s\"\n";
  const Recipe known = recipe(every);
  std::vector<double> times;
  run_with(every, [&](const State& state) {
    if (state.time < 30 && has(interrupted_state)) {
      const std::uint32_t time_step = saved_time_step(known);
      if (saved.empty() || times[time_step - 1] != saved.back())
        saved.push_back(times[time_step - 1]);
    }
    times.push_back(state.time);
    return true;
  });
  ASSERT_EQ(saved.size(), 2U);
  EXPECT_NEAR(saved[0], 12, 1e-9);
  EXPECT_NEAR(saved[1], 20, 1e-9);
}

TEST_F(Checkpoints, AreWrittenWhenAskedFor) {
  std::atomic<bool> asked = false;
  RunOptions options;
  options.checkpoint = &asked;
  const auto look = [&](const State& state) {
    if (state.time < 30) {
      EXPECT_EQ(has(interrupted_state), state.time_step > 3);
    }
    if (state.time_step == 3) {
      asked = true;
    } else {
      EXPECT_FALSE(asked);
    }
    return true;
  };
  run_with("", look, options);
}

// The process dies, and its last checkpoint is damaged.
TEST_F(Checkpoints, OneBeforeADamagedOneIsGoneOnFrom) {
  const std::string output = "checkpoint_wall_time = \"0 s\"\n";
  run(recipe(output), folder_ / "whole", {});
  EXPECT_THROW(run_with(output, [](const State& state) { return state.time_step < 5; }),
               ProcessDied);
  fs::resize_file(folder_ / "r" / interrupted_state, 3000);
  std::ostringstream messages;
  std::vector<std::uint32_t> time_steps;
  RunOptions options;
  options.resume = true;
  options.log = Log(messages, Log::Level::everything);
  const auto note = [&](const State& state) {
    time_steps.push_back(state.time_step);
    return true;
  };
  run_with(output, note, options);
  EXPECT_THAT(messages.str(), AllOf(HasSubstr("state_interrupted.vdb"), HasSubstr("earlier")));
  EXPECT_EQ(time_steps.front(), 4U);
  EXPECT_EQ(metrics_without_times(folder_ / "r" / "metrics.csv"),
            metrics_without_times(folder_ / "whole" / "metrics.csv"));
}

// As long as there is no new one.
TEST_F(Checkpoints, OneBeforeADamagedOneIsKept) {
  const Recipe known = recipe("checkpoint_wall_time = \"0 s\"\n");
  EXPECT_THROW(run_with("checkpoint_wall_time = \"0 s\"\n",
                        [](const State& state) { return state.time_step < 5; }),
               ProcessDied);
  fs::resize_file(folder_ / "r" / interrupted_state, 3000);
  const fs::path before = folder_ / "r" / earlier_interrupted_state;
  const std::string good = read_file(before);
  ResultFolder folder(folder_ / "r");
  const auto state = folder.resume(known, {});
  ASSERT_TRUE(state);
  EXPECT_EQ(folder.last_checkpoint(), before);
  folder.write_checkpoint(*state, known);
  EXPECT_EQ(read_file(before), good);
  EXPECT_EQ(saved_time_step(known), state->time_step);
}

// Cut to any length, or with one bit turned anywhere.
TEST_F(Checkpoints, HoweverOneIsDamagedTheOneBeforeIsGoneOnFrom) {
  const Recipe known = recipe("checkpoint_wall_time = \"0 s\"\n");
  EXPECT_THROW(run_with("checkpoint_wall_time = \"0 s\"\n",
                        [](const State& state) { return state.time_step < 5; }),
               ProcessDied);
  const fs::path newest = folder_ / "r" / interrupted_state;
  const fs::path before = folder_ / "r" / earlier_interrupted_state;
  const std::vector<fs::path> states{folder_ / "r" / "state_0000.vdb", newest, before};
  const auto found = [&](std::ostream& messages) {
    return newest_restart(states, std::nullopt, known, Log(messages, Log::Level::everything))
        .value();
  };
  std::ostringstream none;
  ASSERT_EQ(found(none).file, newest);
  ASSERT_EQ(none.str(), "");
  const std::string whole = read_file(newest);
  const std::string hash_before =
      state_hash(newest_restart({&before, 1}, std::nullopt, known, {})->state, known.materials);
  const auto expect_earlier = [&](const std::string& bytes, const std::string& how) {
    std::ofstream(newest, std::ios::binary) << bytes;
    std::ostringstream messages;
    const auto restart = found(messages);
    ASSERT_EQ(restart.file, before) << how;
    ASSERT_EQ(state_hash(restart.state, known.materials), hash_before) << how;
    ASSERT_THAT(messages.str(), AllOf(HasSubstr(newest.string()), HasSubstr("earlier checkpoint")))
        << how;
  };
  std::mt19937 random(8);
  for (int n = 0; n < 1000; ++n) {
    const std::size_t place = random() % whole.size();
    std::string turned = whole;
    turned[place] = static_cast<char>(turned[place] ^ (1 << random() % 8));
    expect_earlier(turned, "a bit of byte " + std::to_string(place));
    const std::size_t length = n < 100 ? static_cast<std::size_t>(n) : random() % whole.size();
    expect_earlier(whole.substr(0, length), "cut to " + std::to_string(length));
  }
}

TEST_F(Restart, ASignalOfABatchSystemHasACheckpointWritten) {
  write("r.toml", slow_etch);
  // Three thousand time steps, none of them an output. Whatever goes wrong, it has an end.
  const std::string line = "timeout 60 " + std::string(SCARP_BINARY) + " run " + path("r.toml") +
                           " --set advection.cfl=0.01 --set step[0].duration='\"300 s\"' --set "
                           "output.every='\"0 s\"' --quiet -o " +
                           path("r") + " & sleep 0.3; pkill -USR1 -P $!; wait $!; ls " + path("r") +
                           " >" + path("files");
  std::system(line.c_str());
  EXPECT_THAT(read_file(folder_ / "files"), HasSubstr("summary.json"));
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
    write("cut/metrics.csv", changed(rows, row));
    const Outcome run = resume();
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_THAT(run.messages,
                HasSubstr("cut/metrics.csv: lines 2 to " + std::to_string(count + 1) +
                          " are not those that stood there when state_0003.vdb was written"));
    EXPECT_THAT(run.messages, HasSubstr("going on from an earlier checkpoint"));
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
  write("cut/metrics.csv", changed(read_file(folder_ / "cut" / "metrics.csv"), 1));
  EXPECT_THAT(resume().messages, HasSubstr("are not those that stood there when"));
}

// Moved away, as the message says.
TEST_F(DamagedFolder, GoesOnWithoutRowsThatWereMovedAway) {
  fs::remove(folder_ / "cut" / "state_0003.vdb");
  write("cut/metrics.csv", changed(read_file(folder_ / "whole" / "metrics.csv"), 1));
  fs::rename(folder_ / "cut" / "metrics.csv", folder_ / "moved.csv");
  EXPECT_THAT(resume().messages, HasSubstr("metrics.csv: its rows are lost; it begins anew"));
  EXPECT_EQ(summary("cut")["state_hash"], summary("whole")["state_hash"]);
  // The checkpoint at which the file began anew is gone on from again.
  fs::remove(folder_ / "cut" / "summary.json");
  fs::remove(folder_ / "cut" / "state_0003.vdb");
  const auto written = fs::last_write_time(folder_ / "cut" / "state_0002.vdb");
  EXPECT_THAT(resume().messages, HasSubstr("metrics.csv: its rows are lost; it begins anew"));
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
  EXPECT_THAT(same.messages, HasSubstr("the run begins anew"));
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
