#include "apps/flux_target.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>

#include "apps/estimate.h"
#include "apps/run.h"
#include "core/error.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// A film that closes in on a trench; how well its flux is known is told by what is set.
std::string film_in_trench(const std::string& flux) {
  return silicon_wafer + R"([[geometry]]
shape = "trench"
width = "100 nm"
depth = "100 nm"
[[step]]
name = "film"
model = "single_particle"
duration = "20 s"
material = "SiO2"
sticking = 0.3
growth_rate = "1 nm/s"
[flux]
)" + flux;
}

TEST(FluxTarget, NamesTheCapThatCameFirst) {
  FluxField flux{.rays = 5000, .missed_by = RayCap::rays};
  FluxOptions options{.max_rays = 5000, .memory_limit = 3 << 20};
  EXPECT_EQ(missed_target_text(flux, options),
            "the cap of 5000 rays came first; raise flux.max_rays or flux.target_error");
  options.max_rays = 100;
  EXPECT_THAT(missed_target_text(flux, options),
              AllOf(HasSubstr("flux.max_rays is 100"), HasSubstr("the 5000 that it takes")));
  flux.missed_by = RayCap::memory;
  EXPECT_THAT(missed_target_text(flux, options),
              AllOf(HasSubstr("flux.memory_limit (3 MB)"), Not(HasSubstr("max_rays"))));
  flux.missed_by = RayCap::elements;
  EXPECT_THAT(missed_target_text(flux, options, {.engine = "--engine"}),
              HasSubstr("set --engine to \"forward\""));
}

using FluxTargetOfARun = Program;

TEST_F(FluxTargetOfARun, IsToldWhereItIsMissed) {
  write("r.toml", film_in_trench("max_rays = 4096\ntarget_error = 0.001\n"));
  const Outcome outcome = scarp("run " + path("r.toml") + " -o " + path("r"));
  ASSERT_EQ(outcome.exit_code, 0);
  const auto flux = nlohmann::json::parse(read_file(path("r/summary.json")))["flux"];
  EXPECT_EQ(flux["target"], 0.001);
  EXPECT_GT(flux["largest_error"], 0.001);
  EXPECT_GT(flux["time_steps_missed"], 0);
  EXPECT_THAT(outcome.messages, AllOf(HasSubstr("the cap of 4096 rays came first"),
                                      HasSubstr("the target of the flux, 0.001, was missed in ")));
  EXPECT_THAT(read_file(path("r/report.html")),
              HasSubstr("<p class=\"unsure\">Standard error of the flux: at most "));
}

TEST_F(FluxTargetOfARun, IsToldWhereItIsKept) {
  write("r.toml", film_in_trench("target_error = 0.03\n"));
  const Outcome outcome = scarp("run " + path("r.toml") + " -o " + path("r"));
  ASSERT_EQ(outcome.exit_code, 0);
  const auto flux = nlohmann::json::parse(read_file(path("r/summary.json")))["flux"];
  EXPECT_EQ(flux["time_steps_missed"], 0);
  EXPECT_LE(flux["largest_error"], 0.03);
  EXPECT_THAT(outcome.messages, HasSubstr("the error of the flux is at most 0.0"));
  EXPECT_THAT(read_file(path("r/report.html")),
              HasSubstr("<p>Standard error of the flux: at most"));
}

TEST_F(FluxTargetOfARun, IsNoneOfAFixedNumberOfRays) {
  write("r.toml", film_in_trench("rays = 4096\n"));
  ASSERT_EQ(scarp("run " + path("r.toml") + " -o " + path("r")).exit_code, 0);
  const auto flux = nlohmann::json::parse(read_file(path("r/summary.json")))["flux"];
  EXPECT_TRUE(flux["target"].is_null());
  EXPECT_GT(flux["largest_error"], 0);
}

TEST(FluxTarget, OutOfReachIsSaidBeforeARun) {
  const auto warning_of = [](const std::string& flux) {
    const Recipe recipe = read_text(film_in_trench(flux));
    return missed_target_warning(estimate_cost(recipe), recipe);
  };
  EXPECT_EQ(warning_of("target_error = 0.02\n"), std::nullopt);
  EXPECT_EQ(warning_of("rays = 4096\n"), std::nullopt);
  EXPECT_THAT(warning_of("target_error = 0.0005\nmax_rays = 10000\n").value_or(""),
              HasSubstr("flux.target_error: 0.0005 is out of reach"));
  EXPECT_THAT(warning_of("target_error = 0.00005\nmemory_limit = \"1 MB\"\n").value_or(""),
              HasSubstr("is out of reach"));
}

}  // namespace
}  // namespace scarp
