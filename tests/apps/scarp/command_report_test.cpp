#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "tests/apps/columns.h"
#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

class ReportCommand : public Program {
 protected:
  void run_trench(const std::string& folder, const std::string& more = "") const {
    const Outcome run = scarp("run " + small_trench("-o " + path(folder) + " " + more));
    ASSERT_EQ(run.exit_code, 0) << run.messages;
  }
};

TEST_F(ReportCommand, ARunWritesItAtItsEnd) {
  const Outcome run = scarp("run " + small_trench("-o " + path("out")));
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  const std::string page = read_file(path("out/report.html"));
  EXPECT_THAT(page, HasSubstr("<h1>LPCVD oxide"));
  // Again by itself, the same bytes.
  const Outcome again = scarp("report " + path("out") + " -o " + path("again.html"));
  EXPECT_EQ(again.exit_code, 0) << again.messages;
  EXPECT_EQ(again.out, path("again.html") + "\n");
  EXPECT_EQ(read_file(path("again.html")), page);
}

TEST_F(ReportCommand, ItsNumbersAreThoseOfTheFiles) {
  run_trench("out");
  const std::string page = read_file(path("out/report.html"));
  auto metrics = columns_of(path("out/metrics.csv"));
  const auto sum_of = [&](const std::string& column) {
    double sum = 0;
    for (const std::string& cell : metrics.at(column)) sum += std::stod(cell);
    return sum;
  };
  for (const std::string stage : {"surface", "simplify", "flux", "map", "advect"}) {
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), ">%s: %.3g s (", stage.c_str(),
                  sum_of("t_" + stage + "_s"));
    EXPECT_THAT(page, HasSubstr(text.data()));
  }
  EXPECT_THAT(page, HasSubstr("in " + std::to_string(metrics.at("step").size()) +
                              " time steps, 4 outputs"));
  auto metrology = columns_of(path("out/metrology.csv"));
  for (const std::string column :
       {"depth_nm", "middle_cd_nm", "SiO2_wall_nm", "SiO2_step_coverage"})
    EXPECT_THAT(page,
                HasSubstr("<td>" + column + "</td><td>" + metrology.at(column).back() + "</td>"));
  EXPECT_THAT(page, HasSubstr(summary("out")["state_hash"].get<std::string>()));
  EXPECT_THAT(page, HasSubstr("growth_rate"));  // the recipe
}

TEST_F(ReportCommand, TheViewerGetsTheSurfacesOfTheFiles) {
  run_trench("out");
  const nlohmann::json found = scene_description(read_file(path("out/report.html")));
  const nlohmann::json outputs = found["panes"][0]["outputs"];
  ASSERT_EQ(outputs.size(), 4U);
  EXPECT_EQ(outputs[0]["facets"],
            std::stoi(columns_of(path("out/metrics.csv")).at("facets").front()));
  EXPECT_EQ(outputs[0]["moment"], "start");
  EXPECT_EQ(outputs[1]["moment"], "in liner");
  EXPECT_EQ(outputs[3]["moment"], "after liner");
  EXPECT_EQ(outputs[3]["time_s"], 30);
  std::set<std::string> names;
  for (const nlohmann::json& field : found["fields"]) names.insert(field["name"]);
  EXPECT_EQ(names, (std::set<std::string>{"curvature_per_um", "facet_size_nm", "flux",
                                          "flux_std_error", "material", "speed_nm_s"}));
  EXPECT_EQ(found["materials"]["2"]["name"], "SiO2");
  EXPECT_EQ(outputs[0]["volume"]["materials"], (std::vector<int>{0}));  // no film yet
  EXPECT_EQ(outputs[3]["volume"]["materials"], (std::vector<int>{0, 2}));
}

TEST_F(ReportCommand, NeedsNoOtherFile) {
  run_trench("out");
  const std::string page = read_file(path("out/report.html"));
  for (const char* outside : {"src=\"http", "href=", "url(", "import(", "fetch(\"http", "@import"})
    EXPECT_THAT(page.substr(0, page.find("<script>")), Not(HasSubstr(outside)));
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,"));
  EXPECT_THAT(page, HasSubstr("data:image/svg+xml;base64,"));
}

TEST_F(ReportCommand, NamesOfTheRecipeAreText) {
  run_trench("out",
             "--set 'title=\"<script>alert(1)</script>\"' --set 'step[0].name=\"<img src=x>\"'");
  const std::string page = read_file(path("out/report.html"));
  EXPECT_THAT(page, HasSubstr("<h1>&lt;script&gt;alert(1)"));
  EXPECT_THAT(page, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(page, Not(HasSubstr("<img src=x>")));
}

TEST_F(ReportCommand, AFlatRecipeHasItsSections) {
  run_trench("out",
             "--set 'domain.mode=\"2d\"' --set 'domain.extent=[\"10 um\"]' --set "
             "'domain.boundary=[\"reflective\"]'");
  const std::string page = read_file(path("out/report.html"));
  EXPECT_THAT(page, HasSubstr("has no depth"));
  EXPECT_THAT(page, HasSubstr("data:image/svg+xml;base64,"));
  EXPECT_THAT(page, Not(HasSubstr("class=\"scene\"")));
}

TEST_F(ReportCommand, WhatARunLeftUnfinishedIsShown) {
  run_trench("out");
  for (const char* name : {"summary.json", "report.html", "state_0003.vdb", "surface_0003.vtp"})
    fs::remove(path("out") + "/" + name);
  const Outcome outcome = scarp("report " + path("out"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.messages;
  EXPECT_THAT(read_file(path("out/report.html")), HasSubstr("This run is not complete"));
}

TEST_F(ReportCommand, ASummaryThatIsDamagedIsNamedWithTheRemedy) {
  run_trench("out");
  nlohmann::json changed = summary("out");
  changed["steps"] = 7;
  write("out/summary.json", changed.dump());
  const Outcome outcome = scarp("report " + path("out"));
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.messages, HasSubstr("out/summary.json: is damaged: "));
  EXPECT_THAT(outcome.messages, HasSubstr("scarp run --resume writes it again"));
  EXPECT_THAT(outcome.messages, Not(HasSubstr("json.exception")));
}

TEST_F(ReportCommand, SaysWhatIsNoRun) {
  const Outcome empty = scarp("report " + path(""));
  EXPECT_EQ(empty.exit_code, 2);
  EXPECT_THAT(empty.messages, HasSubstr("make one with scarp run"));
  const Outcome missing = scarp("report " + path("nowhere"));
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.messages, HasSubstr("nowhere"));
}

TEST_F(ReportCommand, AnOldPageStaysWhenANewOneCannotBeMade) {
  run_trench("out");
  write("out/report.html", "old");
  write("out/surface_0002.vtp", "damaged");
  const Outcome outcome = scarp("report " + path("out"));
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.messages, HasSubstr("surface_0002.vtp"));
  EXPECT_EQ(read_file(path("out/report.html")), "old");
  for (const std::string& name : files("out")) EXPECT_THAT(name, Not(HasSubstr(".tmp-")));
}

TEST_F(ReportCommand, FiftyOutputsTakeLessThan15MB) {
  run_trench("out", "--set 'domain.spacing=\"0.2 um\"' --set 'output.every=\"0.6 s\"'");
  EXPECT_EQ(summary("out")["outputs"], 51);
  const auto bytes = fs::file_size(path("out/report.html"));
  EXPECT_LT(bytes, 15e6);
  EXPECT_THAT(read_file(path("out/report.html")), Not(HasSubstr("evenly chosen")));
}

}  // namespace
}  // namespace scarp
