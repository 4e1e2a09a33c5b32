// simplify.enabled = "auto": left out where counts say that it saves nothing.

#include "apps/simulator/simplify_choice.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/estimate/memory_estimate.h"
#include "apps/simulator/simulator.h"
#include "tests/apps/columns.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

/// A trench that is widened by a prescribed rate, deepened under a beam and then coated.
std::string trench(const std::string& extent, const std::string& enabled) {
  return "[domain]\nspacing = \"10 nm\"\nextent = " + extent +
         "\n[simplify]\nenabled = " + enabled + R"(
[flux]
target_error = 0.05
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "trench"
width = "120 nm"
depth = "100 nm"
[[step]]
name = "widen"
model = "isotropic"
duration = "10 s"
etch_rate = "1 nm/s"
[[step]]
name = "deepen"
model = "directional"
duration = "10 s"
directional_etch_rate = "1 nm/s"
[[step.beam]]
tilt = "0 deg"
[[step]]
name = "film"
model = "single_particle"
duration = "20 s"
material = "SiO2"
sticking = 0.3
growth_rate = "1 nm/s"
[output]
every = "10 s"
)";
}

const std::string wide = "[\"300 nm\", \"300 nm\"]";
const std::string narrow_extent = "[\"200 nm\", \"100 nm\"]";

TEST(SimplifyChoice, DependsOnWhatTracesRaysAndOnTheNumberOfFacets) {
  const Recipe recipe = read_text(trench(wide, "\"auto\""));
  const auto choice = [&](std::size_t step, std::size_t facets) {
    return simplify_choice(recipe.simplification, recipe.steps[step], facets);
  };
  EXPECT_EQ(choice(0, 100000), SimplifyChoice::no_rays);
  EXPECT_EQ(choice(1, 100000), SimplifyChoice::simplify);
  EXPECT_EQ(choice(2, 100000), SimplifyChoice::simplify);
  EXPECT_EQ(choice(2, 1000), SimplifyChoice::simplify);
  EXPECT_EQ(choice(2, 999), SimplifyChoice::few_facets);
}

TEST(SimplifyChoice, IsLeftToTheRecipe) {
  for (const char* enabled : {"true", "false"}) {
    const Recipe recipe = read_text(trench(wide, enabled));
    EXPECT_FALSE(recipe.simplification.where_it_pays);
    EXPECT_EQ(simplify_choice(recipe.simplification, recipe.steps[0], 10),
              SimplifyChoice::simplify);
  }
  const Recipe open = read_text(trench(wide, "\"auto\""));
  EXPECT_THAT(open.resolved, HasSubstr("enabled = \"auto\""));
  EXPECT_TRUE(read_text(open.resolved).simplification.where_it_pays);
  EXPECT_TRUE(open.simplification.options.has_value());
  EXPECT_FALSE(read_text(silicon_wafer +
                         "[simplify]\nenabled = \"auto\"\n[[step]]\nmodel = \"isotropic\"\n"
                         "duration = \"1 s\"\netch_rate = \"1 nm/s\"\n")
                   .simplification.options.has_value());
}

TEST(SimplifyChoice, MemoryIsThatOfTheFullMeshWhereAStepMayHaveIt) {
  const Recipe open = read_text(trench(wide, "\"auto\""));
  const State state = prepared_state(open.domain.frame, open.start, open.steps, open.materials);
  const RunSize size =
      size_from_grid(state.layers, open.steps, open.simplification, open.flux.options);
  EXPECT_EQ(size.facets, size.facets_full);
  const Recipe always = read_text(trench(wide, "true"));
  EXPECT_LT(
      size_from_grid(state.layers, always.steps, always.simplification, always.flux.options).facets,
      size.facets_full);
}

class SimplifyChoiceOfARun : public Program {
 protected:
  std::string run(const std::string& extent, const std::string& enabled, const std::string& name) {
    write(name + ".toml", trench(extent, enabled));
    const Outcome outcome = scarp("run " + path(name + ".toml") + " -o " + path(name));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.messages;
    return outcome.messages;
  }

  /// The cells of a column in the rows of a step.
  std::vector<std::string> cells(const std::string& name, const std::string& column,
                                 const std::string& step) const {
    auto columns = columns_of(folder_ / name / "metrics.csv");
    std::vector<std::string> found;
    for (std::size_t row = 0; row < columns["step"].size(); ++row)
      if (columns["step"][row] == step) found.push_back(columns[column][row]);
    return found;
  }
};

TEST_F(SimplifyChoiceOfARun, IsToldByStep) {
  const std::string messages = run(wide, "\"auto\"", "r");
  EXPECT_THAT(cells("r", "simplify_left_out", "0"), Each("no_rays"));
  EXPECT_THAT(cells("r", "simplify_left_out", "1"), Each(""));
  EXPECT_THAT(cells("r", "simplify_left_out", "2"), Each(""));
  EXPECT_EQ(cells("r", "facets", "0"), cells("r", "facets_full", "0"));
  EXPECT_NE(cells("r", "facets", "2"), cells("r", "facets_full", "2"));
  const std::size_t left_out = cells("r", "step", "0").size();
  EXPECT_EQ(summary("r")["simplify_left_out"]["no_rays"], left_out);
  EXPECT_EQ(summary("r")["simplify_left_out"]["few_facets"], 0);
  EXPECT_THAT(messages, AllOf(HasSubstr("step \"widen\", t = 0 s: the mesh is not simplified"),
                              Not(HasSubstr("step \"deepen\", t")),
                              HasSubstr(fmt::format("simplification was skipped in {} of {} ",
                                                    left_out, summary("r")["time_steps"].dump()))));
}

TEST_F(SimplifyChoiceOfARun, IsForeseenByCheck) {
  write("r.toml", trench(wide, "\"auto\""));
  const nlohmann::json left_out =
      json_of(scarp("check --json " + path("r.toml")))["simplify_left_out"];
  ASSERT_EQ(left_out.size(), 1U);
  EXPECT_EQ(left_out[0]["name"], "widen");
  EXPECT_EQ(left_out[0]["reason"], "no_rays");
  EXPECT_THAT(scarp("check " + path("r.toml")).out,
              HasSubstr("# The mesh of step \"widen\" is not simplified: the step traces no rays"));
}

TEST_F(SimplifyChoiceOfARun, IsTheSameAfterAnInterruption) {
  run(wide, "\"auto\"", "whole");
  fs::copy(folder_ / "whole", folder_ / "cut", fs::copy_options::recursive);
  fs::remove(folder_ / "cut" / "summary.json");
  for (const char* number : {"2", "3", "4"})
    fs::remove(folder_ / "cut" / (std::string("state_000") + number + ".vdb"));
  ASSERT_EQ(scarp("run " + path("whole.toml") + " --resume -o " + path("cut")).exit_code, 0);
  for (const char* same : {"state_hash", "simplify_left_out"})
    EXPECT_EQ(summary("whole")[same], summary("cut")[same]) << same;
  EXPECT_EQ(metrics_without_times(folder_ / "whole" / "metrics.csv"),
            metrics_without_times(folder_ / "cut" / "metrics.csv"));
}

TEST_F(SimplifyChoiceOfARun, OfASmallSurfaceIsTheFullMesh) {
  const std::string messages = run(narrow_extent, "\"auto\"", "r");
  run(narrow_extent, "false", "full");
  EXPECT_EQ(summary("r")["state_hash"], summary("full")["state_hash"]);
  EXPECT_THAT(cells("r", "simplify_left_out", "2"), Each("few_facets"));
  EXPECT_GT(summary("r")["simplify_left_out"]["few_facets"], 0);
  EXPECT_THAT(messages, HasSubstr("the mesh has fewer than 1000 facets"));
  EXPECT_EQ(summary("full")["simplify_left_out"]["few_facets"], 0);
}

}  // namespace
}  // namespace scarp
