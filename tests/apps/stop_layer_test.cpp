#include <gtest/gtest.h>

#include "program.h"

namespace scarp {
namespace {

/// Films that stop an etch, much thinner than a spacing.
class StopLayer : public Program {
 protected:
  struct Found {
    nlohmann::json before;
    nlohmann::json after;

    double kept(const std::string& material) const {
      return after["volumes_nm3"][material].get<double>() /
             before["volumes_nm3"][material].get<double>();
    }
  };

  Found run(const std::string& name, const std::string& more = "") const {
    std::filesystem::remove_all(folder_ / "run");
    const std::string recipe =
        std::string(SCARP_SOURCE_DIR) + "/tests/reference/films/" + name + ".toml";
    const Outcome outcome = scarp("run " + recipe + " --quiet " + more + " -o " + path("run"));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.messages;
    return {.before = json_of(scarp("measure " + path("run/state_0000.vdb") + " --json")),
            .after = json_of(scarp("measure " + path("run") + " --json"))};
  }
};

// A fifth of a spacing of nitride between oxides that are undercut.
TEST_F(StopLayer, HoldsUnderAnUndercut) {
  for (const std::string name : {"stop_undercut_2d", "stop_undercut_3d"}) {
    const Found found = run(name);
    EXPECT_NEAR(found.kept("Si3N4"), 1, 1e-4) << name;
    EXPECT_NEAR(found.after["lowest_nm"].get<double>(), 304, 0.05) << name;
  }
}

TEST_F(StopLayer, HoldsAroundAnAxis) {
  const Found found = run("stop_undercut_2d",
                          "--set 'domain.mode=\"axisymmetric\"' --set 'domain.extent=[\"1 um\"]' "
                          "--set 'geometry[2].opening={shape=\"hole\", radius=\"300 nm\"}'");
  EXPECT_NEAR(found.kept("Si3N4"), 1, 1e-4);
  EXPECT_NEAR(found.after["lowest_nm"].get<double>(), 304, 0.05);
}

// 2 nm of oxide at 5 nm spacing, over which a gate is etched: at the foot of its walls it was 1.42.
TEST_F(StopLayer, AGateOxideHoldsAtTheFootOfTheGate) {
  const Found found = run("stop_gate");
  EXPECT_NEAR(found.after["lowest_nm"].get<double>(), 2, 0.02 * 5);
  EXPECT_NEAR(found.kept("SiO2"), 1, 1e-3);
}

TEST_F(StopLayer, HoldsUnderIonsAndNeutrals) {
  for (const std::string thickness : {"2 nm", "0.3 nm"}) {
    const Found found = run("stop_ions", "--set 'geometry[1].thicknesses=[\"103 nm\", \"" +
                                             thickness + "\", \"100 nm\"]'");
    EXPECT_NEAR(found.kept("Si3N4"), 1, 0.01) << thickness;
  }
}

// Four films of 30 s with 7 nm at 2.2 nm/s after each, and 17.3 s of the fifth.
TEST_F(StopLayer, SlowFilmsHoldUpAnEtchByTheirRatesAtAnySpacing) {
  const double depth = 4 * 10 + 0.1 * (150 - 4 * (30 + 7 / 2.2));
  for (const std::string spacing : {"20 nm", "5 nm"}) {
    const Found found = run("six_films", "--set domain.spacing='\"" + spacing + "\"'");
    EXPECT_NEAR(60 - found.after["lowest_nm"].get<double>(), depth, 0.05) << spacing;
  }
}

}  // namespace
}  // namespace scarp
