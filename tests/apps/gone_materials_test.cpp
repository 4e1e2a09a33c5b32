#include <gtest/gtest.h>

#include "program.h"

namespace scarp {
namespace {

/// Materials of which nothing is left.
class GoneMaterials : public Program {
 protected:
  static std::string reference(const std::string& name) {
    return std::string(SCARP_SOURCE_DIR) + "/tests/reference/films/" + name + ".toml";
  }

  void run(const std::string& recipe, const std::string& more = "") const {
    std::filesystem::remove_all(folder_ / "run");
    const Outcome outcome = scarp("run " + recipe + " --quiet " + more + " -o " + path("run"));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
  }

  nlohmann::json measured(const std::string& state = "") const {
    return json_of(scarp("measure " + path("run") + state + " --json"));
  }

  void expect_none_negative() const {
    for (const auto& [material, volume] : measured()["volumes_nm3"].items()) {
      // That of the wafer counts from the plane z = 0.
      if (material == "Si") continue;
      EXPECT_GE(volume.get<double>(), 0) << material;
    }
  }
};

TEST_F(GoneMaterials, AStrippedMaskIsInNothing) {
  run(reference("stripped"));
  const nlohmann::json found = measured();
  EXPECT_FALSE(found["volumes_nm3"].contains("resist"));
  EXPECT_NEAR(found["openings"][0]["middle_cd_nm"].get<double>(), 100, 0.5);
  for (const auto& film : found["openings"][0]["films"]) EXPECT_NE(film["material"], "resist");
  expect_none_negative();
  const Outcome bodies = scarp("volume " + path("run") + " -o " + path("body.stl") + " --json");
  EXPECT_EQ(json_of(bodies)["bodies"].size(), 2U);
}

// A resist of 60 nm that is gone after 6 of 20 s.
TEST_F(GoneMaterials, AMaskIsInNothingWhileItsStripGoesOn) {
  write("strip.toml",
        "[domain]\nspacing = \"10 nm\"\nextent = [\"400 nm\"]\nmode = \"2d\"\n[output]\nevery = "
        "\"4 s\"\n[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n[[geometry]]\nshape = "
        "\"mask\"\nmaterial = \"resist\"\nthickness = \"60 nm\"\nopening = { shape = \"trench\", "
        "width = \"100 nm\" }\n[[step]]\nmodel = \"directional\"\nduration = \"4 s\"\n"
        "directional_etch_rate = { Si = \"10 nm/s\", default = \"0 nm/s\" }\n[[step]]\nmodel = "
        "\"isotropic\"\nduration = \"20 s\"\netch_rate = { resist = \"10 nm/s\", default = "
        "\"0 nm/s\" }\n");
  run(path("strip.toml"));
  const nlohmann::json there = measured("/state_0002.vdb");  // 4 s of it
  EXPECT_TRUE(there["volumes_nm3"].contains("resist"));
  EXPECT_NEAR(there["openings"][0]["mask_thickness_nm"], 20, 0.5);
  const nlohmann::json gone = measured("/state_0003.vdb");
  EXPECT_FALSE(gone["volumes_nm3"].contains("resist"));
  EXPECT_TRUE(gone["openings"][0]["mask_thickness_nm"].is_null());
  EXPECT_TRUE(gone["openings"][0]["undercut_nm"].is_null());
  EXPECT_EQ(read_file(path("run/profile_0003.svg")).find("resist"), std::string::npos);
}

TEST_F(GoneMaterials, TheNitrideOfTheIsolationIsInNothing) {
  run(std::string(SCARP_SOURCE_DIR) + "/configs/trench_isolation.toml");
  EXPECT_FALSE(measured()["volumes_nm3"].contains("Si3N4"));
  const Outcome bodies = scarp("volume " + path("run") + " -o " + path("body.stl") + " --json");
  for (const auto& body : json_of(bodies)["bodies"]) EXPECT_NE(body["material"], "Si3N4");
}

}  // namespace
}  // namespace scarp
