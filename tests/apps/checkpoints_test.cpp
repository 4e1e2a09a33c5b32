// Checkpoints are written when they should be, and the one before a damaged one is gone on from.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "apps/run/restart.h"
#include "apps/run/results.h"
#include "apps/run/run.h"
#include "apps/simulator/state_file.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

namespace fs = std::filesystem;

// Time steps of 4 s between outputs at 30 s and 60 s.
const std::string slow_etch = etch_of_a_wafer + R"([output]
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
    return newest_restart(states, std::nullopt, recipe.hash(), {})->state.time_step;
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

// Somebody may clear the folder up.
TEST_F(Checkpoints, OneThatWasRemovedIsWrittenAnew) {
  int looks = 0;
  const RunEnd end = run_with("checkpoint_wall_time = \"0 s\"\n", [&](const State& state) {
    if (state.time < 30 && state.time_step > 1)
      looks += fs::remove(folder_ / "r" / interrupted_state);
    return true;
  });
  EXPECT_EQ(end, RunEnd::complete);
  EXPECT_GE(looks, 5);
}

// What somebody does to files of a run while it goes on, before its second output and after it.
TEST_F(Checkpoints, FilesThatAreRemovedOrReplacedAreWrittenAnew) {
  run(recipe(""), folder_ / "whole", {});
  const std::string rows = metrics_without_times(folder_ / "whole" / "metrics.csv");
  const std::string metrology = read_file(folder_ / "whole" / "metrology.csv");
  using Harm = void (*)(const fs::path& file);
  const std::vector<std::pair<std::string, Harm>> harms{
      {"was removed", [](const fs::path& file) { fs::remove(file); }},
      {"became a folder",
       [](const fs::path& file) {
         fs::remove(file);
         fs::create_directories(file / "kept");
       }},
      {"became a pipe",
       [](const fs::path& file) {
         fs::remove(file);
         mkfifo(file.c_str(), 0666);
       }},
      {"was changed", [](const fs::path& file) { std::ofstream(file) << "another table\n1,2\n"; }},
      {"was changed", [](const fs::path& file) { fs::resize_file(file, 100); }}};
  for (const auto& [how, harm] : harms) {
    for (const bool dies : {false, true}) {
      fs::remove_all(folder_ / "r");
      std::ostringstream messages;
      RunOptions options;
      options.log = Log(messages, Log::Level::everything);
      const auto look = [&, &harm = harm](const State& state) {
        if (state.time_step == 3 || (!dies && state.time_step == 10))
          for (const char* name : {"metrics.csv", "metrology.csv", "recipe.toml", "surface.pvd",
                                   "profiles.svg", "surface_0000.vtp"})
            harm(folder_ / "r" / name);
        return !dies || state.time_step < 12;
      };
      if (dies) {
        EXPECT_THROW(run_with("", look, options), ProcessDied);
        options.resume = true;
        run_with(
            "", [](const State&) { return true; }, options);
      } else {
        EXPECT_EQ(run_with("", look, options), RunEnd::complete);
      }
      EXPECT_THAT(messages.str(), HasSubstr(how)) << how;
      EXPECT_EQ(metrics_without_times(folder_ / "r" / "metrics.csv"), rows) << how;
      EXPECT_EQ(read_file(folder_ / "r" / "recipe.toml"),
                read_file(folder_ / "whole" / "recipe.toml"));
      EXPECT_EQ(read_file(folder_ / "r" / "metrology.csv"), metrology) << how;
      EXPECT_TRUE(losses_of_complete_run(folder_ / "r", recipe("")));
      if (how == "became a folder") {
        EXPECT_TRUE(fs::exists(folder_ / "r" / "metrics.csv.aside-1" / "kept"));
        EXPECT_EQ(fs::exists(folder_ / "r" / "metrics.csv.aside-2" / "kept"), !dies);
      }
    }
  }
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
  ResultFolder folder(folder_ / "r", known);
  const auto state = folder.resume({});
  ASSERT_TRUE(state);
  EXPECT_EQ(folder.last_checkpoint(), before);
  folder.write_checkpoint(*state);
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
    return newest_restart(states, std::nullopt, known.hash(), Log(messages, Log::Level::everything))
        .value();
  };
  std::ostringstream none;
  ASSERT_EQ(found(none).file, newest);
  ASSERT_EQ(none.str(), "");
  const std::string whole = read_file(newest);
  const std::string hash_before = state_hash(
      newest_restart({&before, 1}, std::nullopt, known.hash(), {})->state, known.materials);
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

using CheckpointsOnSignals = Program;

TEST_F(CheckpointsOnSignals, OfABatchSystemAreWritten) {
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

}  // namespace
}  // namespace scarp
