// What the grid does to lowest points and micro-trenches at rounded feet of walls stands beside
// them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>

#include "program.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const std::string wafer = R"(
[domain]
spacing = "20 nm"
extent = ["400 nm"]
boundary = ["periodic"]
mode = "2d"
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "resist"
thickness = "200 nm"
opening = { shape = "trench", width = "200 nm" }
)";

// Walls reflect them to the feet.
const std::string ions = R"(
[[step]]
model = "multi_particle"
duration = "400 s"
rate = { Si = "-1 nm/s * etch", resist = "0 nm/s" }
[[step.ion]]
name = "ion"
source_power = 300
energy = "100 eV"
energy_deviation = "0 eV"
[[step.ion.yield]]
name = "etch"
amplitude = 0.1
angular = "enhanced"
)";

const std::string beam = R"(
[[step]]
model = "directional"
duration = "400 s"
directional_etch_rate = { Si = "1 nm/s", resist = "0 nm/s" }
)";

const std::string rinse = R"(
[[step]]
model = "isotropic"
duration = "1 s"
etch_rate = { Si = "1 nm/s", resist = "0 nm/s" }
)";

class FootErrors : public Program {
 protected:
  void SetUp() override {
    write("ions.toml", wafer + ions);
    write("beam.toml", wafer + beam);
  }

  Outcome run(const std::string& recipe, const std::string& folder, const std::string& more = "") {
    Outcome outcome = scarp("run " + path(recipe) + " --quiet -o " + path(folder) + ' ' + more);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.messages;
    return outcome;
  }

  nlohmann::json measured(const std::string& folder) const {
    return json_of(scarp("measure " + path(folder) + " --json"));
  }

  /// The last row of metrology.csv.
  std::map<std::string, std::string> last_row(const std::string& folder) const {
    std::istringstream file(read_file(path(folder + "/metrology.csv")));
    std::string head;
    std::string last;
    std::getline(file, head);
    for (std::string line; std::getline(file, line);) last = line;
    std::istringstream names(head + ',');
    std::istringstream cells(last + ',');
    std::map<std::string, std::string> row;
    std::string cell;
    for (std::string name; std::getline(names, name, ',') && std::getline(cells, cell, ',');)
      row[name] = cell;
    return row;
  }
};

const std::string warning = "as the grid rounds the foot of a wall";

// Of two grids each is off by no more than it says.
TEST_F(FootErrors, AreNotSmallerThanWhatAFinerGridChanges) {
  EXPECT_THAT(run("ions.toml", "coarse").messages, HasSubstr(warning));
  run("ions.toml", "fine", "--set domain.spacing='\"10 nm\"'");
  const nlohmann::json coarse = measured("coarse");
  const nlohmann::json fine = measured("fine");
  const auto expect_bound = [](const nlohmann::json& a, const nlohmann::json& b,
                               const std::string& name, const std::string& error) {
    const double bound = a[error].get<double>() + b[error].get<double>();
    EXPECT_LE(std::abs(a[name].get<double>() - b[name].get<double>()), bound) << name;
    EXPECT_GT(a[error].get<double>(), b[error].get<double>()) << name;
    EXPECT_GT(b[error].get<double>(), 0) << name;
  };
  expect_bound(coarse, fine, "lowest_nm", "lowest_error_nm");
  const nlohmann::json& trench = coarse["openings"][0];
  const nlohmann::json& fine_trench = fine["openings"][0];
  expect_bound(trench, fine_trench, "depth_nm", "depth_error_nm");
  expect_bound(trench, fine_trench, "etched_depth_nm", "depth_error_nm");
  expect_bound(trench, fine_trench, "micro_trenching_nm", "micro_trenching_error_nm");

  // What a coarse grid loses of the micro-trench is most of it.
  EXPECT_GT(trench["micro_trenching_error_nm"], trench["micro_trenching_nm"]);

  const auto row = last_row("coarse");
  EXPECT_NEAR(std::stod(row.at("depth_error_nm")), trench["depth_error_nm"], 1e-4);
  EXPECT_NEAR(std::stod(row.at("micro_trenching_error_nm")), trench["micro_trenching_error_nm"],
              1e-4);
  EXPECT_NEAR(std::stod(row.at("lowest_error_nm")), coarse["lowest_error_nm"], 1e-4);
}

// Under a vertical beam alone feet are sharp.
TEST_F(FootErrors, AreEmptyWhereFeetAreSharp) {
  EXPECT_THAT(run("beam.toml", "out").messages, Not(HasSubstr(warning)));
  const nlohmann::json found = measured("out");
  EXPECT_NEAR(found["openings"][0]["depth_nm"], 400, 2);
  EXPECT_TRUE(found["openings"][0]["depth_error_nm"].is_null());
  EXPECT_TRUE(found["openings"][0]["micro_trenching_error_nm"].is_null());
  EXPECT_TRUE(found["lowest_error_nm"].is_null());
  EXPECT_EQ(last_row("out").at("depth_error_nm"), "");
  EXPECT_EQ(last_row("out").at("lowest_error_nm"), "");
}

TEST_F(FootErrors, StayWithTheWafer) {
  write("ions.toml", wafer + ions + "[output]\nevery = \"200 s\"\n");
  run("ions.toml", "ions");
  write("rinse.toml", "start = \"" + path("ions/state_0002.vdb") + "\"\n" +
                          wafer.substr(0, wafer.find("[[geometry]]")) + rinse);
  run("rinse.toml", "rinse");
  EXPECT_GT(measured("rinse")["openings"][0]["depth_error_nm"], 0);

  // Rows that are lost are measured again.
  const std::string before = read_file(path("ions/metrology.csv"));
  for (const char* name : {"metrology.csv", "summary.json", "state_0002.vdb"})
    std::filesystem::remove(path("ions/" + std::string(name)));
  run("ions.toml", "ions", "--resume");
  EXPECT_EQ(read_file(path("ions/metrology.csv")), before);
}

// On equal grids the error is the same; on others it is a difference that says nothing.
TEST_F(FootErrors, AreLeftOpenBetweenGrids) {
  run("ions.toml", "a");
  run("ions.toml", "b", "--set flux.seed=2");
  run("ions.toml", "c", "--set domain.spacing='\"10 nm\"'");
  const auto tolerance = [&](const std::string& other, const std::string& name) {
    const Outcome outcome = scarp("compare " + path("a") + ' ' + path(other) + " --json -o " +
                                  path("compare_" + other));
    const nlohmann::json found = json_of(outcome);
    for (const nlohmann::json& value : found["metrology"])
      if (value["name"] == name && value["time_s"] == 400) return value["tolerance"].get<double>();
    ADD_FAILURE() << name;
    return 0.0;
  };
  const nlohmann::json a = measured("a");
  const nlohmann::json c = measured("c");
  const double depth = a["openings"][0]["depth_nm"];
  EXPECT_NEAR(tolerance("b", "trench 1 depth_nm"), 0.25 * 20 + 0.01 * depth, 0.1);
  EXPECT_NEAR(tolerance("c", "trench 1 depth_nm"),
              a["openings"][0]["depth_error_nm"].get<double>() +
                  c["openings"][0]["depth_error_nm"].get<double>(),
              0.1);
  EXPECT_NEAR(tolerance("c", "lowest_nm"),
              a["lowest_error_nm"].get<double>() + c["lowest_error_nm"].get<double>(), 0.1);
}

}  // namespace
}  // namespace scarp
