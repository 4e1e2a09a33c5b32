// A neutral in deep features whose walls give back all of it.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "apps/simulator/simulator.h"
#include "apps/simulator/surface_speeds.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

constexpr double flux = 1000;      // J, in 1e15 /cm2/s
constexpr double s_silicon = 0.1;  // s of silicon
constexpr double density = 5.02;

/// A trench through oxide on silicon, 40 spacings wide: the foot of each wall, up to a spacing
/// high, counts as silicon.
std::string trench(int aspect, const std::string& keys) {
  return R"(
[domain]
mode = "2d"
spacing = "2.5 nm"
extent = ["200 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "SiO2"
thickness = ")" +
         std::to_string(100 * aspect) + R"( nm"
opening = { shape = "trench", width = "100 nm" }
[flux]
target_error = 0.003
[[step]]
model = "langmuir_transport"
duration = "1 s"
flux = "1e18 /cm2/s"
sticking = { Si = 0.1, SiO2 = 0.5 }
)" + keys;
}

struct Bottom {
  double flux = 0;
  double speed = 0;
  double coverage = 0;
  double etched = 0;    // sum of speed times area
  double absorbed = 0;  // sum of flux times sticking times area
};

/// Means over the silicon.
Bottom bottom_of(const std::string& text) {
  const Recipe recipe = read_text(text);
  const State state = start_state(recipe.domain.frame, recipe.start);
  const Survey now = survey(state, recipe);
  EXPECT_TRUE(now.coverage_fit.reached);
  const std::vector<float> speeds = facet_speeds(state, now);
  const std::vector<double> areas = facet_areas(now.facets);
  const MaterialId silicon = recipe.materials.id("Si");
  Bottom sum;
  double area = 0;
  for (std::size_t f = 0; f < areas.size(); ++f) {
    if (now.facets.materials[f] != silicon) {
      EXPECT_EQ(speeds[f], 0);
      continue;
    }
    area += areas[f];
    sum.flux += areas[f] * now.flux[0].arrivals().mean[f];
    sum.speed -= areas[f] * speeds[f];
    sum.coverage += areas[f] * now.coverages[0][f];
  }
  sum.etched = sum.speed * density;
  // What the audit counts is relative to the flux of the source, in squared spacings.
  const FluxAudit& audit = now.flux[0].audit;
  sum.absorbed = flux * audit.absorbed / audit.emitted * 200 * 2.5;
  return {sum.flux / area, sum.speed / area, sum.coverage / area, sum.etched, sum.absorbed};
}

/// The flux at a bottom that takes up the part S of what arrives, below a slot with the
/// transmission probability K.
double below(double transmission, double taken) {
  return transmission / (transmission + taken - transmission * taken);
}

// Where little is covered the bottom takes up s of what arrives: K / (K + s - K s), which is within
// 0.2 % of the exact solution (0.75998 at A = 10).
TEST(LangmuirTransportRun, FollowsTheTransmissionOfTheSlot) {
  for (const auto& [aspect, transmission] : {std::pair{1, 0.68438}, {5, 0.35641}, {10, 0.24056}}) {
    const Bottom found =
        bottom_of(trench(aspect, "reaction = { Si = \"1e22 /cm2/s\", SiO2 = \"0 /cm2/s\" }\n"));
    const double expected = below(transmission, s_silicon);
    EXPECT_NEAR(found.flux, expected, 0.012 * expected) << aspect;
    EXPECT_NEAR(found.speed, s_silicon * flux * expected / density,
                0.012 * s_silicon * flux * expected / density);
  }
}

// With coverage and desorption: what the bottom takes up depends on what arrives there.
TEST(LangmuirTransportRun, FollowsTheBalanceAtTheBottom) {
  constexpr double desorption = 30;
  constexpr double reaction = 50;
  double arrives = 1;
  double theta = 0;
  for (int n = 0; n < 100; ++n) {
    theta = s_silicon * flux * arrives / (s_silicon * flux * arrives + desorption + reaction);
    arrives = below(0.35641, s_silicon * (1 - theta) * reaction / (desorption + reaction));
  }
  EXPECT_GT(theta, 0.4);
  const Bottom found =
      bottom_of(trench(5,
                       "reaction = { Si = \"5e16 /cm2/s\", SiO2 = \"0 /cm2/s\" }\n"
                       "desorption = { Si = \"3e16 /cm2/s\", SiO2 = \"1e17 /cm2/s\" }\n"));
  EXPECT_NEAR(found.flux, arrives, 0.012 * arrives);
  EXPECT_NEAR(found.coverage, theta, 0.012 * theta);
  EXPECT_NEAR(found.speed, reaction * theta / density, 0.012 * reaction * theta / density);
}

// What stays on the surface is what has reacted.
TEST(LangmuirTransportRun, CountsEveryParticleOnce) {
  const Bottom found =
      bottom_of(trench(2,
                       "reaction = { Si = \"5e16 /cm2/s\", SiO2 = \"0 /cm2/s\" }\n"
                       "desorption = { Si = \"3e16 /cm2/s\", SiO2 = \"1e17 /cm2/s\" }\n"));
  EXPECT_NEAR(found.etched, found.absorbed, 1e-3 * found.absorbed);
}

}  // namespace
}  // namespace scarp
