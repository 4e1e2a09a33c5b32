#include "apps/simulator/flux_target.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/estimate/estimate.h"
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
              AllOf(HasSubstr("flux.max_rays is 100"), HasSubstr("the 5000 that are needed")));
  flux.missed_by = RayCap::memory;
  EXPECT_THAT(missed_target_text(flux, options),
              AllOf(HasSubstr("flux.memory_limit (3 MB)"), Not(HasSubstr("max_rays"))));
  EXPECT_EQ(missed_target_text(flux, options, {.memory_limit = "", .target = "--target-error"}),
            "the memory for hits holds no more than these 5000 rays; raise --target-error");
  flux.missed_by = RayCap::elements;
  EXPECT_THAT(missed_target_text(flux, options, {.engine = "--engine"}),
              HasSubstr("set --engine to \"forward\""));
}

class FluxTargetOfARun : public Program {
 protected:
  void run(const std::string& flux) {
    write("r.toml", film_in_trench(flux));
    const Outcome outcome = scarp("run " + path("r.toml") + " -o " + path("r"));
    ASSERT_EQ(outcome.exit_code, 0);
    messages_ = outcome.messages;
    flux_ = summary("r")["flux"];
    page_ = read_file(path("r/report.html"));
  }

  std::string messages_;
  nlohmann::json flux_;
  std::string page_;
};

TEST_F(FluxTargetOfARun, IsToldWhereItIsMissed) {
  run("max_rays = 4096\ntarget_error = 0.001\n");
  EXPECT_EQ(flux_["target"], 0.001);
  EXPECT_GT(flux_["largest_error"], 0.001);
  EXPECT_GT(flux_["time_steps_missed"], 0);
  EXPECT_THAT(messages_, AllOf(HasSubstr("the cap of 4096 rays came first"),
                               HasSubstr("flux.target_error, 0.001, was missed in ")));
  EXPECT_THAT(
      page_,
      HasSubstr("<p class=\"unsure\">Error of the flux (noise and size of elements): at most "));
}

TEST_F(FluxTargetOfARun, IsToldWhereItIsKept) {
  run("target_error = 0.03\n");
  EXPECT_EQ(flux_["time_steps_missed"], 0);
  EXPECT_LE(flux_["largest_error"], 0.03);
  EXPECT_THAT(messages_, HasSubstr("the error of the flux is at most 0.0"));
  EXPECT_THAT(page_, HasSubstr("<p>Error of the flux (noise and size of elements): at most"));
}

TEST_F(FluxTargetOfARun, IsToldInNanometresOfThePosition) {
  run("position_error = 0.01\n");
  EXPECT_EQ(flux_["in_position"], true);
  EXPECT_NEAR(flux_["target"].get<double>(), 0.1, 1e-12);
  EXPECT_EQ(flux_["time_steps_missed"], 0);
  EXPECT_THAT(messages_, HasSubstr(" nm (flux.position_error 0.1 nm)"));
  EXPECT_THAT(page_, HasSubstr("Error of the position (noise and size of elements): at most "));
}

TEST_F(FluxTargetOfARun, IsNoneOfAFixedNumberOfRays) {
  run("rays = 4096\n");
  EXPECT_TRUE(flux_["target"].is_null());
  EXPECT_GT(flux_["largest_error"], 0);
}

TEST(FluxTarget, OutOfReachIsSaidBeforeARun) {
  const auto warning_of = [](const std::string& flux) {
    const Recipe recipe = read_text(film_in_trench(flux));
    return missed_target_warning(estimate_cost(recipe), recipe.flux);
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
