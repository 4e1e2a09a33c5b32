// docs/results.md against the program: every file, column, key and array that a run writes stands
// there, and no other.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>

#include "apps/report/report.h"
#include "apps/run/own_files.h"
#include "apps/run/run.h"
#include "apps/simulator/recipe.h"
#include "core/system/temporary_folder.h"
#include "tests/apps/reference_page.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;

// The film closes the mouth of a re-entrant trench over a void; then particles are traced.
constexpr const char* recipe_with_void = R"(
[domain]
mode = "2d"
spacing = "10 nm"
extent = ["400 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "trench"
width = "100 nm"
depth = "200 nm"
taper = "-10 deg"
center = "-90 nm"
[[geometry]]
shape = "trench"
width = "160 nm"
depth = "200 nm"
center = "100 nm"
[[step]]
model = "conformal"
thickness = "60 nm"
material = "SiO2"
[[step]]
name = "films"
repeat = 1
until = { thickness = "1 um" }
[[step.step]]
model = "single_particle"
duration = "1 s"
growth_rate = "5 nm/s"
sticking = 1
material = "SiO2"
[flux]
target_error = 0.1
[metrology]
cd_at = ["-50 nm"]
angle_at = ["-60 nm"]
[output]
sections = ["y = 0 nm"]
)";

class ResultsReference : public ::testing::Test {
 protected:
  void SetUp() override {
    const fs::path file = folder_ / "void.toml";
    std::ofstream(file) << recipe_with_void;
    run(read_recipe(recipe_in(file)), results(), {});
  }

  fs::path results() const { return folder_ / "results"; }

  std::set<std::string> described(const std::string& heading) const {
    return keys_of(page_.at(heading));
  }

  /// The names in the first line of a table.
  std::set<std::string> columns(const std::string& name) const {
    std::ifstream in(results() / name);
    std::string head;
    std::getline(in, head);
    std::istringstream cells(head);
    std::set<std::string> names;
    for (std::string cell; std::getline(cells, cell, ',');) names.insert(cell);
    return names;
  }

 private:
  TemporaryFolder folder_;
  Keys page_ = reference_page("results.md");
};

/// "a.b" for objects within objects, "a[].b" for objects in lists.
void add_keys(const nlohmann::json& object, const std::string& path, std::set<std::string>& keys) {
  for (const auto& [key, value] : object.items()) {
    const std::string name = path + (path == "materials." ? "NAME" : key);
    if (value.is_object()) {
      add_keys(value, name + '.', keys);
    } else if (value.is_array() && value.at(0).is_object()) {
      add_keys(value.at(0), name + "[].", keys);
    } else {
      keys.insert(name);
    }
  }
}

TEST_F(ResultsReference, HasTheFilesOfAFolder) {
  std::set<std::string> files{"state_interrupted.vdb", report_file};
  for (const auto& entry : fs::directory_iterator(results())) {
    std::string name = entry.path().filename().string();
    for (char& c : name) {
      if (std::isdigit(static_cast<unsigned char>(c)) != 0) c = 'N';
    }
    if (name.rfind("section_N", 0) == 0) name.replace(0, 9, "section_K");
    files.insert(name);
  }
  EXPECT_EQ(described("Files"), files);
}

TEST_F(ResultsReference, HasTheColumnsOfTables) {
  std::set<std::string> described_columns = described("metrics.csv");
  for (const char* name : {"covered_NAME_nm2", "carried_NAME_nm2", "simplify_left_out"})
    EXPECT_EQ(described_columns.erase(name), 1U);
  EXPECT_EQ(described_columns, columns("metrics.csv"));
  EXPECT_EQ(described("profile_NNNN.csv"), columns("profile_0000.csv"));
}

TEST_F(ResultsReference, HasTheKeysOfTheSummary) {
  std::set<std::string> keys;
  nlohmann::json summary = nlohmann::json::parse(read_file(results() / "summary.json"));
  summary["metrology"] = true;  // below
  add_keys(summary, "", keys);
  EXPECT_EQ(described("summary.json"), keys);
}

// docs/metrology.md: what is described in some sections, or in all.
std::set<std::string> described_metrology(const std::string& wanted = "") {
  std::set<std::string> names;
  for (const auto& [heading, keys] : reference_page("metrology.md"))
    if (wanted.empty() || heading == wanted) names.merge(keys_of(keys));
  return names;
}

TEST_F(ResultsReference, HasTheColumnsOfMetrology) {
  std::set<std::string> names{"area_nm2", "height_nm", "volume_nm3"};  // of each void, in JSON
  for (std::string name : columns("metrology.csv")) {
    for (const std::string material : {"Si_", "SiO2_"})
      if (name.rfind(material, 0) == 0) name = "NAME_" + name.substr(material.size());
    for (const std::string height : {"-50", "-60"})
      if (const auto at = name.find("at_" + height + '_'); at != std::string::npos)
        name.replace(at + 3, height.size(), "Z");
    names.insert(name);
  }
  EXPECT_EQ(described_metrology(), names);
}

TEST_F(ResultsReference, HasTheMembersOfMetrology) {
  const nlohmann::json found =
      nlohmann::json::parse(read_file(results() / "summary.json")).at("metrology");
  std::set<std::string> names = described_metrology();
  for (const auto& [name, value] : found.at("openings").at(0).items()) {
    if (name == "place" || name == "films" || name == "cd_at" || name == "angle_at") continue;
    EXPECT_TRUE(names.contains(name)) << name;
  }
  for (const auto& [name, value] : found.at("openings").at(0).at("films").at(0).items())
    EXPECT_TRUE(name == "material" || names.contains("NAME_" + name)) << name;
  std::set<std::string> of_void{"x_nm", "y_nm"};
  of_void.merge(described_metrology("Voids"));
  std::set<std::string> members;
  for (const auto& [name, value] : found.at("voids").at(0).items()) members.insert(name);
  EXPECT_EQ(members, of_void);
}

std::set<std::string> arrays_of(const fs::path& surface) {
  const std::string text = read_file(surface);
  const std::string mark = " Name=\"";
  std::set<std::string> arrays;
  for (std::size_t at = 0; (at = text.find(mark, at)) != std::string::npos;) {
    at += mark.size();
    arrays.insert(text.substr(at, text.find('"', at) - at));
  }
  // Those of the format itself.
  for (const char* name : {"points", "connectivity", "offsets"}) EXPECT_EQ(arrays.erase(name), 1U);
  return arrays;
}

// What an ion adds, whose yield has the name NAME.
constexpr const char* recipe_with_ion = R"(
[domain]
mode = "2d"
spacing = "10 nm"
extent = ["400 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[step]]
model = "multi_particle"
duration = "1 s"
rate = "-1 nm/s * NAME"
[[step.ion]]
name = "ion"
[[step.ion.yield]]
name = "NAME"
amplitude = 1
[flux]
rays = 1000
)";

TEST_F(ResultsReference, HasTheArraysOfSurfaces) {
  const fs::path file = results() / "ion.toml";
  std::ofstream(file) << recipe_with_ion;
  run(read_recipe(recipe_in(file)), results() / "ion", {});
  const std::set<std::string> arrays = arrays_of(results() / "ion" / "surface_0001.vtp");
  std::set<std::string> described_arrays = described("surface_NNNN.vtp");
  for (const char* name : {"coverage_NAME", "concentration_NAME"})
    EXPECT_EQ(described_arrays.erase(name), 1U);
  EXPECT_EQ(described_arrays, arrays);

  std::set<std::string> without_ions = arrays;
  EXPECT_EQ(without_ions.erase("yield_NAME"), 1U);
  EXPECT_EQ(without_ions.erase("yield_std_error_NAME"), 1U);
  EXPECT_EQ(arrays_of(results() / "surface_0001.vtp"), without_ions);
}

TEST_F(ResultsReference, HasTheArraysOfCoverages) {
  const fs::path file = results() / "covered.toml";
  std::string text = recipe_with_ion;
  text.replace(text.find("[[step]]"), std::string::npos,
               "[flux]\nrays = 1000\n[[step]]\nmodel = \"sf6_o2\"\nduration = \"0.1 s\"\n");
  std::ofstream(file) << text;
  run(read_recipe(recipe_in(file)), results() / "covered", {});
  const std::set<std::string> arrays = arrays_of(results() / "covered" / "surface_0001.vtp");
  for (const char* name : {"coverage_F", "coverage_O"}) EXPECT_TRUE(arrays.contains(name)) << name;
  const std::set<std::string> names = columns("covered/metrics.csv");
  for (const char* name : {"covered_F_nm2", "carried_F_nm2", "covered_O_nm2", "carried_O_nm2"})
    EXPECT_TRUE(names.contains(name)) << name;
}

TEST_F(ResultsReference, HasTheArrayOfASolute) {
  const fs::path file = results() / "bath.toml";
  std::string text = recipe_with_ion;
  text.replace(text.find("[[step]]"), std::string::npos,
               "[[step]]\nmodel = \"oxide_regrowth\"\nduration = \"0.1 s\"\nmaterial = \"SiO2\"\n"
               "settling_rate = \"1 nm/s\"\nsettles_on = [\"Si\"]\n");
  std::ofstream(file) << text;
  run(read_recipe(recipe_in(file)), results() / "bath", {});
  const std::set<std::string> arrays = arrays_of(results() / "bath" / "surface_0001.vtp");
  EXPECT_TRUE(arrays.contains("concentration_silica"));
  EXPECT_FALSE(arrays.contains("flux"));
}

}  // namespace
}  // namespace scarp
