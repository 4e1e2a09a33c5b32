#include "apps/estimate/memory_estimate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "apps/simulator/simulator.h"
#include "apps/simulator/symmetry.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"
#include "tests/sanitizers.h"

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
#ifdef SCARP_UNDER_ASAN
  GTEST_SKIP() << "the sanitizer holds several times as much memory";
#endif
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
    const State state = start_state(recipe.domain.frame, recipe.start);
    const RunSize size =
        size_from_grid(state.layers, recipe.steps, recipe.simplification, recipe.flux.options);
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
  const State state = start_state(recipe.domain.frame, recipe.start);
  const auto flux = [&](double rays) {
    return expected_memory(state.layers, recipe.steps,
                           {.kept_rays = rays, .memory_limit = recipe.flux.options.memory_limit})
        .flux;
  };
  EXPECT_NEAR(flux(1 << 20), 18, 1e-9);
  EXPECT_NEAR(flux(1e9), 90, 1e-9);
}

// On a flat wafer in space most of what is expected, elsewhere no more than that.
TEST(MemoryEstimate, IsAtLeastThatOfAFlatWafer) {
  const std::string step =
      "[[step]]\nmodel = \"isotropic\"\nduration = \"1 s\"\netch_rate = \"1 nm/s\"\n";
  const std::string wafer = "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n";
  const std::string layer =
      "[[geometry]]\nshape = \"layer\"\nmaterial = \"SiO2\"\nthickness = \"23 nm\"\n";
  const std::string trench =
      "[[geometry]]\nshape = \"trench\"\nwidth = \"90 nm\"\ndepth = \"500 nm\"\n";
  for (const std::string domain :
       {"extent = [\"800 nm\"]\nmode = \"2d\"\n", "extent = [\"800 nm\", \"600 nm\"]\n",
        "extent = [\"800 nm\", \"600 nm\"]\nsymmetry = \"auto\"\n",
        "extent = [\"800 nm\", \"600 nm\"]\n[simplify]\nenabled = false\n"}) {
    for (const std::string& geometry : {wafer, wafer + layer, wafer + layer + trench}) {
      const Recipe given = read_text("[domain]\nspacing = \"5 nm\"\n" + domain + geometry + step);
      const Recipe recipe =
          on_part(given, given.domain.uses_symmetry ? mirror_planes(given) : FoundPlanes{});
      const State state = start_state(recipe.domain.frame, recipe.start);
      const MemoryEstimate expected = expected_memory(
          state.layers, recipe.steps,
          size_from_grid(state.layers, recipe.steps, recipe.simplification, recipe.flux.options));
      const MemoryEstimate least = least_memory(given);
      EXPECT_LE(least.grid, expected.grid) << domain << geometry;
      EXPECT_LE(least.mesh, expected.mesh) << domain << geometry;
      EXPECT_LE(least.total(), expected.total()) << domain << geometry;
      if (geometry == wafer && !recipe.domain.frame.two_dimensional) {
        EXPECT_GT(least.total() - least.program, 0.5 * (expected.total() - expected.program))
            << domain;
      }
    }
  }
}

using MemoryLimit = Program;

// Four million places, for whose grid and mesh there is not the time here.
TEST_F(MemoryLimit, RefusesBeforeTheGridIsMade) {
  const std::string fine =
      std::string(SCARP_SOURCE_DIR) +
      "/configs/trench_deposition.toml --set domain.spacing='\"5 nm\"' --memory-limit 1GB ";
  for (const std::string& command :
       {"check " + fine, "run " + fine + "-o " + path("r"),
        "run --set domain.symmetry='\"auto\"' --memory-limit 500MB " +
            fine.substr(0, fine.find("--memory")) + "-o " + path("r")}) {
    const auto begin = std::chrono::steady_clock::now();
    const Outcome refused = scarp(command);
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5)) << command;
    EXPECT_EQ(refused.exit_code, 2) << command;
    EXPECT_THAT(refused.messages,
                AllOf(HasSubstr("the run takes at least "), HasSubstr(" MB of --memory-limit")))
        << command;
  }
}

TEST_F(MemoryLimit, APreviewThatTakesMoreIsRefused) {
  const std::string preview = "preview " + small_trench("-o " + path("r"));
  const Outcome refused = scarp(preview + " --set domain.spacing='\"1 nm\"' --memory-limit 1GB");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.messages, HasSubstr("the wafer takes at least "));
  EXPECT_EQ(scarp(preview + " --memory-limit 200MB").exit_code, 0);
}

// What a coarse grid does not tell, and the first time steps do.
TEST_F(MemoryLimit, CheckWarnsWhereARunWouldBeRefused) {
  const std::string arguments = "check " + small_trench("--set flux.target_error=0.0001");
  EXPECT_THAT(scarp(arguments + " --memory-limit 70MB").messages,
              AllOf(HasSubstr("warning: scarp run would refuse it"), HasSubstr("70 MB")));
  EXPECT_EQ(scarp(arguments + " --memory-limit 4GB").messages.find("refuse"), std::string::npos);
}

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
