// Cycles of atomic layer deposition at points where all fluxes are known.

#include "models/catalogue/ald.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "tests/models/model_fixture.h"

namespace scarp {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

const std::string film = "material = \"Al2O3\"\ngrowth_per_cycle = \"0.112 nm\"\ncycles = 800\n";

/// One point of silicon that is covered in part, under fluxes that stay as they are.
struct AldPoint {
  StepModel step;
  Points point{{"Si"}};

  explicit AldPoint(const std::string& keys) : step(read_step("ald", film + keys)) {}

  const SurfaceModel& model() const { return *step.model; }

  SurfacePoints covered(const std::vector<std::vector<float>>& coverages) const {
    SurfacePoints points = point;
    points.coverages = coverages;
    return points;
  }

  double after(double seconds, std::size_t phase, float theta, const std::vector<float>& flux) {
    std::vector<std::span<const float>> tallies;
    for (const float& tally : flux) tallies.emplace_back(&tally, 1);
    const std::vector<std::vector<float>> before{{theta}};
    return model()
        .cycle()
        ->coverages_after(seconds, phase, covered(before), tallies)
        .front()
        .front();
  }
};

// The example of an open wafer: theta(t) = theta_eq (1 - exp(-r t)) with 1/r = 32.78 ms.
TEST(Ald, CoversAnOpenWaferAsTheExponentialSays) {
  AldPoint wafer("");
  EXPECT_NEAR(wafer.after(0.1, 0, 0, {1, 0}), 0.92943, 5e-6);
  EXPECT_NEAR(wafer.after(10, 0, 0, {1, 0}), 0.97561, 5e-6);
  EXPECT_NEAR(wafer.after(0.03278, 0, 0, {1, 0}), 0.97561 * (1 - std::exp(-1)), 1e-4);
  // In two parts or at once; from above the balance it goes down.
  const auto half = static_cast<float>(wafer.after(0.05, 0, 0, {1, 0}));
  EXPECT_NEAR(wafer.after(0.05, 0, half, {1, 0}), 0.92943, 5e-6);
  EXPECT_NEAR(wafer.after(10, 0, 1, {1, 0}), 0.97561, 5e-6);
}

// Both kinds of molecules adsorb in the pulse, what has desorbed alone in the purge.
TEST(Ald, PurgesWithWhatComesBack) {
  AldPoint wafer("purge_time = \"0.05 s\"\n");
  EXPECT_EQ(wafer.model().cycle()->phases(), (std::vector<double>{0.1, 0.05}));
  EXPECT_EQ(AldPoint("").model().cycle()->phases(), std::vector<double>{0.1});
  const double rate = 2.5 / 3.36;
  EXPECT_NEAR(wafer.after(0.05, 1, 0.9F, {1, 0}), 0.9 * std::exp(-rate * 0.05), 1e-6);
  // A closed box: as much comes back as leaves, J_d theta = g J F_d (1 - theta).
  const float theta = 0.6F;
  const float returns = 2.5F * theta / (5e-5F * 2e6F * (1 - theta));
  EXPECT_NEAR(wafer.after(0.05, 1, theta, {1, returns}), theta, 1e-6);
  EXPECT_NEAR(wafer.after(0.1, 0, 0, {0.75F, 0.25F}), 0.92943, 5e-6);
}

TEST(Ald, GrowsByWhatIsCovered) {
  AldPoint wafer("purge_time = \"0.3 s\"\n");
  EXPECT_FLOAT_EQ(wafer.model().speeds(wafer.covered({{0.5F}}), {}).front(), 0.5F * 0.112F / 0.4F);
  EXPECT_DOUBLE_EQ(wafer.step.duration.seconds, 800 * 0.4);
  EXPECT_EQ(wafer.step.duration.key, "cycles");
  EXPECT_EQ(wafer.step.deposits, Materials().id("Al2O3"));
  EXPECT_EQ(AldPoint("cycles_at_once = 50\n").model().cycle()->longest_time_step(), 50 * 0.1);
}

TEST(Ald, SticksWhereItIsBareAndSendsOutWhatDesorbs) {
  AldPoint wafer("sticking = { Si = 0.02, default = 0.01 }\nflux = \"1e19 /cm2/s\"\n");
  const std::vector<std::vector<float>> half{{0.5F}};
  for (const std::vector<float>& sticking :
       wafer.model().coverages()->covered_sticking(wafer.point, half))
    EXPECT_EQ(sticking, std::vector<float>{0.01F});
  ASSERT_EQ(wafer.model().species().size(), 2U);
  EXPECT_EQ(wafer.model().species()[1].source.kind, SourceLobe::Kind::none);
  EXPECT_FLOAT_EQ(wafer.model().emitter()->emission(wafer.covered(half), {}).front().front(),
                  0.5F * 2.5F / 10000);
  AldPoint stays("desorption = \"0 /cm2/s\"\n");
  EXPECT_EQ(stays.model().species().size(), 1U);
  EXPECT_EQ(stays.model().coverages()->covered_sticking(stays.point, half).size(), 1U);
  EXPECT_EQ(stays.model().emitter(), nullptr);
  EXPECT_NEAR(stays.after(0.1, 0, 0, {1}), 1 - std::exp(-100 / 3.36 * 0.1), 1e-6);
  // Where nothing arrives nothing changes.
  EXPECT_EQ(stays.after(0.1, 0, 0.25F, {0}), 0.25F);
}

TEST(Ald, SaysWhatIsWrong) {
  const auto expect = [](const std::string& keys, const std::string& message) {
    EXPECT_THAT([&] { read_step("ald", keys); }, ThrowsMessage<InputError>(HasSubstr(message)))
        << keys;
  };
  expect("growth_per_cycle = \"0.1 nm\"\ncycles = 1\n", "step[0].material: missing");
  expect("material = \"Al2O3\"\ncycles = 1\n", "step[0].growth_per_cycle: missing");
  expect("material = \"Al2O3\"\ngrowth_per_cycle = \"0.1 nm\"\n", "step[0].cycles: missing");
  expect("material = \"Al2O3\"\ngrowth_per_cycle = \"0 nm\"\ncycles = 1\n",
         "step[0].growth_per_cycle: ");
  expect("material = \"Al2O3\"\ngrowth_per_cycle = \"0.1 nm\"\ncycles = 0\n", "step[0].cycles: 0");
  expect("material = \"Al2O3\"\ngrowth_per_cycle = \"0.1 nm\"\ncycles = 2.5\n", "step[0].cycles: ");
  expect(film + "pulse_time = \"0 s\"\n", "step[0].pulse_time: ");
  expect(film + "purge_time = \"-1 s\"\n", "step[0].purge_time: ");
  expect(film + "flux = \"0 /cm2/s\"\n", "step[0].flux: ");
  expect(film + "cycles_at_once = 0.5\n", "step[0].cycles_at_once: 0.5 is outside");
  expect(film + "sites = \"1e15 /cm3\"\n", "is a density; an areal density is wanted");
  expect(film + "sticking = 1.5\n", "step[0].sticking: 1.5 is outside [0, 1]");
  expect(film + "sticking = { Si = 0.1 }\n", "step[0].sticking: ");  // SiO2, and the film
  expect(film + "duration = \"10 s\"\n", "step[0].duration: unknown key");
  expect(film + "sticking = { Si = 0, SiO2 = 0, Al2O3 = 0.1 }\n",
         "step[0].sticking: is 0 on all that the step finds (Si, SiO2), so cycles of ald do "
         "nothing");
}

}  // namespace
}  // namespace scarp
