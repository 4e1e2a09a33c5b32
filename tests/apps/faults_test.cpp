// What may happen to a run from outside: it ends with the right exit code and says what to do, and
// nothing that was finished is lost.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>
#include <vector>

#include "apps/run/run.h"
#include "core/error.h"
#include "core/system/peak_memory.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

// Two hundred time steps, with a checkpoint after each.
const std::string long_etch = etch_of_a_wafer + R"([advection]
cfl = 0.03
[output]
every = "10 s"
checkpoint_wall_time = "0 s"
)";

// A run beside the test, which stands still while the test looks at its folder.
class Faults : public Program {
 protected:
  void SetUp() override { write("r.toml", long_etch); }

  void TearDown() override {
    if (process_ <= 0) return;
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }

  std::string run_into(const std::string& name) const {
    return "run " + path("r.toml") + " --quiet -o " + path(name);
  }

  // It is stopped as soon as the file is there.
  void start_until(const std::string& file, const std::string& arguments) {
    const std::string line =
        "exec " + std::string(SCARP_BINARY) + ' ' + arguments + " 2>" + path("log");
    process_ = fork();
    if (process_ == 0) {
      execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
      _exit(127);
    }
    while (!fs::exists(folder_ / file) && waitpid(process_, nullptr, WNOHANG) == 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    kill(process_, SIGSTOP);
    waitpid(process_, nullptr, WUNTRACED);
  }

  int exit_code_of_rest() {
    kill(process_, SIGCONT);
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = 0;
    return WEXITSTATUS(status);
  }

  std::string messages() const { return read_file(folder_ / "log"); }

  void expect_resumes_to_the_same_state() {
    const Outcome resumed = scarp(run_into("r") + " --resume");
    EXPECT_EQ(resumed.exit_code, 0) << resumed.messages;
    ASSERT_EQ(scarp(run_into("whole")).exit_code, 0);
    EXPECT_EQ(summary("r")["state_hash"], summary("whole")["state_hash"]);
  }

 private:
  pid_t process_ = 0;
};

TEST_F(Faults, ASecondRunInAFolderIsRefusedAndTheFirstGoesOn) {
  start_until("r/state_0001.vdb", run_into("r"));
  for (const char* how : {"", " --resume"}) {
    const Outcome second = scarp(run_into("r") + how);
    EXPECT_EQ(second.exit_code, 2);
    EXPECT_THAT(second.messages, AllOf(HasSubstr(path("r")), HasSubstr("another scarp is writing"),
                                       HasSubstr("another folder with -o")));
  }
  EXPECT_EQ(exit_code_of_rest(), 0);
  ASSERT_EQ(scarp(run_into("whole")).exit_code, 0);
  expect_same_bits("r", "whole");
}

TEST_F(Faults, OutputsThatAreRemovedAreNotMissed) {
  start_until("r/state_0002.vdb", run_into("r"));
  for (const char* name : {"state_0001.vdb", "surface_0001.vtp", "recipe.toml", "surface.pvd"})
    fs::remove(folder_ / "r" / name);
  EXPECT_EQ(exit_code_of_rest(), 0) << messages();
  ASSERT_EQ(scarp(run_into("whole")).exit_code, 0);
  expect_same_bits("r", "whole");
}

TEST_F(Faults, FilesThatAreRemovedEndNoRun) {
  start_until("r/state_0002.vdb", run_into("r"));
  for (const std::string& name : files("r"))
    if (name != ".lock") fs::remove(folder_ / "r" / name);
  EXPECT_EQ(exit_code_of_rest(), 0);
  EXPECT_THAT(messages(), AllOf(HasSubstr("metrics.csv: was removed while the run writes it"),
                                HasSubstr("recipe.toml: was removed; it is written again"),
                                HasSubstr("r: the run is complete, but without surface_0000.vtp")));
  ASSERT_EQ(scarp("run " + path("r.toml") + " --quiet -o " + path("whole")).exit_code, 0);
  expect_same_bits("whole", "r");
}

TEST_F(Faults, NobodyThatReadsMessagesEndsNoRun) {
  for (const std::string closed : {"2>/dev/full", "2>&-", ">&- 2>&-"}) {
    const std::string line =
        std::string(SCARP_BINARY) + " run " + path("r.toml") + " -o " + path("r") + ' ' + closed;
    EXPECT_EQ(WEXITSTATUS(std::system(line.c_str())), 0) << closed;
    EXPECT_EQ(read_file(folder_ / "r" / ".lock"), "") << closed;
  }
  const std::string line = '(' + std::string(SCARP_BINARY) + " run " + path("r.toml") + " -o " +
                           path("r") + " 2>&1 >/dev/null; echo $? >" + path("code") + ") | true";
  std::system(line.c_str());
  EXPECT_EQ(read_file(folder_ / "code"), "0\n");
}

// While a run is prepared, which a fine grid makes long.
TEST_F(Faults, AnInterruptBeforeTheFirstFileEndsARunAtOnce) {
  // Without job control a shell has what runs beside it ignore SIGINT.
  const std::string line = "set -m\n" + std::string(SCARP_BINARY) + " run " + path("r.toml") +
                           R"( --set domain.mode='"3d"' --set domain.extent='["200 nm", "200 nm"]')"
                           R"( --set domain.spacing='"0.25 nm"' --quiet -o )" +
                           path("r") + " & sleep 0.3; kill -INT $!; wait $!; echo $? >" +
                           path("code");
  write("script", line);
  std::system(("bash " + path("script")).c_str());
  EXPECT_EQ(read_file(folder_ / "code"), "130\n");
  EXPECT_FALSE(fs::exists(folder_ / "r" / "metrics.csv"));
}

// The first must not write among the files of the second.
TEST_F(Faults, AFolderThatIsReplacedIsLeftToTheRunThatIsInIt) {
  start_until("r/state_0001.vdb", run_into("r"));
  fs::rename(folder_ / "r", folder_ / "moved");
  ASSERT_EQ(scarp(run_into("r")).exit_code, 0);
  const std::string metrics = read_file(folder_ / "r" / "metrics.csv");
  EXPECT_EQ(exit_code_of_rest(), 3);
  EXPECT_THAT(messages(), HasSubstr("was removed while a run writes into its folder"));
  EXPECT_EQ(read_file(folder_ / "r" / "metrics.csv"), metrics);
}

TEST_F(Faults, AFolderThatIsRemovedEndsTheRun) {
  start_until("r/state_0001.vdb", run_into("r"));
  fs::remove_all(folder_ / "r");
  EXPECT_EQ(exit_code_of_rest(), 3);
  EXPECT_THAT(messages(), HasSubstr("was removed while a run writes into its folder"));
}

// ulimit counts in units of 512 bytes: states have 24 kB, metrics.csv comes to 32 kB.
TEST_F(Faults, AFileThatMayNotGrowIsToldAndTheRunGoesOn) {
  const std::string line =
      "ulimit -f 52; " + std::string(SCARP_BINARY) + ' ' + run_into("r") + " 2>" + path("log");
  ASSERT_EQ(WEXITSTATUS(std::system(("sh -c '" + line + "'").c_str())), 3);
  EXPECT_THAT(messages(), AllOf(HasSubstr("larger than files may be here"), HasSubstr("ulimit -f"),
                                HasSubstr("continue with: scarp run ")));
  EXPECT_GT(files("r").size(), 3U);
  for (const std::string& name : files("r")) EXPECT_THAT(name, Not(HasSubstr(".tmp-")));
  expect_resumes_to_the_same_state();
  expect_same_bits("r", "whole");
}

TEST_F(Faults, WithoutAStateThereIsNothingToGoOnFrom) {
  const std::string line =
      "ulimit -f 8; " + std::string(SCARP_BINARY) + ' ' + run_into("r") + " 2>" + path("log");
  ASSERT_EQ(WEXITSTATUS(std::system(("sh -c '" + line + "'").c_str())), 3);
  ASSERT_TRUE(fs::exists(folder_ / "r" / "recipe.toml"));
  ASSERT_FALSE(fs::exists(folder_ / "r" / "state_0000.vdb"));
  EXPECT_THAT(messages(), AllOf(HasSubstr("raise the limit (ulimit -f), then run again: nothing "
                                          "was saved yet"),
                                Not(HasSubstr("--resume"))));
}

// A mount, as permission does not hold for root.
TEST_F(Faults, AFolderThatIsReadOnlyIsRefusedBeforeAnythingIsLost) {
  ASSERT_EQ(scarp(run_into("r") + " --set step[0].duration='\"6 s\"'").exit_code, 0);
  const std::string before = read_file(folder_ / "r" / "summary.json");
  const std::string mount =
      "mount --bind " + path("r") + ' ' + path("r") + " && mount -o remount,bind,ro " + path("r");
  if (std::system(("unshare -rm sh -c '" + mount + "' 2>/dev/null").c_str()) != 0)
    GTEST_SKIP() << "no user namespace to mount a folder read-only in";
  const auto exit_code_of = [&](const std::string& call) {
    const std::string line = "unshare -rm sh -c \"" + mount + " && exec " + SCARP_BINARY + ' ' +
                             call + "\" 2>" + path("log");
    return WEXITSTATUS(std::system(line.c_str()));
  };
  EXPECT_EQ(exit_code_of(run_into("r") + R"( --resume --set 'step[0].duration=\"6 s\"')"), 0);
  EXPECT_EQ(exit_code_of(run_into("r")), 2);
  EXPECT_THAT(messages(), AllOf(HasSubstr(path("r")), HasSubstr("cannot be written"),
                                HasSubstr("choose another with -o")));
  EXPECT_EQ(read_file(folder_ / "r" / "summary.json"), before);
}

TEST_F(Faults, ARunThatTakesMoreMemoryThanItMayIsRefusedBeforeAnythingIsLost) {
  const std::string shorter = " --set step[0].duration='\"6 s\"'";
  ASSERT_EQ(scarp(run_into("r") + shorter).exit_code, 0);
  const std::string before = read_file(folder_ / "r" / "summary.json");
  const Outcome refused = scarp(run_into("r") + shorter + " --memory-limit 10MB");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.messages,
              AllOf(HasSubstr("the run takes at least "), HasSubstr(" MB (program 45, grid "),
                    HasSubstr("of memory, more than the 10 MB"), HasSubstr("coarser spacing")));
  EXPECT_EQ(read_file(folder_ / "r" / "summary.json"), before);
  EXPECT_EQ(scarp(run_into("r") + shorter + " --memory-limit 4GB").exit_code, 0);
}

// No flux is solved only to be thrown away.
TEST_F(Faults, ARunThatIsToStopSolvesNoFurtherFlux) {
  const Recipe recipe = read_recipe(recipe_in(folder_ / "r.toml"));
  std::atomic<bool> stop = false;
  RunOptions options;
  options.stop = &stop;
  std::vector<std::uint32_t> ended;
  options.progress = [&](const State& state, const Survey&) {
    ended.push_back(state.time_step);
    stop = state.time_step == 5;
  };
  EXPECT_EQ(run(recipe, folder_ / "r", options), RunEnd::interrupted);
  EXPECT_EQ(ended.size(), 5U);
  expect_resumes_to_the_same_state();
  // Nor is a time step begun where the first flux took longer than there was time.
  stop = true;
  ended.clear();
  EXPECT_EQ(run(recipe, folder_ / "at_once", options), RunEnd::interrupted);
  EXPECT_TRUE(ended.empty());
}

// The memory for hits is just enough for the surface that the run begins with.
TEST_F(Faults, ARunWhoseFluxNoLongerFitsEndsWithACheckpoint) {
  Recipe recipe = read_text(silicon_wafer + R"([[geometry]]
shape = "mask"
material = "mask"
thickness = "20 nm"
opening = { shape = "trench", width = "100 nm" }
[[step]]
name = "etch"
model = "single_particle"
duration = "60 s"
sticking = 1
source_power = 100
etch_rate = { Si = "1 nm/s", mask = "0 nm/s" }
[flux]
engine = "gather"
)");
  recipe.flux.options.memory_limit = 0;
  try {
    run(recipe, folder_ / "d", {});
    FAIL();
  } catch (const InputError& error) {
    const std::string_view message = error.what();
    const std::string_view least = "allow at least ";
    recipe.flux.options.memory_limit =
        std::stoull(std::string(message.substr(message.find(least) + least.size())));
  }
  EXPECT_THAT([&] { run(recipe, folder_ / "d", {}); },
              testing::ThrowsMessage<NumericalError>(
                  AllOf(HasSubstr("of step \"etch\""), HasSubstr("flux.memory_limit"),
                        HasSubstr("start = \"" + path("d/state_interrupted.vdb")))));
  EXPECT_TRUE(fs::exists(folder_ / "d" / "state_interrupted.vdb"));
}

TEST_F(Faults, ARunThatComesToTakeMoreMemoryEndsWithACheckpoint) {
  const Recipe recipe = read_recipe(recipe_in(folder_ / "r.toml"));
  RunOptions options;
  options.memory_limit_mb = peak_memory_mb() + 100;
  std::vector<char> ballast;
  std::uint32_t ended_at = 0;
  options.progress = [&](const State& state, const Survey&) {
    if (state.time_step == 5) ballast.assign(200 << 20, 'x');
    ended_at = state.time_step;
  };
  EXPECT_THAT([&] { run(recipe, folder_ / "r", options); },
              testing::ThrowsMessage<NumericalError>(
                  AllOf(HasSubstr("time step 5 of step"), HasSubstr("MB of memory, more than the "),
                        HasSubstr("--resume"), HasSubstr("state_interrupted.vdb"))));
  EXPECT_EQ(ended_at, 5U);
  expect_resumes_to_the_same_state();
}

}  // namespace
}  // namespace scarp
