#include "apps/memory_estimate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "apps/simulator.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// Runs in which much goes to one thing, and what of the estimate is more than the program then.
struct LargeRun {
  std::string name;
  std::string arguments;
  std::string part;
};

std::ostream& operator<<(std::ostream& out, const LargeRun& run) { return out << run.name; }

class MemoryOfRuns : public Program, public ::testing::WithParamInterface<LargeRun> {};

TEST_P(MemoryOfRuns, IsEstimatedWithinAFactorOfTwo) {
  const std::string recipe = std::string(SCARP_SOURCE_DIR) + "/configs/" + GetParam().arguments;
  const nlohmann::json check = json_of(scarp("check --json " + recipe));
  ASSERT_EQ(scarp("run --quiet " + recipe + " -o " + path("r")).exit_code, 0);
  const double held = summary("r")["peak_memory_mb"];
  const double expected = check["memory_mb"];
  EXPECT_GT(expected, 0.5 * held);
  EXPECT_LT(expected, 2 * held);
  const nlohmann::json& parts = check["memory_parts_mb"];
  double sum = 0;
  for (const auto& [name, part] : parts.items()) {
    sum += part.get<double>();
    EXPECT_LE(part, parts[GetParam().part]) << name;
  }
  EXPECT_NEAR(sum, expected, 1e-9 * expected);
}

INSTANTIATE_TEST_SUITE_P(
    All, MemoryOfRuns,
    ::testing::Values(LargeRun{"Small",
                               "trench_deposition.toml --set step[0].duration='\"2 s\"' --set "
                               "domain.spacing='\"0.2 um\"'",
                               "program"},
                      LargeRun{"FineGrid",
                               "isotropic_etch.toml --set step[0].duration='\"1 s\"' --set "
                               "domain.spacing='\"5 nm\"'",
                               "mesh"},
                      LargeRun{"ManyRays",
                               "trench_deposition.toml --set step[0].duration='\"2 s\"' --set "
                               "flux.rays=10000000",
                               "flux"}),
    [](const auto& test) { return test.param.name; });

TEST(MemoryEstimate, KnowsFacetsFromTheGrid) {
  const std::string trench =
      "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n[[geometry]]\nshape = \"trench\"\n"
      "width = \"60 nm\"\ndepth = \"300 nm\"\n[[step]]\nmodel = \"isotropic\"\nduration = \"1 "
      "s\"\netch_rate = \"1 nm/s\"\n";
  for (const std::string domain : {"extent = [\"200 nm\"]\nmode = \"2d\"\n",
                                   "extent = [\"200 nm\", \"200 nm\"]\n[simplify]\nenabled = "
                                   "false\n"}) {
    const Recipe recipe = read_text("[domain]\nspacing = \"10 nm\"\n" + domain + trench);
    const State state = start_state(recipe);
    const RunSize size = size_from_grid(state.layers, recipe);
    const auto facets = static_cast<double>(survey(state, recipe).facets_full);
    EXPECT_NEAR(size.facets_full, facets, 0.2 * facets);
    EXPECT_EQ(size.facets, size.facets_full);
  }
}

TEST(MemoryEstimate, HitsStayWithinTheirLimit) {
  const Recipe recipe = read_text(
      "[domain]\nspacing = \"10 nm\"\nextent = [\"200 nm\"]\nmode = \"2d\"\n[[geometry]]\n"
      "shape = \"wafer\"\nmaterial = \"Si\"\n[flux]\nmemory_limit = \"80 MB\"\n[[step]]\nmodel = "
      "\"isotropic\"\nduration = \"1 s\"\netch_rate = \"1 nm/s\"\n");
  const State state = start_state(recipe);
  const auto flux = [&](double rays) {
    return expected_memory(state.layers, recipe, {.kept_rays = rays}).flux;
  };
  EXPECT_NEAR(flux(1 << 20), 18, 1e-9);
  EXPECT_NEAR(flux(1e9), 90, 1e-9);
}

using MemoryLimit = Program;

// Rays for a target are known to the trial alone: what the grid needs is less than the limit.
TEST_F(MemoryLimit, RefusesBeforeTheFirstSurfaceWhatATrialExpects) {
  const std::string arguments = "run " + small_trench("--set flux.target_error=0.0001 -o ") +
                                path("r") + " --memory-limit 70MB";
  const Outcome refused = scarp(arguments);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.messages, AllOf(HasSubstr("the run takes about "), HasSubstr("flux "),
                                      HasSubstr("more than the 70 MB of --memory-limit")));
}

}  // namespace
}  // namespace scarp
