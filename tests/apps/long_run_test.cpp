// Thousands of time steps: nothing grows that should not.

#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <utility>

#include "apps/run/run.h"
#include "core/parallel.h"
#include "core/system/temporary_folder.h"
#include "tests/apps/columns.h"
#include "tests/apps/recipe_text.h"
#include "tests/sanitizers.h"

namespace scarp {
namespace {

constexpr int time_steps = 5000;

// What the process holds now, without what it has freed. Units: bytes.
double resident_memory() {
  malloc_trim(0);
  std::ifstream statm("/proc/self/statm");
  double pages = 0;
  statm >> pages >> pages;
  return pages * static_cast<double>(sysconf(_SC_PAGESIZE));
}

// 100 nm of film in a trench by 5000 time steps of a hundredth of a spacing each, with a flux for
// every move and a checkpoint now and then.
std::string long_film(const std::string& geometry, const std::string& model) {
  return "[domain]\nspacing = \"2 nm\"\nextent = [\"200 nm\"]\nmode = \"2d\"\n"
         "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n" +
         geometry +
         "[flux]\nrays = 2000\ncarry_within = 0\n[[step]]\nduration = \"100 s\"\nmaterial = "
         "\"SiO2\"\n" +
         model +
         "growth_rate = \"1 nm/s\"\n[advection]\ncfl = 0.01\n[output]\n"
         "checkpoint_every = \"5 s\"\n";
}

struct LongRun {
  int time_steps = 0;
  double memory_early = 0;  // the most in the second hundred of time steps
  double memory_late = 0;   // in the last hundred
  double time = 0;          // of the last survey
  double lowest = 0;        // of the surface then
  double highest = 0;
};

LongRun run_through(const std::string& recipe, const std::filesystem::path& folder) {
  // Every thread would have a heap of its own, and what is free there lies in pieces.
  const ThreadLimit one(1);
  LongRun result;
  RunOptions options;
  double time = 0;
  options.progress = [&](const State& state, const Survey& now) {
    result.time_steps = static_cast<int>(state.time_step);
    if (state.time_step > 100 && state.time_step <= 200)
      result.memory_early = std::max(result.memory_early, resident_memory());
    if (state.time_step > time_steps - 100)
      result.memory_late = std::max(result.memory_late, resident_memory());
    result.time = std::exchange(time, state.time);
    result.lowest = now.extent.lower.z;
    result.highest = now.extent.upper.z;
  };
  run(read_text(recipe), folder, options);
  return result;
}

// The change of the volume beyond what speeds and areas say, as part of what moved.
double surplus(const std::filesystem::path& folder) {
  const auto columns = columns_of(folder / "metrics.csv");
  const auto value = [&](const char* name, std::size_t n) {
    return std::stod(columns.at(name)[n]);
  };
  const std::size_t last = columns.at("dt_s").size() - 1;
  double expected = 0;
  for (std::size_t n = 0; n < last; ++n)
    expected += value("growth_nm3_per_s", n) * value("dt_s", n);
  const double change = value("solid_volume_nm3", last) - value("solid_volume_nm3", 0);
  return (change - expected) / expected;
}

/// That of the sanitizer goes on growing: it keeps what is freed.
void expect_flat_memory([[maybe_unused]] const LongRun& result) {
#ifndef SCARP_UNDER_ASAN
  EXPECT_LT(result.memory_late, 1.02 * result.memory_early);
#endif
}

// The walls meet, and a void may close.
TEST(SlowLongRun, OfATrenchKeepsItsMemoryAndItsVolume) {
  const TemporaryFolder folder;
  const LongRun result = run_through(
      long_film("[[geometry]]\nshape = \"trench\"\nwidth = \"150 nm\"\ndepth = \"200 nm\"\n",
                "model = \"single_particle\"\nsticking = 0.2\n"),
      folder);
  EXPECT_NEAR(result.time_steps, time_steps, 10);
  expect_flat_memory(result);
  EXPECT_NEAR(surplus(folder), 0, 0.01);
}

TEST(SlowLongRun, OfAFlatWaferDoesNotDrift) {
  const TemporaryFolder folder;
  const LongRun result =
      run_through(long_film("", "model = \"single_particle\"\nsticking = 0.2\n"), folder);
  EXPECT_NEAR(result.time_steps, time_steps, 10);
  expect_flat_memory(result);
  // A wafer lies 0.001 spacings too high from the start.
  EXPECT_NEAR(result.lowest, result.time + 0.002, 1e-3);
  EXPECT_NEAR(result.highest - result.lowest, 0, 1e-4);
  EXPECT_NEAR(surplus(folder), 0, 1e-4);
}

}  // namespace
}  // namespace scarp
