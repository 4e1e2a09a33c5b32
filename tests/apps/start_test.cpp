// Recipes that start from the state of another run.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>
#include <string>

#include "core/error.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

constexpr const char* small_domain = R"(
[domain]
spacing = "20 nm"
extent = ["480 nm"]
mode = "2d"
[flux]
target_error = 0.1
[materials.ZrO2]
density = "2.77e22 /cm3"
)";

constexpr const char* closing_trench = R"(
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "trench"
width = "100 nm"
depth = "300 nm"
taper = "-15 deg"
)";

// Closes the trench over a void; then F and O cover what they etch.
constexpr const char* first_step = R"(
[[step]]
model = "conformal"
thickness = "80 nm"
material = "ZrO2"
[[step]]
name = "film"
model = "single_particle"
duration = "5 s"
growth_rate = "4 nm/s"
material = "ZrO2"
sticking = 0.5
[[step]]
name = "etch"
model = "sf6_o2"
duration = "20 s"
etchant_flux = "1e17 /cm2/s"
etches = ["ZrO2"]
sputter_amplitude = { default = 0.01 }
sputter_threshold = { default = "20 eV" }
[step.until]
depth = "15 nm"
)";

constexpr const char* second_step = R"(
[[step]]
name = "on"
model = "sf6_o2"
duration = "3 s"
etchant_flux = "1e17 /cm2/s"
etches = ["ZrO2"]
sputter_amplitude = { default = 0.01 }
sputter_threshold = { default = "20 eV" }
[output]
every = "0.7 s"
)";

class Start : public Program {
 protected:
  // Both recipes in one, and one after the other.
  void SetUp() override {
    write("both.toml", std::string(small_domain) + closing_trench + first_step + second_step);
    write("a.toml", std::string(small_domain) + closing_trench + first_step +
                        "[output]\nevery = \"0.7 s\"\n");
    run("a");
    fs::create_directory(folder_ / "states");
    fs::copy(last_state("a"), folder_ / "states" / "end.vdb");
    write("b.toml", "start = \"states/end.vdb\"\n" + std::string(small_domain) + second_step);
  }

  void run(const std::string& name, const std::string& more = "") const {
    const Outcome outcome =
        scarp("run " + path(name + ".toml") + " --quiet -o " + path(name) + more);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
  }

  fs::path last_state(const std::string& name) const {
    const int outputs = summary(name)["outputs"];
    return folder_ / name / ("state_" + std::to_string(10000 + outputs - 1).substr(1) + ".vdb");
  }

  // Rows of metrics.csv from a time step on, without the place in the recipe.
  std::string rows_from(const std::string& name, int time_step) const {
    std::istringstream in(metrics_without_times(folder_ / name / "metrics.csv"));
    std::string kept;
    std::string row;
    for (int n = -1; std::getline(in, row); ++n) {
      const std::string number = row.substr(row.rfind(',', row.size() - 2) + 1);
      if (n >= 0 && std::stoi(number) >= time_step) kept += row.substr(row.find(',')) + '\n';
    }
    return kept;
  }

  Outcome check(const std::string& change) const {
    return scarp("check " + path("b.toml") + " --set " + change);
  }
};

TEST_F(Start, OneRecipeAfterTheOtherGivesTheBitsOfBothInOne) {
  run("both");
  run("b");
  const auto both = summary("both");
  const auto b = summary("b");
  EXPECT_EQ(both["state_hash"], b["state_hash"]);
  EXPECT_EQ(both["process_time_s"], b["process_time_s"]);
  EXPECT_EQ(both["voids"], b["voids"]);
  const int steps_before = summary("a")["time_steps"];
  EXPECT_EQ(both["time_steps"], steps_before + b["time_steps"].get<int>());
  EXPECT_EQ(rows_from("both", steps_before), rows_from("b", 0));
  ASSERT_EQ(b["steps"].size(), 1U);
  EXPECT_EQ(b["steps"][0], both["steps"][3]);
}

TEST_F(Start, ARunGoesOnWithTheSameBitsAfterAnInterruption) {
  run("b");
  for (int kept = 1; kept <= 3; ++kept) {
    fs::remove_all(folder_ / "cut");
    fs::copy(folder_ / "b", folder_ / "cut", fs::copy_options::recursive);
    fs::remove(folder_ / "cut" / "summary.json");
    for (int n = kept; n <= 3; ++n)
      fs::remove(folder_ / "cut" / ("state_000" + std::to_string(n) + ".vdb"));
    ASSERT_EQ(scarp("run " + path("b.toml") + " --quiet --resume -o " + path("cut")).exit_code, 0);
    expect_same_bits("b", "cut");
  }
  EXPECT_EQ(scarp("run " + path("b.toml") + " --resume -o " + path("b")).exit_code, 0);
}

TEST_F(Start, TheRecipeInTheResultsRunsFromElsewhere) {
  run("b");
  fs::create_directory(folder_ / "elsewhere");
  fs::copy(folder_ / "b" / "recipe.toml", folder_ / "elsewhere" / "copy.toml");
  run("elsewhere/copy");
  expect_same_bits("b", "elsewhere/copy");
}

// Numbers of materials are those of a recipe: here others come first.
TEST_F(Start, MaterialsAreKnownByTheirNames) {
  run("b");
  const int outputs_of_b = summary("b")["outputs"];
  std::string text = read_file(folder_ / "b.toml");
  text.insert(text.find("[materials.ZrO2]"), "[materials.Y2O3]\ndensity = \"2.7e22 /cm3\"\n");
  write("c.toml", text);
  run("c");
  EXPECT_NE(summary("c")["materials"]["ZrO2"], summary("b")["materials"]["ZrO2"]);
  const std::string profile = "profile_000" + std::to_string(outputs_of_b - 1) + ".csv";
  EXPECT_EQ(read_file(folder_ / "c" / profile), read_file(folder_ / "b" / profile));
}

TEST_F(Start, CheckAndPreviewWorkOnTheState) {
  const auto cost = json_of(scarp("check --json " + path("b.toml")));
  EXPECT_THAT(cost["recipe"].get<std::string>(),
              HasSubstr("start = \"" + path("states/end.vdb") + "\""));
  const auto preview =
      json_of(scarp("preview --json " + path("b.toml") + " -o " + path("preview")));
  const auto end = summary("a")["metrology"];
  EXPECT_NEAR(preview["highest_nm"].get<double>(), end["highest_nm"].get<double>(), 1e-6);
  EXPECT_EQ(preview["layers"].size(), 2U);
  EXPECT_EQ(preview["void_count"], 1);
}

TEST_F(Start, AnotherGridIsRefusedByTheNameOfTheKey) {
  EXPECT_EQ(check("step[0].duration='\"6 s\"'").exit_code, 0);
  for (const auto& [change, message] :
       {std::pair{"domain.spacing='\"40 nm\"'",
                  "domain.spacing: differs from the state that start names, which has 20 nm"},
        {"domain.extent='[\"400 nm\"]'", "domain.extent[0]: differs from the state"},
        {"domain.boundary='[\"periodic\"]'", "domain.boundary[0]: differs from the state"}}) {
    const Outcome outcome = check(change);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.messages, HasSubstr(message));
  }
  const Outcome mode = check("domain.mode='\"3d\"' --set domain.extent='[\"480 nm\", \"40 nm\"]'");
  EXPECT_THAT(mode.messages,
              HasSubstr("domain.mode: differs from the state that start names, which has \"2d\""));
}

TEST_F(Start, AStateThatCannotBeUsedIsTold) {
  // Steps are not judged by a wafer that is not known.
  const std::string nothing_there = " --set step[0].until='{ gone = \"Si\" }'";
  EXPECT_THAT(
      check("start='\"states/none.vdb\"'" + nothing_there).messages,
      AllOf(HasSubstr(": start: "), HasSubstr("states/none.vdb"), Not(HasSubstr("step[0]"))));
  fs::resize_file(folder_ / "states" / "end.vdb", 2000);
  EXPECT_THAT(check("start='\"states/end.vdb\"'").messages,
              HasSubstr("not a checkpoint that can be read"));
  fs::copy(last_state("a"), folder_ / "states" / "end.vdb", fs::copy_options::overwrite_existing);

  EXPECT_THAT(check("geometry='[{ shape = \"wafer\", material = \"Si\" }]'").messages,
              HasSubstr("geometry[0].shape: there is a wafer already"));
  EXPECT_THAT(check("step[0].until='{ gone = \"SiO2\" }'").messages,
              HasSubstr("until.gone: there is no SiO2 on the wafer when the step begins; there is "
                        "Si, ZrO2"));
  std::string text = read_file(folder_ / "b.toml");
  const std::size_t added = text.find("[materials.ZrO2]");
  write("d.toml", text.erase(added, text.find("[[step]]") - added));
  EXPECT_THAT(scarp("check " + path("d.toml") + " --set step[0].etches='[\"Si\"]'").messages,
              HasSubstr("holds the material ZrO2, which this recipe does not know; add a table "
                        "[materials.ZrO2] with its density"));
}

TEST_F(Start, TheStateIsNotReplacedAndAnotherOneIsAnotherRecipe) {
  const std::string state = last_state("a").string();
  const Outcome own =
      scarp("run " + path("b.toml") + " --set start='\"" + state + "\"' -o " + path("a"));
  EXPECT_EQ(own.exit_code, 2);
  EXPECT_THAT(own.messages, HasSubstr("the run would replace the state that it starts from"));
  EXPECT_TRUE(fs::exists(state));

  run("b");
  fs::copy(folder_ / "a" / "state_0003.vdb", folder_ / "states" / "end.vdb",
           fs::copy_options::overwrite_existing);
  const Outcome resumed = scarp("run " + path("b.toml") + " --quiet --resume -o " + path("b"));
  EXPECT_EQ(resumed.exit_code, 2);
  EXPECT_THAT(resumed.messages, HasSubstr("belongs to another recipe"));
}

// Who reads recipes alone, without checkpoints, is not given a wafer that is not there.
TEST(StartState, IsRefusedWhereNoStateCanBeRead) {
  const std::string start = "start = \"" + std::string(SCARP_SOURCE_DIR) + "/README.md\"\n";
  try {
    read_text(start + small_domain +
              "[[step]]\nmodel = \"isotropic\"\nduration = \"1 s\"\netch_rate = \"1 nm/s\"\n");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("start: a state cannot be read here"));
  }
}

}  // namespace
}  // namespace scarp
