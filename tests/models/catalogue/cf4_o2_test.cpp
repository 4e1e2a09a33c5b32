// Silicon and silicon-germanium in CF4/O2, at points where all fluxes are known.

#include "models/catalogue/cf4_o2.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/random.h"
#include "tests/models/model_fixture.h"

namespace scarp {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

class Cf4Point : public ModelAtPoint {
 public:
  Cf4Point(const std::string& keys, const std::string& material)
      : ModelAtPoint("cf4_o2", keys, material) {}

  Cf4Point& under(const std::vector<double>& gases, double ions = 1) {
    tallies_ = {gases.begin(), gases.end()};
    for (const Species& each : species())
      if (each.ions) add_ions(each, ions);
    return *this;
  }
};

// The determinant of the balance written out, J_F 500, J_O 50, J_C 5, no ions.
TEST(Cf4O2, HasTheRatesOfTheExample) {
  Cf4Point silicon("", "Si");
  silicon.under({1, 1, 1});
  EXPECT_EQ(silicon.species().size(), 3U);
  EXPECT_NEAR(silicon.coverage(0), 1000 / 751660.0, 1e-8);
  EXPECT_NEAR(silicon.coverage(1), 750000 / 751660.0, 1e-6);
  EXPECT_NEAR(silicon.speed(), -300 * (1000 / 751660.0) / 4 / 5.02, 1e-6);
  Cf4Point alloy("", "SiGe");
  alloy.under({1, 1, 1});
  EXPECT_NEAR(alloy.coverage(0), 0.54693, 2e-5);
  EXPECT_NEAR(alloy.coverage(1), 0.03775, 2e-5);
  EXPECT_NEAR(alloy.coverage(2), 0.03776, 2e-5);
  EXPECT_NEAR(alloy.speed(), -5.474, 2e-3);
  EXPECT_EQ(Cf4Point("", "SiO2").under({1, 1, 1}).speed(), 0);
}

// What adsorbs on bare sites leaves, of each gas.
TEST(Cf4O2, CoveragesAreInBalance) {
  RandomStream random({.seed = 5});
  for (const char* const material : {"Si", "SiGe"}) {
    Cf4Point point("sticking_in_balance = true\n[[step.ion]]\nenergy = \"80 eV\"\n", material);
    const bool is_alloy = std::string(material) == "SiGe";
    const double k = 300 * (is_alloy ? std::exp(0.4675 * 0.3) : 1);
    for (int n = 0; n < 50; ++n) {
      const std::vector<double> gases{random.uniform(), random.uniform(), random.uniform()};
      const double ions = random.uniform();
      point.under(gases, ions);
      const double removal = 12 * ions * 3 * (std::sqrt(80) - std::sqrt(10));
      const double enhanced =
          12 * ions * (is_alloy ? 6.5 : 7) * (std::sqrt(80) - std::sqrt(is_alloy ? 14.0 : 15.0));
      const double f = point.coverage(0);
      const double o = point.coverage(1);
      const double c = point.coverage(2);
      const double bare = 1 - f - o - c;
      EXPECT_NEAR(0.7 * 500 * gases[0] * bare, (k + 2 * enhanced) * f, 1e-3);
      EXPECT_NEAR(50 * gases[1] * bare, (0.04 + removal + (is_alloy ? 500 * gases[0] : 0)) * o,
                  1e-3);
      EXPECT_NEAR(5 * gases[2] * bare, (removal + 50 * gases[1]) * c, 1e-3);
    }
  }
}

TEST(Cf4O2, IonsSputterAndEtch) {
  const std::string ions = "[[step.ion]]\nflux = \"2e16 /cm2/s\"\nenergy = \"100 eV\"\n";
  Cf4Point oxide(ions, "SiO2");
  EXPECT_NEAR(oxide.under({0, 0, 0}).speed(), -20 * 0.0139 * (10 - std::sqrt(20)) / 2.2, 1e-6);
  // Ions take fluorine from what it etches alone.
  EXPECT_NEAR(oxide.under({1, 0, 0}).coverage(0), 500.0 / (500 + 300), 1e-6);
  Cf4Point silicon(ions + "", "Si");
  silicon.under({1, 0, 0});
  const double enhanced = 20 * 7 * (10 - std::sqrt(15));
  const double theta = 500 / (500 + 300 + 2 * enhanced);
  EXPECT_NEAR(silicon.coverage(0), theta, 1e-6);
  EXPECT_NEAR(silicon.speed(),
              -(75 * theta + 20 * 0.0337 * (10 - std::sqrt(20)) + theta * enhanced) / 5.02, 1e-4);
}

// Also where nothing arrives, or nothing leaves.
TEST(Cf4O2, LimitsAreSound) {
  Cf4Point bare("", "Si");
  bare.under({0, 0, 0});
  for (const std::size_t gas : {0, 1, 2}) EXPECT_EQ(bare.coverage(gas), 0);
  EXPECT_EQ(bare.speed(), 0);
  EXPECT_FLOAT_EQ(bare.sticking()[0].front(), 0.7F);
  // Carbon without oxygen and ions never leaves.
  Cf4Point carbon("", "Si");
  carbon.under({1, 0, 0.001});
  EXPECT_EQ(carbon.coverage(2), 1);
  EXPECT_EQ(carbon.speed(), 0);
  Cf4Point both("oxygen_desorption = \"0 /cm2/s\"\nfluorine_desorption = \"0 /cm2/s\"\n", "Si");
  both.under({1, 1, 0});
  EXPECT_NEAR(both.coverage(0), 500 / 550.0, 1e-6);
  EXPECT_NEAR(both.coverage(1), 50 / 550.0, 1e-6);
}

TEST(Cf4O2, SticksToWhatCoversTheSurface) {
  Cf4Point point(
      "fluorine_sticking = 0.5\noxygen_sticking = 0.8\ncarbon_sticking = 0.6\n"
      "fluorine_on_oxygen = 0.1\noxygen_on_carbon = 0.2\ncarbon_on_oxygen = 0.4\n",
      "Si");
  const Points at({"Si"});
  const std::vector<std::vector<float>> coverages{{0.2F}, {0.3F}, {0.1F}};
  const auto sticking = point.model().coverages()->covered_sticking(at, coverages);
  EXPECT_FLOAT_EQ(sticking[0].front(), 0.5F * 0.4F + 0.1F * 0.3F);
  EXPECT_FLOAT_EQ(sticking[1].front(), 0.8F * 0.4F + 0.2F * 0.1F);
  EXPECT_FLOAT_EQ(sticking[2].front(), 0.6F * 0.4F + 0.4F * 0.3F);
}

// Much oxygen: the k of what is oxidised.
TEST(Cf4O2, OxygenChangesTheRateOfTheAlloy) {
  Cf4Point alloy("oxygen_flux = \"5e19 /cm2/s\"\n", "SiGe");
  alloy.under({1, 1, 1});
  EXPECT_GT(alloy.coverage(1), 0.5 * alloy.coverage(0));
  EXPECT_NEAR(alloy.speed(), -alloy.coverage(0) * 300 * std::exp(0.4675) / 4 / 4.84, 1e-6);
}

TEST(Cf4O2, SaysWhatIsWrong) {
  const auto expect = [](const std::string& keys, const std::string& message) {
    EXPECT_THAT([&] { read_step("cf4_o2", keys); }, ThrowsMessage<InputError>(HasSubstr(message)))
        << keys;
  };
  expect("fluorine_flux = \"-1 /cm2/s\"\n", "step[0].fluorine_flux: ");
  expect("germanium = 1.2\n", "step[0].germanium: 1.2 is outside [0, 1]");
  expect("germanium = { SiGe = \"a\" }\n", "step[0].germanium");
  expect("fluorine_on_oxygen = 2\n", "step[0].fluorine_on_oxygen: 2 is outside [0, 1]");
  expect("etches = [\"Sii\"]\n", "step[0].etches");
  expect("etches = [\"W\"]\n", "step[0].etches: is nothing that the step finds");
  expect("fluorine_flux = \"0 /cm2/s\"\n", "step[0].fluorine_flux: is 0, and there are no ions");
  EXPECT_NO_THROW(read_step("cf4_o2", "fluorine_flux = \"0 /cm2/s\"\n[[step.ion]]\n"));
  EXPECT_FALSE(read_step("cf4_o2", "[[step.ion]]\ntilt = \"5 deg\"\n")
                   .model->angular()
                   .is_mirror_symmetric(0));
}

}  // namespace
}  // namespace scarp
