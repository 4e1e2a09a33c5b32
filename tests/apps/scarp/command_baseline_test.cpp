#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// The recipes in tests/regression, against what they gave when their baselines were made.
class RegressionSuite : public Program, public ::testing::WithParamInterface<int> {};
INSTANTIATE_TEST_SUITE_P(Threads, RegressionSuite, ::testing::Values(1, 2));

TEST_P(RegressionSuite, GivesWhatItGave) {
  const Outcome outcome =
      scarp("baseline check " + std::string(SCARP_SOURCE_DIR) + "/tests/regression --quiet -o " +
            path("out") + " --threads " + std::to_string(GetParam()));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.messages;
}

class BaselineCommand : public Program {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(path("suite"));
    write("suite/film.toml", R"(
[domain]
spacing = "10 nm"
extent = ["400 nm", "40 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "trench"
width = "200 nm"
depth = "200 nm"
[flux]
target_error = 0.03
[[step]]
model = "single_particle"
material = "SiO2"
growth_rate = "10 nm/s"
sticking = 0.3
duration = "6 s"
)");
  }

  Outcome baseline(const std::string& action, const std::string& more = "") const {
    return scarp("baseline " + action + " " + path("suite") + " -o " + path("out") + " " + more);
  }
};

TEST_F(BaselineCommand, ASpeedThatIsThreePerCentHigherIsCaught) {
  ASSERT_EQ(baseline("create").exit_code, 0);
  const Outcome same = baseline("check");
  EXPECT_EQ(same.exit_code, 0) << same.out;
  EXPECT_THAT(same.out, HasSubstr("as it was"));
  const Outcome other = baseline("check", "--set step[0].growth_rate='\"10.3 nm/s\"'");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.out, ::testing::ContainsRegex("trench 1 SiO2_top_nm at t = 6 s: 61\\.(79|8)"));
  const std::string page = read_file(path("out/report.html"));
  EXPECT_THAT(page, HasSubstr("<li class=\"bad\">trench 1 SiO2_top_nm"));
  EXPECT_THAT(page, HasSubstr("<svg"));
  EXPECT_FALSE(nlohmann::json::parse(read_file(path("out/baseline.json"))).at("passed"));
  // What is not known as the page of a check is somebody's own.
  std::filesystem::remove(path("out/baseline.json"));
  const Outcome foreign = baseline("check");
  EXPECT_EQ(foreign.exit_code, 2);
  EXPECT_THAT(foreign.messages, HasSubstr("report.html: was not written by a check of baselines"));
}

// What a condition asks for is there in both; the time that it takes is not.
TEST_F(BaselineCommand, AStepThatGetsThereSoonerIsCaught) {
  write("suite/film.toml",
        "[domain]\nspacing = \"10 nm\"\nextent = [\"400 nm\"]\nmode = \"2d\"\n[[geometry]]\n"
        "shape = \"wafer\"\nmaterial = \"Si\"\n[[step]]\nmodel = \"isotropic\"\nmaterial = "
        "\"SiO2\"\ngrowth_rate = \"10 nm/s\"\nduration = \"60 s\"\nuntil = { thickness = \"60 "
        "nm\" }\n");
  ASSERT_EQ(baseline("create").exit_code, 0);
  const Outcome same = baseline("check", "--set step[0].growth_rate='\"10.05 nm/s\"'");
  EXPECT_EQ(same.exit_code, 0) << same.out;
  const Outcome other = baseline("check", "--set step[0].growth_rate='\"10.3 nm/s\"'");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.out, HasSubstr("time_s at t = 6 s: 5.82"));
}

// Another seed is another run of the same recipe: chance is in the tolerances.
TEST_F(BaselineCommand, OtherSeedsAreWithinTheTolerances) {
  ASSERT_EQ(baseline("create").exit_code, 0);
  for (const char* seed : {"11", "12", "13", "14", "15", "16"}) {
    const Outcome outcome = baseline("check", std::string("--set flux.seed=") + seed);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.out;
  }
}

TEST_F(BaselineCommand, SaysWhatIsMissing) {
  const Outcome never = baseline("check");
  EXPECT_EQ(never.exit_code, 2);
  EXPECT_THAT(never.messages, HasSubstr("film.baseline.json: is missing"));
  write("suite/film.baseline.json", "{}");
  const std::string refused = baseline("check").messages;
  EXPECT_THAT(refused, HasSubstr("is no baseline"));
  EXPECT_THAT(refused, Not(HasSubstr("json.exception")));
  const Outcome empty = scarp("baseline check " + path("nowhere"));
  EXPECT_EQ(empty.exit_code, 2);
  EXPECT_THAT(empty.messages, HasSubstr("is no folder with recipes"));
  EXPECT_EQ(scarp("baseline look " + path("suite")).exit_code, 2);
}

}  // namespace
}  // namespace scarp
