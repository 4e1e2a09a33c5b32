// A crystal in a bath, through a mask.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "apps/simulator/simulator.h"
#include "tests/apps/final_state.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"
#include "tests/levelset/cross_sections.h"

namespace scarp {
namespace {

// A slot along <110> becomes a V-groove that ends itself: walls at 54.74 degrees, 0.707 times as
// deep as it is wide.
TEST(KohEtch, ASlotBecomesAVGroove) {
  const Recipe recipe = read_text(R"(
[domain]
mode = "2d"
spacing = "0.1 um"
extent = ["4 um"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "SiO2"
thickness = "0.5 um"
opening = { shape = "trench", width = "2.4 um" }
[[step]]
model = "koh_etch"
duration = "2.3 min"
etch_rate_111 = "0 um/min"
)");
  const State state = final_state(recipe);
  const std::vector<Polyline> silicon = cross_section(state.layers, 1, 0.0).front();
  double lowest = 0;
  for (const Polyline& line : silicon) {
    for (const auto& [x, z] : line.points) {
      lowest = std::min(lowest, z);
      // The walls stay under the edges of the opening; the tip is rounded by a spacing.
      if (z < -1500 || z > -100) continue;
      EXPECT_NEAR(std::abs(x), 1200 + z / std::sqrt(2.0), 60) << z;
    }
  }
  EXPECT_NEAR(lowest, -2400 * std::sqrt(0.5), 150);
}

/// Masks that KOH undercuts: tests/reference/koh.
class UndercutInKoh : public Program {
 protected:
  nlohmann::json openings(const std::string& name) const {
    const Outcome outcome = scarp("run " + std::string(SCARP_SOURCE_DIR) + "/tests/reference/koh/" +
                                  name + ".toml --quiet --threads 1 -o " + path("run"));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.messages;
    return json_of(scarp("measure " + path("run") + " --json"))["openings"];
  }

  /// The rate of {111} by the sine of their angle. Units: nm.
  static double undercut(double minutes) { return 7.3 * minutes / std::sqrt(2.0 / 3); }
};

constexpr double tenth_of_spacing = 10;  // nm

TEST_F(UndercutInKoh, OfASlotIsThatOfItsWalls) {
  const nlohmann::json slot = openings("slot2d")[0];
  EXPECT_NEAR(slot["undercut_nm"].get<double>(), undercut(2.3), tenth_of_spacing);
  const double middle = slot["depth_nm"].get<double>() / 2;
  EXPECT_NEAR(slot["middle_cd_nm"].get<double>(),
              4000 + 2 * (undercut(2.3) - middle * std::sqrt(0.5)), 2 * tenth_of_spacing);
}

// Below a round opening as well: an inverted pyramid, whose tip is up to a spacing blunt.
class SlowUndercutInKoh : public UndercutInKoh {};

TEST_F(SlowUndercutInKoh, OfARoundOpeningIsThatOfThePyramidAboutIt) {
  for (const nlohmann::json& section : openings("round")) {
    const double half = 2000 + undercut(5);
    EXPECT_NEAR(section["undercut_nm"].get<double>(), undercut(5), tenth_of_spacing);
    EXPECT_LT(section["depth_nm"].get<double>(), half * std::sqrt(2.0) + tenth_of_spacing);
    EXPECT_GT(section["depth_nm"].get<double>(), half * std::sqrt(2.0) - 100);
  }
}

}  // namespace
}  // namespace scarp
