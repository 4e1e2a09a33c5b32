#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

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

// Beyond the wall phi is the distance to the other surface of the spacer: the wall was off by half
// a spacing wherever it lay between nodes, and the spacers gained a seventh of their area.
TEST_F(StopLayer, SpacersKeepTheirWallsWhereTheMandrelIsEtchedAway) {
  constexpr double spacing = 5;
  constexpr double exact = 2 * (15 * 40 + std::numbers::pi * 15 * 15 / 4);
  constexpr double blunt = 2 * 0.6 * spacing * spacing;  // at the top of either spacer
  const auto check = [&](const std::string& what, const std::string& more, double width) {
    const nlohmann::json found = run("pulled_mandrel", more).after;
    const nlohmann::json& volumes = found["volumes_nm3"];
    EXPECT_NEAR(volumes["W"].get<double>() / width, exact, 0.01 * exact + blunt) << what;
    EXPECT_LT(volumes.value("Si3N4", 0.0) / width, 0.5) << what;
    double open = 0;
    for (const nlohmann::json& opening : found["openings"])
      open += opening["cd_at"][0]["cd_nm"].get<double>();
    EXPECT_NEAR(open, 320 - 2 * 15, 0.1 * spacing) << what;
  };
  for (const std::string center : {"0", "0.3", "1.2", "2.5", "3.7"}) {
    const std::string at = "--set 'geometry[2].center=\"" + center + " nm\"' ";
    check(center, at, spacing);
    check("isotropic " + center,
          at + "--set 'step[2]={model=\"isotropic\", duration=\"120 s\", "
               "etch_rate={Si3N4=\"1 nm/s\", default=\"0 nm/s\"}}'",
          spacing);
  }
  check("3D",
        "--set 'domain.mode=\"3d\"' --set 'domain.extent=[\"320 nm\", \"20 nm\"]' "
        "--set 'domain.boundary=[\"periodic\", \"reflective\"]'",
        20);
}

// What lies in the shadow of the spacers is a wedge, 3 to 8 nm thick at its foot.
TEST_F(StopLayer, SpacersThatLeanKeepTheirWallsAndTheWedgeInTheirShadow) {
  for (const double taper : {3.0, 5.0, 8.0}) {
    for (const std::string center : {"1.2", "2.5", "3.7"}) {
      const Found found =
          run("pulled_mandrel", "--set 'geometry[2].taper=\"" + std::to_string(taper) +
                                    " deg\"' --set 'geometry[2].center=\"" + center + " nm\"'");
      const double lean = std::tan(taper * std::numbers::pi / 180);
      const nlohmann::json spacers =
          json_of(scarp("measure " + path("run/state_0002.vdb") + " --json"))["volumes_nm3"];
      const nlohmann::json& left = found.after["volumes_nm3"];
      const double before = spacers["W"].get<double>();
      const double edges = 2 * 0.25 * 5 * 5 * 5;
      EXPECT_NEAR(left["W"].get<double>(), before, 0.01 * before + edges) << taper << " " << center;
      const double tip = 0.6 * 5 / lean;  // what is thinner than the grid holds
      const double wedges = 55 * 55 * lean;
      EXPECT_NEAR(left.value("Si3N4", 0.0) / 5, wedges, 0.6 * 5 * tip) << taper << " " << center;
    }
  }
}

TEST_F(StopLayer, RingsKeepTheirWallsWhereTheMandrelIsEtchedAway) {
  for (const double radius : {50.0, 52.5, 53.7}) {
    const nlohmann::json found =
        run("pulled_mandrel",
            "--set 'domain.mode=\"axisymmetric\"' --set 'domain.extent=[\"240 nm\"]' --set "
            "'domain.boundary=[\"reflective\"]' --set 'geometry[2]={shape=\"hole\", radius=\"" +
                std::to_string(radius) + " nm\", depth=\"60 nm\"}'")
            .after;
    // A film around a rounded edge, 40 nm of it upright: by Pappus, from the mandrel's wall
    // inwards.
    constexpr double pi = std::numbers::pi;
    const double upright = pi * (radius * radius - (radius - 15) * (radius - 15)) * 40;
    const double quarter = 2 * pi * (radius - 4 * 15 / (3 * pi)) * (pi * 15 * 15 / 4);
    const double exact = upright + quarter;
    const double blunt = 2 * pi * radius * 0.6 * 25;
    EXPECT_NEAR(found["volumes_nm3"]["W"].get<double>(), exact, 0.01 * exact + blunt) << radius;
    EXPECT_LT(found["volumes_nm3"].value("Si3N4", 0.0), 1e-4 * exact) << radius;
  }
}

}  // namespace
}  // namespace scarp
