// Recipes in mode = "axisymmetric": a section from the axis on, with what goes around it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "tests/apps/columns.h"
#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;

constexpr double pi = std::numbers::pi;

constexpr const char* round_domain = R"(
[domain]
spacing = "20 nm"
mode = "axisymmetric"
extent = ["600 nm"]
)";

constexpr const char* round_hole = R"(
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "hole"
radius = "150 nm"
depth = "600 nm"
)";

constexpr const char* conformal_film = R"(
[[step]]
model = "conformal"
material = "SiO2"
thickness = "60 nm"
)";

constexpr const char* slow_deposition = R"(
[[step]]
model = "single_particle"
material = "SiO2"
sticking = 0.1
growth_rate = "2 nm/s"
duration = "40 s"
)";

class AxisymmetricTest : public Program {
 protected:
  void write_recipe(const std::string& name, const std::string& text) const { write(name, text); }

  double last(const std::string& file, const std::string& column) const {
    return std::stod(columns_of(path(file)).at(column).back());
  }
  double first(const std::string& file, const std::string& column) const {
    return std::stod(columns_of(path(file)).at(column).front());
  }
};

// A film of prescribed thickness in a cylinder.
TEST_F(AxisymmetricTest, VolumesAndAreasAreThoseOfWhatGoesAround) {
  write_recipe("hole.toml", std::string(round_domain) + round_hole + conformal_film);
  const Outcome run = scarp("run " + path("hole.toml") + " -o " + path("out"));
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  const double before = pi * 150 * 150 * 600;
  EXPECT_NEAR(first("out/metrology.csv", "Si_volume_nm3"), -before, 2e-3 * before);
  const double field = pi * (300 * 300 - 150 * 150) * 60;
  const double wall = pi * (150 * 150 - 90 * 90) * 600;
  const double floor = pi * 90 * 90 * 60;
  const double mouth =
      2 * pi * (150 - 4 * 60 / (3 * pi)) * pi * 60 * 60 / 4;  // a quarter of a torus
  const double expected = field + wall + floor + mouth;
  EXPECT_NEAR(last("out/metrology.csv", "SiO2_volume_nm3"), expected, 2e-3 * expected);
  EXPECT_NEAR(last("out/metrology.csv", "middle_cd_nm"), 180, 1);
  EXPECT_EQ(columns_of(path("out/metrology.csv")).at("kind").back(), "hole");
}

// Within 1 % and a tenth of a cell.
TEST_F(AxisymmetricTest, AHoleIsAsInThreeDimensions) {
  write_recipe("hole.toml", std::string(round_domain) + round_hole + slow_deposition);
  const Outcome outcome = scarp("compare " + path("hole.toml") +
                                " --modes 3d,axisymmetric --seeds 2 --json -o " + path("out"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
  const nlohmann::json found = json_of(outcome);
  EXPECT_EQ(found["second"], "axisymmetric");
  for (const char* way : {"forward", "reverse"}) {
    EXPECT_GT(found["distance"].back()[way]["mean"], 0) << way;
    EXPECT_LT(found["distance"].back()[way]["mean"], 0.05) << way;
  }
  int compared = 0;
  for (const nlohmann::json& each : found["metrology"]) {
    const std::string name = each["name"];
    if (!name.ends_with("cd_nm") && !name.ends_with("depth_nm")) continue;
    const double mean = each["first"]["mean"];
    if (name.ends_with("bow_depth_nm") || name.ends_with("neck_depth_nm")) continue;
    EXPECT_NEAR(each["difference"], 0, 0.01 * std::abs(mean) + 0.1 * 20) << name;
    ++compared;
  }
  EXPECT_GT(compared, 10);
  ASSERT_FALSE(found["flux"].empty());
  EXPECT_LT(found["flux"].back()["rms_difference"], 0.05);
}

// Grooves along the foot of the wall leave a ridge of a tenth of the depth.
TEST_F(AxisymmetricTest, AHoleUnderIonsIsAsDeepAsInThreeDimensions) {
  const std::string recipe = std::string(SCARP_SOURCE_DIR) + "/configs/sf6_o2_hole.toml";
  const Outcome outcome =
      scarp("compare " + recipe + " --modes 3d,axisymmetric --seeds 2 --json -o " + path("out") +
            " --set 'step[0].duration=\"15 s\"'");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
  const nlohmann::json found = json_of(outcome);
  int compared = 0;
  for (const nlohmann::json& each : found["metrology"]) {
    const std::string name = each["name"];
    if (each["time_s"] == 0 || !(name.ends_with(" depth_nm") || name.ends_with("cd_nm"))) continue;
    const double mean = each["first"]["mean"];
    EXPECT_NEAR(each["difference"], 0, 0.01 * mean + 0.1 * 30) << name;
    ++compared;
  }
  EXPECT_EQ(compared, 10);
}

// The film's body is a square with the circle of the metrology in it, and flat in the corners.
TEST_F(AxisymmetricTest, IsRevolvedWhereItIsSeenInSpace) {
  write_recipe("hole.toml", std::string(round_domain) + round_hole + conformal_film);
  const Outcome run = scarp("run " + path("hole.toml") + " -o " + path("run") + " --quiet");
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  const Outcome volume = scarp("volume " + path("run") + " --json -o " + path("wafer.stl"));
  ASSERT_EQ(volume.exit_code, 0) << volume.messages;
  const double corners = (600 * 600 - pi * 300 * 300) * 60;
  const double film = last("run/metrology.csv", "SiO2_volume_nm3") + corners;
  EXPECT_NEAR(json_of(volume)["bodies"][1]["volume_nm3"], film, 0.005 * film);

  EXPECT_EQ(
      scarp("render " + path("run") + " --cut 'x = 100 nm' -o " + path("wafer.png")).exit_code, 0);
  ASSERT_EQ(scarp("report " + path("run")).exit_code, 0);
  EXPECT_TRUE(read_file(path("run/report.html")).find("cut open at y = 0") != std::string::npos);
}

// In three dimensions what is left around a pillar is no opening, either.
TEST_F(AxisymmetricTest, AroundAPillarThereIsNoOpening) {
  write_recipe("pillar.toml", std::string(round_domain) + R"(
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "resist"
thickness = "100 nm"
resist = { shape = "hole", radius = "100 nm" }
)" + conformal_film);
  const Outcome run = scarp("run " + path("pillar.toml") + " -o " + path("out"));
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  const auto metrology = columns_of(path("out/metrology.csv"));
  for (const std::string& kind : metrology.at("kind")) EXPECT_EQ(kind, "");
  const double pillar = pi * 100 * 100 * 100;
  EXPECT_NEAR(first("out/metrology.csv", "resist_volume_nm3"), pillar, 5e-3 * pillar);
}

// An etch under a mask, and a film that closes its opening: a void on the axis, as in three
// dimensions.
TEST_F(AxisymmetricTest, AVoidOnTheAxisIsOne) {
  const auto void_volume = [&](const std::string& name, const std::string& domain) {
    write_recipe(name + ".toml", "[domain]\nspacing = \"10 nm\"\n" + domain + R"(
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "resist"
thickness = "60 nm"
opening = { shape = "hole", radius = "45 nm" }
[[step]]
name = "etch"
model = "isotropic"
duration = "70 s"
etch_rate = { Si = "2 nm/s", resist = "0 nm/s" }
[[step]]
name = "film"
model = "isotropic"
duration = "30 s"
material = "SiO2"
growth_rate = "2 nm/s"
)");
    const Outcome run = scarp("run " + path(name + ".toml") + " -o " + path(name));
    EXPECT_EQ(run.exit_code, 0) << run.messages;
    EXPECT_EQ(last(name + "/metrics.csv", "voids"), 1) << name;
    return last(name + "/metrics.csv", "void_volume_nm3");
  };
  const double round = void_volume("round", "mode = \"axisymmetric\"\nextent = [\"600 nm\"]");
  const double solid = void_volume("solid", "extent = [\"600 nm\", \"600 nm\"]");
  // The film closes the opening within a spacing of where it should, over all of the surface.
  EXPECT_GT(solid, 1e6);
  EXPECT_NEAR(round, solid, 0.3 * solid);
}

TEST_F(AxisymmetricTest, SameBitsForAnyNumberOfThreadsAndAfterAnInterruption) {
  write_recipe("hole.toml", std::string(round_domain) + round_hole + slow_deposition +
                                "[output]\nevery = \"10 s\"\n");
  std::vector<std::string> hashes;
  for (const int threads : {1, 2, 8}) {
    const std::string folder = path("out" + std::to_string(threads));
    const Outcome run = scarp("run " + path("hole.toml") + " --json -o " + folder + " --threads " +
                              std::to_string(threads));
    ASSERT_EQ(run.exit_code, 0) << run.messages;
    hashes.push_back(json_of(run)["state_hash"]);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
  // As a run that ended after its second output would have left it.
  std::filesystem::remove(path("out1/state_0004.vdb"));
  std::filesystem::remove(path("out1/state_0003.vdb"));
  std::filesystem::remove(path("out1/summary.json"));
  const Outcome resumed = scarp("run " + path("hole.toml") + " --resume --json -o " + path("out1"));
  ASSERT_EQ(resumed.exit_code, 0) << resumed.messages;
  EXPECT_EQ(json_of(resumed)["state_hash"], hashes[0]);
}

TEST_F(AxisymmetricTest, RefusesWhatIsNotTheSameAllAround) {
  const auto refused = [&](const std::string& text, const std::string& message) {
    write_recipe("recipe.toml", text);
    const Outcome outcome = scarp("check " + path("recipe.toml"));
    EXPECT_EQ(outcome.exit_code, 2) << message;
    EXPECT_THAT(outcome.messages, HasSubstr(message));
  };
  const std::string wafer = R"(
[[geometry]]
shape = "wafer"
material = "Si"
)";
  const std::string trench = wafer + R"(
[[geometry]]
shape = "trench"
width = "200 nm"
depth = "200 nm"
)";
  const std::string aside = wafer + R"(
[[geometry]]
shape = "hole"
radius = "100 nm"
depth = "200 nm"
center = ["40 nm", "0 nm"]
)";
  const std::string tilted = R"(
[[step]]
model = "directional"
duration = "10 s"
directional_etch_rate = "1 nm/s"
[[step.beam]]
tilt = "10 deg"
[[step.beam]]
tilt = "10 deg"
azimuth = "180 deg"
)";
  const std::string crystal = "[[step]]\nmodel = \"koh_etch\"\nduration = \"1 s\"\n";
  refused(
      "[domain]\nspacing = \"10 nm\"\nmode = \"axisymmetric\"\nextent = [\"1 um\", \"1 um\"]\n" +
          wafer,
      "extent: has 2 entries; 1 is wanted with mode = \"axisymmetric\"");
  refused(round_domain + trench + conformal_film,
          "not the same all around the axis; use a round shape");
  for (const char* outline : {"shape = \"rectangle\", size = [\"200 nm\", \"200 nm\"]",
                              "points = [[\"0 nm\", \"0 nm\"], [\"200 nm\", \"0 nm\"], "
                              "[\"0 nm\", \"200 nm\"]], shape = \"polygon\""})
    refused(round_domain + wafer + "[[geometry]]\nshape = \"mask\"\nmaterial = \"resist\"\n" +
                "thickness = \"100 nm\"\nopening = { " + outline + " }\n" + conformal_film,
            "opening.shape: is not the same all around the axis; use a round shape");
  refused(round_domain + aside + conformal_film, "center: must be on the axis");
  refused(round_domain + wafer + crystal, "crystal planes are not the same all around an axis");
  std::string unshadowed = tilted;
  unshadowed.insert(unshadowed.find("[[step.beam]]"), "visibility = false\n");
  for (const std::string& beams : {tilted, unshadowed})
    refused(round_domain + wafer + beams, "what is tilted is not the same all around an axis");
  refused("[domain]\nspacing = \"20 nm\"\nmode = \"axisymmetric\"\nextent = [\"620 nm\"]\n" +
              wafer + conformal_film,
          "it has to be an even number of them");
  refused(std::string(round_domain) + "boundary = [\"periodic\"]\n" + wafer + conformal_film,
          "what goes around an axis has one side");
}

}  // namespace
}  // namespace scarp
