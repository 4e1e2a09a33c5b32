#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// A trench under a mask, etched straight down, the mask a tenth as fast.
constexpr const char* masked_etch = R"(
[domain]
mode = "2d"
spacing = "5 nm"
extent = ["400 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "resist"
thickness = "60 nm"
opening = { shape = "trench", width = "80 nm", center = "-100 nm" }
[[step]]
model = "directional"
duration = "10 s"
directional_etch_rate = { Si = "10 nm/s", resist = "1 nm/s" }
[output]
every = "2 s"
[metrology]
cd_at = ["-50 nm", "20 nm"]
)";

class MeasureCommand : public Program {
 protected:
  void SetUp() override { write("etch.toml", masked_etch); }

  Outcome run_etch(const std::string& folder, const std::string& more = "") const {
    return scarp("run " + path("etch.toml") + " -o " + path(folder) + " --quiet " + more);
  }

  /// The rows of a CSV file without quotes, by the names of its columns.
  std::vector<std::map<std::string, std::string>> rows(const std::string& file) const {
    std::istringstream in(read_file(path(file)));
    std::vector<std::string> names;
    std::vector<std::map<std::string, std::string>> rows;
    for (std::string line; std::getline(in, line);) {
      std::istringstream cells(line + ',');
      std::vector<std::string> row;
      for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
      if (names.empty()) {
        names = row;
        continue;
      }
      EXPECT_EQ(row.size(), names.size()) << line;
      rows.emplace_back();
      for (std::size_t n = 0; n < names.size(); ++n) rows.back()[names[n]] = row[n];
    }
    return rows;
  }
};

TEST_F(MeasureCommand, ComparesAnEtchWithItsStart) {
  ASSERT_EQ(run_etch("out").exit_code, 0);
  const Outcome measured = scarp("measure " + path("out") + " --json");
  ASSERT_EQ(measured.exit_code, 0) << measured.messages;
  const nlohmann::json found = json_of(measured);
  EXPECT_EQ(found["time_s"], 10);
  EXPECT_EQ(found["state"], path("out/state_0005.vdb"));
  ASSERT_EQ(found["openings"].size(), 1U);
  const nlohmann::json& trench = found["openings"][0];
  EXPECT_EQ(trench["kind"], "trench");
  EXPECT_EQ(trench["place"]["plane"], "across y");
  EXPECT_NEAR(trench["place"]["x_nm"], -100, 2.5);
  EXPECT_NEAR(trench["depth_nm"], 100, 0.5);
  EXPECT_NEAR(trench["middle_cd_nm"], 80, 0.5);
  EXPECT_NEAR(trench["sidewall_angle_deg"], 90, 0.2);
  EXPECT_NEAR(trench["mask_loss_nm"], 10, 0.5);
  EXPECT_NEAR(trench["selectivity"], 10, 0.5);
  EXPECT_NEAR(trench["cd_at"][1]["cd_nm"], 80, 0.5);
  EXPECT_TRUE(trench["arde_lag"].is_null());

  // The same object at the end of the run, and in numbers of the last output.
  nlohmann::json bare = found;
  bare.erase("state");
  bare.erase("time_s");
  EXPECT_EQ(summary("out")["metrology"], bare);
  const auto table = rows("out/metrology.csv");
  ASSERT_EQ(table.size(), 6U);
  EXPECT_EQ(table[0].at("depth_nm"), "");
  EXPECT_EQ(table[0].at("time_s"), "0");
  for (const char* name : {"depth_nm", "selectivity", "mask_thickness_nm"})
    EXPECT_NEAR(std::stod(table[5].at(name)), trench[name],
                1e-4 * std::abs(trench[name].get<double>()))
        << name;
  EXPECT_NEAR(std::stod(table[5].at("resist_top_nm")), 50, 0.5);
  EXPECT_NEAR(std::stod(table[5].at("cd_at_-50_nm")), 80, 0.5);
}

TEST_F(MeasureCommand, WritesATableOfAllOutputsAndSeveralRuns) {
  ASSERT_EQ(run_etch("one").exit_code, 0);
  ASSERT_EQ(run_etch("two", "--set step[0].duration='\"6 s\"'").exit_code, 0);
  const Outcome written = scarp("measure " + path("one") + ' ' + path("two") +
                                " --all --angle-at '-20 nm' -o " + path("all.csv"));
  ASSERT_EQ(written.exit_code, 0) << written.messages;
  const auto table = rows("all.csv");
  ASSERT_EQ(table.size(), 6U + 4U);
  const auto own = rows("one/metrology.csv");
  for (std::size_t n = 0; n < 6; ++n) {
    EXPECT_EQ(table[n].at("run"), path("one"));
    EXPECT_EQ(table[n].at("output"), std::to_string(n));
    for (const char* name : {"time_s", "depth_nm", "cd_at_-50_nm", "Si_volume_nm3"})
      EXPECT_EQ(table[n].at(name), own[n].at(name)) << name << n;
  }
  EXPECT_EQ(table[9].at("run"), path("two"));
  EXPECT_EQ(table[9].at("output"), "3");
  EXPECT_NEAR(std::stod(table[9].at("depth_nm")), 60, 0.5);
  EXPECT_NEAR(std::stod(table[9].at("left_angle_at_-20_deg")), 90, 0.5);
  EXPECT_NEAR(std::stod(table[9].at("right_angle_at_-20_deg")), 90, 0.5);
  // Of several runs the newest states, on standard output, each once.
  const Outcome printed = scarp("measure " + path("one") + ' ' + path("two") + ' ' + path("one/"));
  EXPECT_EQ(std::ranges::count(printed.out, '\n'), 3);
}

TEST_F(MeasureCommand, NamesTheHeightsThatStatesOfATableDoNotShare) {
  ASSERT_EQ(run_etch("one").exit_code, 0);
  ASSERT_EQ(run_etch("two", "--set metrology.cd_at='[\"-40 nm\"]'").exit_code, 0);
  const std::string measure = "measure " + path("one") + ' ' + path("two");
  const Outcome cds = scarp(measure + " --angle-at '-20 nm'");
  EXPECT_EQ(cds.exit_code, 2);
  EXPECT_THAT(cds.messages, HasSubstr("its recipe has other cd_at than that of "));
  EXPECT_THAT(cds.messages, HasSubstr("; give the heights with --cd-at\n"));
  ASSERT_EQ(run_etch("two",
                     "--set metrology.cd_at='[\"-40 nm\"]' "
                     "--set metrology.angle_at='[\"-40 nm\"]'")
                .exit_code,
            0);
  const Outcome both = scarp(measure);
  EXPECT_THAT(both.messages, HasSubstr("has other cd_at and angle_at than that of "));
  EXPECT_THAT(both.messages, HasSubstr("; give the heights with --cd-at and --angle-at\n"));
  EXPECT_EQ(scarp(measure + " --cd-at '-40 nm' --angle-at '-40 nm'").exit_code, 0);
}

TEST_F(MeasureCommand, TakesMasksHeightsAndStartFromTheCommandLine) {
  ASSERT_EQ(run_etch("out").exit_code, 0);
  const std::string state = path("out/state_0005.vdb");
  const auto trench = [&](const std::string& more) {
    return json_of(scarp("measure " + state + " --json " + more))["openings"][0];
  };
  // From the third output on; and from the top of the resist, which is no mask then.
  EXPECT_NEAR(trench("--start " + path("out/state_0003.vdb"))["mask_loss_nm"], 4, 0.2);
  EXPECT_NEAR(trench("--mask none")["depth_nm"], 150, 0.5);
  const nlohmann::json at = trench("--cd-at '-0.08 um' --cd-at 40nm")["cd_at"];
  ASSERT_EQ(at.size(), 2U);
  EXPECT_EQ(at[0]["height_nm"], -80);
  EXPECT_NEAR(at[0]["cd_nm"], 80, 0.5);

  ASSERT_EQ(run_etch("other", "--set domain.spacing='\"10 nm\"'").exit_code, 0);
  const Outcome other = scarp("measure " + state + " --start " + path("other/state_0000.vdb"));
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.messages, ::testing::HasSubstr("--start: "));

  // A state alone has no start.
  std::filesystem::copy_file(state, path("alone.vdb"));
  const nlohmann::json alone =
      json_of(scarp("measure " + path("alone.vdb") + " --json"))["openings"][0];
  EXPECT_TRUE(alone["mask_loss_nm"].is_null());
  EXPECT_NEAR(alone["mask_thickness_nm"], 50, 0.5);
}

TEST_F(MeasureCommand, PrintsATableWithoutWhatIsNotThere) {
  ASSERT_EQ(run_etch("out").exit_code, 0);
  const Outcome measured = scarp("measure " + path("out"));
  EXPECT_EQ(measured.exit_code, 0);
  EXPECT_THAT(measured.out, HasSubstr("trench 1"));
  EXPECT_THAT(measured.out, HasSubstr("sidewall_angle_deg"));
  EXPECT_THAT(measured.out, Not(HasSubstr("arde_lag")));
}

TEST_F(MeasureCommand, ListsNoFilmsWhereTheMaskIsGone) {
  ASSERT_EQ(run_etch("bare", "--set step[0].directional_etch_rate.resist='\"8 nm/s\"'").exit_code,
            0);
  const nlohmann::json found = json_of(scarp("measure " + path("bare") + " --json"));
  EXPECT_EQ(found["openings"][0]["films"], nlohmann::json::array());
}

TEST_F(MeasureCommand, RefusesWhatItCannotMeasure) {
  for (const auto& [arguments, message] :
       std::vector<std::pair<std::string, std::string>>{{path("nowhere"), "nowhere"},
                                                        {path("."), "holds no state_NNNN.vdb"},
                                                        {path("etch.toml"), "etch.toml"}}) {
    const Outcome outcome = scarp("measure " + arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_THAT(outcome.messages, HasSubstr(message));
  }
  ASSERT_EQ(run_etch("out").exit_code, 0);
  const Outcome height = scarp("measure " + path("out") + " --cd-at 50");
  EXPECT_EQ(height.exit_code, 2);
  EXPECT_THAT(height.messages, HasSubstr("--cd-at: \"50\" has no unit"));
  const Outcome mask = scarp("measure " + path("out") + " --mask resits");
  EXPECT_EQ(mask.exit_code, 2);
  EXPECT_THAT(mask.messages, HasSubstr("did you mean resist"));
}

TEST_F(MeasureCommand, MetrologyOfARunIsTheSameForAnyThreadCountAndAfterAnInterruption) {
  ASSERT_EQ(run_etch("one", "--threads 1").exit_code, 0);
  ASSERT_EQ(run_etch("two", "--threads 2").exit_code, 0);
  const std::string whole = read_file(path("one/metrology.csv"));
  EXPECT_EQ(whole, read_file(path("two/metrology.csv")));
  // As if it had been killed after the third output, while the fourth was being written.
  for (const char* later : {"state_0003.vdb", "state_0004.vdb", "state_0005.vdb", "summary.json"})
    std::filesystem::remove(path(std::string("two/") + later));
  ASSERT_EQ(run_etch("two", "--resume").exit_code, 0);
  EXPECT_EQ(whole, read_file(path("two/metrology.csv")));
  EXPECT_EQ(summary("one")["metrology"], summary("two")["metrology"]);
}

TEST_F(MeasureCommand, MasksOfARecipeMayBeNamed) {
  const auto depth = [&](const std::string& folder, const std::string& more) {
    EXPECT_EQ(run_etch(folder, more).exit_code, 0);
    return summary(folder)["metrology"]["openings"][0]["depth_nm"].get<double>();
  };
  EXPECT_NEAR(depth("none", "--set metrology.masks=[]"), 150, 0.5);
  EXPECT_NEAR(depth("named", "--set metrology.masks='[\"resist\"]'"), 100, 0.5);
  const Outcome wrong = run_etch("wrong", "--set metrology.masks='[\"resits\"]'");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.messages, HasSubstr("metrology.masks"));
}

TEST_F(MeasureCommand, AMaskThatIsNotOnTheWaferIsRefused) {
  ASSERT_EQ(run_etch("out").exit_code, 0);
  const Outcome option = scarp("measure " + path("out") + " --mask W");
  EXPECT_EQ(option.exit_code, 2);
  EXPECT_THAT(option.messages, HasSubstr("--mask: \"W\" is not on the wafer; it has Si, resist"));
  const Outcome key = scarp("check " + path("etch.toml") + " --set 'metrology.masks=[\"W\"]'");
  EXPECT_EQ(key.exit_code, 2);
  EXPECT_THAT(key.messages, HasSubstr("metrology.masks: W is neither on the wafer nor deposited"));
}

TEST_F(MeasureCommand, AHeightOutOfThisWorldIsRefused) {
  ASSERT_EQ(run_etch("out").exit_code, 0);
  const Outcome outcome = scarp("measure " + path("out") + " --cd-at '5 km'");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.messages, HasSubstr("--cd-at: "));
  const Outcome twice =
      scarp("measure " + path("out") + " --cd-at '-50 nm' --cd-at '-60 nm' --json");
  EXPECT_EQ(json_of(twice)["openings"][0]["cd_at"].size(), 2U);
  EXPECT_THAT(scarp("measure --help").out, Not(HasSubstr("-at TEXT ...")));
}

}  // namespace
}  // namespace scarp
