// Flows of several masks: what the recipes of configs/ make is what geometry says.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "apps/estimate/blanket_rates.h"
#include "apps/estimate/estimate.h"
#include "apps/run/results.h"
#include "apps/run/run.h"
#include "core/error.h"
#include "core/log.h"
#include "core/system/read_file.h"
#include "core/system/temporary_folder.h"
#include "tests/apps/columns.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;

constexpr double spacing = 10;

class Flow : public testing::Test {
 protected:
  /// Of a recipe of configs/ at a coarse spacing.
  void run_config(const std::string& name, std::vector<std::string> overrides = {}) {
    overrides.emplace_back("domain.spacing=\"10 nm\"");
    run_recipe(read_recipe(
        recipe_in(fs::path(SCARP_SOURCE_DIR) / "configs" / (name + ".toml"), overrides)));
  }
  void run_text(const std::string& text) {
    run_recipe(read_recipe(RecipeSource{.text = text, .name = "flow"}));
  }
  void run_recipe(const Recipe& recipe) {
    ASSERT_EQ(run(recipe, folder_, {}), RunEnd::complete);
    summary_ = nlohmann::json::parse(read_file(folder_ / "summary.json"));
    columns_ = columns_of(folder_ / "metrology.csv");
  }

  std::size_t last_output() const { return summary_["outputs"].get<std::size_t>() - 1; }
  bool has(const std::string& material) const { return summary_["materials"].contains(material); }
  /// Units: nm^3.
  double volume(const std::string& material, std::size_t output) const {
    return cell(material + "_volume_nm3", rows(output).front());
  }
  std::vector<std::size_t> rows(std::size_t output) const {
    std::vector<std::size_t> rows;
    const auto& outputs = columns_.at("output");
    for (std::size_t n = 0; n < outputs.size(); ++n)
      if (outputs[n] == std::to_string(output)) rows.push_back(n);
    return rows;
  }
  double cell(const std::string& column, std::size_t row) const {
    const std::string& text = columns_.at(column).at(row);
    return text.empty() ? std::nan("") : std::stod(text);
  }
  /// One value per opening, by its place along x.
  std::map<double, double> by_place(const std::string& column, std::size_t output) const {
    std::map<double, double> found;
    for (const std::size_t row : rows(output)) {
      const std::string& plane = columns_.at("plane")[row];
      if (plane.starts_with("x =")) continue;
      found[std::round(cell("x_nm", row))] = cell(column, row);
    }
    return found;
  }

  TemporaryFolder folder_;
  nlohmann::json summary_;
  std::map<std::string, std::vector<std::string>> columns_;
};

TEST_F(Flow, TwoMasksHalveThePitch) {
  run_config("litho_etch_litho_etch");
  EXPECT_FALSE(has("resist"));
  EXPECT_FALSE(has("Si3N4"));
  const auto low = by_place("cd_at_20_nm", last_output());
  const auto high = by_place("cd_at_60_nm", last_output());
  const auto depth = by_place("depth_nm", last_output());
  ASSERT_EQ(high.size(), 4U);
  for (const double x : {-120.0, -40.0, 40.0, 120.0}) {
    ASSERT_TRUE(high.contains(x)) << x;
    EXPECT_NEAR(high.at(x), 40, 0.05 * spacing) << x;
    EXPECT_NEAR(low.at(x), 40, 0.05 * spacing) << x;
    EXPECT_NEAR(depth.at(x), 80, 0.01 * spacing) << x;
  }
  // Three trenches go through, the fourth one ends at y = 20 nm.
  const double open = 40 * 160 * 3 + 40 * 100;
  EXPECT_NEAR(volume("SiO2", last_output()), (320 * 160 - open) * 80, 0.005 * 320 * 160 * 80);
}

TEST_F(Flow, SpacersAndACut) {
  run_config("sadp_cut");
  for (const char* const gone : {"aC", "SiO2", "resist"}) EXPECT_FALSE(has(gone)) << gone;
  EXPECT_NEAR(cell("highest_nm", rows(last_output()).front()), 40, 0.01 * spacing);
  // Four lines of 40 nm, one of them without 80 nm of its length.
  const double lines = 40 * (4 * 240 - 80);
  EXPECT_NEAR(volume("Si3N4", last_output()), lines * 40, 0.01 * lines * 40);
  const auto widths = by_place("cd_at_20_nm", last_output());
  for (const double x : {-160.0, 80.0}) EXPECT_NEAR(widths.at(x), 40, 0.05 * spacing) << x;
}

TEST_F(Flow, ViaAndTrenchOfCopper) {
  run_config("dual_damascene");
  EXPECT_FALSE(has("resist"));
  const double barrier = 10;
  const double trench = (260 - 2 * barrier) * (120 - 2 * barrier) * (100 - barrier);
  const double via = (80 - 2 * barrier) * (80 - 2 * barrier) * 120;
  EXPECT_NEAR(volume("Cu", last_output()), trench + via, 0.01 * (trench + via));
  EXPECT_NEAR(volume("Cu", last_output()) + volume("TaN", last_output()),
              260 * 120 * 100 + 80 * 80 * 120, 0.01 * 260 * 120 * 100);
  EXPECT_NEAR(cell("highest_nm", rows(last_output()).front()), 220, 0.01 * spacing);
  // After both etches, before the barrier.
  const auto low = by_place("cd_at_60_nm", 6);
  const auto high = by_place("cd_at_180_nm", 6);
  EXPECT_NEAR(low.begin()->second, 80, 0.05 * spacing);
  EXPECT_NEAR(high.begin()->second, 260, 0.05 * spacing);
}

TEST_F(Flow, ContactFromEtchToPolish) {
  run_config("contact_module", {"flux.target_error=0.05"});
  for (const char* const gone : {"mask", "polymer"}) EXPECT_FALSE(has(gone)) << gone;
  EXPECT_EQ(summary_["steps"][1]["ended_by"], "exposed");
  EXPECT_NEAR(cell("highest_nm", rows(last_output()).front()), 490, 0.01 * spacing);
  // The liner on the flat oxide.
  const std::size_t after_liner = 5;
  EXPECT_NEAR(cell("TiN_top_nm", rows(after_liner).front()), 20, 0.05 * spacing);
  EXPECT_GT(volume("W", last_output()), 0);
}

const std::string flat_section =
    "[domain]\nspacing = \"5 nm\"\nextent = [\"400 nm\"]\nmode = \"2d\"\n"
    "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n";

// A bridge over a channel: without its filling nothing holds the beam but for keep_free.
TEST_F(Flow, AReleasedBeamStaysWhereAsked) {
  const std::string beam =
      flat_section +
      "[[step]]\nmodel = \"conformal\"\nmaterial = \"SiO2\"\nthickness = \"40 nm\"\n"
      "[[step]]\nmodel = \"mask\"\nmaterial = \"W\"\nthickness = \"30 nm\"\n"
      "resist = { shape = \"trench\", width = \"100 nm\" }\n"
      "[[step]]\nmodel = \"strip\"\nmaterial = \"SiO2\"\n";
  run_text(beam);
  EXPECT_FALSE(has("W"));
  EXPECT_EQ(summary_["islands_removed"]["count"], 1);
  run_text(beam + "keep_free = true\n" +
           "[[step]]\nmodel = \"isotropic\"\nduration = \"5 s\"\nmaterial = \"TiN\"\n"
           "growth_rate = \"1 nm/s\"\n");
  EXPECT_TRUE(has("W"));
  // In two dimensions volumes are those of a slice of one spacing.
  EXPECT_NEAR(volume("W", last_output()), 100 * 30 * 5, 0.01 * 100 * 30 * 5);
  EXPECT_EQ(summary_["islands_removed"]["count"], 0);
}

// A mask over steps, as a film: cut by its outline, and as thick on the step.
TEST_F(Flow, AMaskOfOneThickness) {
  run_text(flat_section +
           "[[geometry]]\nshape = \"fin\"\nmaterial = \"SiO2\"\nwidth = \"100 nm\"\n"
           "height = \"60 nm\"\n"
           "[[step]]\nmodel = \"mask\"\nmaterial = \"resist\"\nthickness = \"20 nm\"\n"
           "planar = false\nresist = { shape = \"trench\", width = \"240 nm\" }\n");
  // On both floors, the walls and the top; a quarter of a disc at each edge.
  const double quarter = std::numbers::pi * 20 * 20 / 4;
  const double expected = 100 * 20 + 2 * 60 * 20 + 2 * (70 - 20) * 20 + 2 * quarter;
  EXPECT_NEAR(volume("resist", last_output()), 5 * expected, 0.02 * 5 * expected);
}

// A mask that the etch uses up: told before the run, and when it happens.
TEST_F(Flow, AMaskThatIsUsedUp) {
  const auto etch = [](const std::string& rate, const std::string& more = "") {
    return flat_section +
           "[[step]]\nmodel = \"mask\"\nmaterial = \"resist\"\nthickness = \"20 nm\"\n"
           "opening = { shape = \"trench\", width = \"100 nm\" }\n" +
           more +
           "[[step]]\nname = \"deep etch\"\nmodel = \"directional\"\nduration = \"30 s\"\n"
           "directional_etch_rate = { Si = \"5 nm/s\", resist = \"" +
           rate + "\", default = \"0 nm/s\" }\n";
  };
  const auto warnings_of = [](const std::string& text) {
    return read_recipe(RecipeSource{.text = text, .name = "flow"}).warnings;
  };
  const std::vector<std::string> told = warnings_of(etch("1 nm/s"));
  ASSERT_EQ(told.size(), 1U);
  EXPECT_THAT(told[0], testing::HasSubstr("20 nm of resist are gone after 20 s of 30 s"));
  EXPECT_TRUE(warnings_of(etch("0.5 nm/s")).empty());
  // Two steps together.
  EXPECT_EQ(
      warnings_of(etch("0.5 nm/s",
                       "[[step]]\nmodel = \"directional\"\nduration = \"10 s\"\n"
                       "directional_etch_rate = { resist = \"1 nm/s\", default = \"0 nm/s\" }\n"))
          .size(),
      1U);
  std::ostringstream said;
  const Recipe recipe = read_recipe(RecipeSource{.text = etch("1 nm/s"), .name = "flow"});
  RunOptions options;
  options.log = Log(said);
  ASSERT_EQ(run(recipe, folder_, options), RunEnd::complete);
  EXPECT_THAT(said.str(),
              testing::HasSubstr("\"deep etch\" has used up the mask: no resist is left"));
}

// Of 200 nm at 90 nm/min a mask is gone after 133 1/3 s, told to six digits. With an end condition
// that is not known before the end is.
TEST_F(Flow, AMaskThatIsUsedUpBeforeTheEndOfAStep) {
  const auto etch = [](const std::string& more, const std::string& before = "") {
    return read_recipe(RecipeSource{
        .text = flat_section +
                "[[step]]\nmodel = \"mask\"\nmaterial = \"resist\"\nthickness = \"200 nm\"\n"
                "opening = { shape = \"trench\", width = \"100 nm\" }\n" +
                before +
                "[[step]]\nname = \"deep etch\"\nmodel = \"directional\"\n"
                "directional_etch_rate = { Si = \"5 nm/s\", resist = \"90 nm/min\" }\n" +
                more,
        .name = "flow"});
  };
  const Recipe timed = etch("duration = \"200 s\"\n");
  ASSERT_EQ(timed.warnings.size(), 1U);
  const std::string what =
      "uses up the mask: on an open flat wafer 200 nm of resist are gone after 133.333 s of 200 "
      "s; use a thicker mask, or a shorter step";
  EXPECT_THAT(timed.warnings[0], testing::HasSubstr(what));
  EXPECT_TRUE(estimate_cost(timed).used_masks.empty());
  // Polished by 50 nm; a film on the mask would make that another number.
  const std::string polish = "[[step]]\nmodel = \"planarise\"\nremoval = \"50 nm\"\n";
  const Recipe polished = etch("duration = \"110 s\"\n", polish);
  ASSERT_EQ(polished.warnings.size(), 1U);
  EXPECT_THAT(polished.warnings[0], testing::HasSubstr("150 nm of resist are gone after 100 s"));
  const std::string film =
      "[[step]]\nmodel = \"conformal\"\nmaterial = \"Si\"\nthickness = \"50 nm\"\n";
  EXPECT_TRUE(etch("duration = \"110 s\"\n", film + polish).warnings.empty());

  const Recipe ended =
      etch("duration = \"1000 s\"\nuntil = { depth = \"1 um\", material = \"Si\" }\n");
  EXPECT_TRUE(ended.warnings.empty());
  const std::vector<std::string> used = estimate_cost(ended).used_masks;
  ASSERT_EQ(used.size(), 1U);
  EXPECT_THAT(used[0], testing::HasSubstr("step \"deep etch\" uses up the mask: on an open flat "
                                          "wafer 200 nm of resist are gone after 133.333 s of 2"));
  // Ended in time, and not known to end at all.
  EXPECT_TRUE(estimate_cost(etch("duration = \"1000 s\"\nuntil = { depth = \"0.5 um\" }\n"))
                  .used_masks.empty());
  EXPECT_TRUE(
      estimate_cost(etch("duration = \"1000 s\"\nuntil = { gone = \"Si\" }\n")).used_masks.empty());
}

// What is stripped wherever it is, later steps need not know; in a cycle those before it do.
TEST_F(Flow, AfterABuriedStripTheMaterialIsNotMet) {
  const std::string mask =
      "\nmodel = \"mask\"\nmaterial = \"resist\"\nthickness = \"60 nm\"\n"
      "opening = { shape = \"trench\", width = \"100 nm\" }\n";
  const std::string strip = "\nmodel = \"strip\"\nmaterial = \"resist\"\nburied = true\n";
  const auto etch = [](const std::string& rates) {
    return "\nmodel = \"directional\"\nduration = \"10 s\"\ndirectional_etch_rate = { " + rates +
           " }\n";
  };
  const std::string silicon = etch("Si = \"1 nm/s\"");
  const std::string both = etch("Si = \"1 nm/s\", resist = \"0 nm/s\"");
  const auto error_of = [](const std::string& steps) -> std::string {
    try {
      read_recipe(RecipeSource{.text = flat_section + steps, .name = "flow"});
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const std::string step = "[[step]]";
  EXPECT_EQ(error_of(step + mask + step + both + step + strip + step + silicon), "");
  EXPECT_THAT(error_of(step + mask + step + silicon), testing::HasSubstr("no value for resist"));
  // Nor can it be stripped twice, or end a step.
  EXPECT_THAT(error_of(step + mask + step + strip + step + strip),
              testing::HasSubstr("step[2].material: there is no resist on the wafer"));
  EXPECT_THAT(
      error_of(step + mask + step + strip + step + silicon + "until = { gone = \"resist\" }\n"),
      testing::HasSubstr("there is no resist on the wafer when the step begins"));
  // Deposited again.
  EXPECT_THAT(error_of(step + mask + step + strip + step + mask + step + silicon),
              testing::HasSubstr("step[3].directional_etch_rate: no value for resist"));

  const std::string twice = "[[step]]\nrepeat = 2\n";
  const std::string inner = "[[step.step]]";
  EXPECT_EQ(error_of(twice + inner + mask + inner + both + inner + strip + inner + silicon), "");
  EXPECT_EQ(error_of(twice + inner + silicon + inner + mask + inner + strip), "");
  EXPECT_THAT(error_of(twice + inner + silicon + inner + strip + inner + mask),
              testing::HasSubstr("no resist on the wafer"));
  // What grows on itself in later rounds.
  const std::string film = "\nmodel = \"conformal\"\nmaterial = \"HfO2\"\nthickness = \"20 nm\"\n";
  EXPECT_EQ(error_of(twice + inner + film + "on = [\"Si\", \"HfO2\"]\n"), "");
  EXPECT_THAT(error_of(twice + inner + film + "on = [\"HfO2\"]\n"),
              testing::HasSubstr("on: there is no HfO2 on the wafer when the step begins"));
  EXPECT_THAT(error_of(step + film + "on = [\"Si\", \"HfO2\"]\n"),
              testing::HasSubstr("on: there is no HfO2 on the wafer when the step begins"));
  EXPECT_THAT(error_of(step + "\nmodel = \"planarise\"\nstop_material = \"SiO2\"\n"),
              testing::HasSubstr("step[0].stop_material: there is no SiO2 on the wafer"));
  // In the first round it is met before the strip, in the second one it was left by the mask.
  EXPECT_THAT(error_of(step + mask + "[[step]]\nrepeat = 2\n" + inner + silicon + inner + strip),
              testing::HasSubstr("no value for resist"));
  EXPECT_EQ(error_of(step + mask + "[[step]]\nrepeat = 2\n" + inner + both + inner + strip + step +
                     silicon),
            "");
  EXPECT_THAT(error_of(twice + inner + silicon + inner + mask),
              testing::HasSubstr("no value for resist"));
  EXPECT_EQ(error_of(twice + inner + mask + inner + both + "until = { gone = \"resist\" }\n" +
                     inner + strip),
            "");
}

// A film between nodes that a strip leaves without support: what is lost of it is told.
TEST_F(Flow, AFilmThatAStripLeavesBehind) {
  const auto said_with = [&](const std::string& film) {
    std::ostringstream said;
    RunOptions options;
    options.log = Log(said);
    const std::string text =
        flat_section +
        "[[step]]\nmodel = \"mask\"\nmaterial = \"resist\"\nthickness = \"60 nm\"\n"
        "resist = { shape = \"trench\", width = \"100 nm\" }\n"
        "[[step]]\nmodel = \"conformal\"\nmaterial = \"TiN\"\nthickness = \"" +
        film +
        "\"\n[[step]]\nmodel = \"strip\"\nmaterial = \"resist\"\nburied = true\n"
        "keep_free = true\n";
    run(read_recipe(RecipeSource{.text = text, .name = "flow"}), folder_, options);
    return said.str();
  };
  EXPECT_THAT(said_with("2 nm"), testing::HasSubstr("nm^3 of TiN are lost"));
  EXPECT_THAT(said_with("15 nm"), testing::Not(testing::HasSubstr("are lost")));
}

// What a step meets, and how fast an open wafer of it goes.
TEST_F(Flow, RatesOnOpenWafers) {
  const Recipe recipe =
      read_recipe(recipe_in(fs::path(SCARP_SOURCE_DIR) / "configs" / "dual_damascene.toml"));
  const std::vector<StepRates> rates = blanket_rates(recipe);
  ASSERT_EQ(rates.size(), 2U);
  EXPECT_EQ(recipe.steps[rates[0].step].name, "via etch");
  ASSERT_EQ(rates[0].rates.size(), 4U);  // W, SiO2, Si3N4, resist: neither TaN nor Cu
  for (const BlanketRate& rate : rates[1].rates) {
    const bool is_oxide = recipe.materials[rate.material].name == "SiO2";
    EXPECT_FLOAT_EQ(static_cast<float>(rate.speed), is_oxide ? -1 : 0);
  }
  StepRates selective{
      .step = 0, .rates = {{0, -4}, {1, -0.1}, {2, 0}, {3, 2}, {4, -9}}, .films = {0, 1, 2, 3}};
  EXPECT_DOUBLE_EQ(selective.selectivity_to(selective.rates[1]).value_or(0), 40);
  for (const std::size_t n : {0U, 2U, 3U, 4U})
    EXPECT_FALSE(selective.selectivity_to(selective.rates[n]).has_value());
}

// Polymer that a plasma deposits is etched fastest, and no film of the wafer. What grows or is put
// on before is one.
TEST_F(Flow, SelectivitiesAreThoseOfTheFilms) {
  const Recipe recipe = read_recipe({.text = flat_section + R"(
[[step]]
model = "conformal"
material = "SiO2"
thickness = "60 nm"
[[step]]
model = "mask"
material = "resist"
thickness = "50 nm"
opening = { shape = "trench", width = "100 nm" }
[[step]]
name = "oxide"
model = "fluorocarbon"
duration = "1 s"
blanket_rate = { SiO2 = "1000 nm/min", resist = "400 nm/min", Si = "12.5 nm/min" }
[[step.ion]]
energy = "300 eV"
[[step]]
name = "silicon"
model = "directional"
duration = "1 s"
directional_etch_rate = { Si = "5 nm/s", SiO2 = "0.004 nm/s", polymer = "40 nm/s", default = "1 nm/s" }
[[step]]
repeat = 2
[[step.step]]
name = "passivate"
model = "isotropic"
duration = "1 s"
growth_rate = "20 nm/s"
material = "Al2O3"
[[step.step]]
name = "open"
model = "directional"
duration = "1 s"
directional_etch_rate = { Al2O3 = "30 nm/s", Si = "5 nm/s", default = "0 nm/s" }
)"});
  std::vector<std::string> lines;
  for (const StepRates& rates : blanket_rates(recipe))
    lines.push_back(text_of(rates, recipe.materials));
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_THAT(lines[0], testing::HasSubstr("SiO2 -1000 nm/min, resist -400 nm/min"));
  EXPECT_THAT(lines[0], testing::EndsWith("; SiO2 : Si 80, SiO2 : resist 2.5"));
  EXPECT_THAT(lines[1], testing::EndsWith("; Si : SiO2 1250, Si : resist 5"));
  EXPECT_THAT(lines[2], testing::StartsWith("all materials +1200 nm/min"));
  EXPECT_THAT(lines[3], testing::Not(testing::HasSubstr(" : ")));
}

TEST_F(Flow, InvertSwapsWhatStays) {
  const std::string mask =
      flat_section +
      "[[step]]\nmodel = \"mask\"\nmaterial = \"resist\"\nthickness = \"50 nm\"\n"
      "opening = { shape = \"trench\", width = \"100 nm\" }\n";
  run_text(mask);
  EXPECT_NEAR(volume("resist", last_output()), 5 * 300 * 50, 0.002 * 5 * 300 * 50);
  run_text(mask + "invert = true\n");
  EXPECT_NEAR(volume("resist", last_output()), 5 * 100 * 50, 0.002 * 5 * 100 * 50);
}

}  // namespace
}  // namespace scarp
