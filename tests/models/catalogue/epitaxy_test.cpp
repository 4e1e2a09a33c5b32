#include "models/catalogue/epitaxy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "tests/models/model_fixture.h"

namespace scarp {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

const std::string grown = "growth_rate = \"2 nm/s\"\nmaterial = \"SiGe\"\n";

double grows(const std::string& keys, Vec3d normal, const std::string& material = "Si") {
  const StepModel step = read_step("epitaxy", keys, false, {"Si", "SiO2", "SiGe"});
  return step.model->speeds(Points({material}, {Vec3f(normalized(normal))}), {}).front();
}

TEST(Epitaxy, GrowsByTheRatesOfThePlanes) {
  EXPECT_NEAR(grows(grown, {0, 0, 1}), 2, 1e-5);
  EXPECT_NEAR(grows(grown, {1, 0, 0}), 2 * 0.65, 1e-5);
  EXPECT_NEAR(grows(grown, {std::sqrt(2), 0, 1}), 2 * 0.5, 1e-5);
  EXPECT_NEAR(grows(grown + "ratio_111 = 0.1\n", {0, std::sqrt(2), 1}), 0.2, 1e-5);
  EXPECT_NEAR(grows(grown + "wafer = \"110\"\n", {0, 0, 1}), 2 * 0.65, 1e-5);
  EXPECT_NEAR(grows(grown + "azimuth = \"45 deg\"\n", {1, 0, 0}), 2, 1e-4);
}

TEST(Epitaxy, GrowsOnCrystalsAndOnItself) {
  EXPECT_EQ(grows(grown, {0, 0, 1}, "SiO2"), 0);
  EXPECT_NEAR(grows(grown, {0, 0, 1}, "SiGe"), 2, 1e-5);
  EXPECT_EQ(grows(grown + "grows_on = [\"SiO2\"]\n", {0, 0, 1}), 0);
  EXPECT_NEAR(grows(grown + "grows_on = []\n", {0, 0, 1}, "SiGe"), 2, 1e-5);
  EXPECT_EQ(read_step("epitaxy", grown).deposits, Materials().id("SiGe"));
}

TEST(Epitaxy, SaysWhatIsWrong) {
  const auto expect = [](const std::string& keys, const std::string& message) {
    EXPECT_THAT([&] { read_step("epitaxy", keys); }, ThrowsMessage<InputError>(HasSubstr(message)))
        << keys;
  };
  expect("material = \"SiGe\"\n", "step[0].growth_rate: missing");
  expect("growth_rate = \"1 nm/s\"\n", "step[0].material: missing");
  expect(grown + "ratio_110 = -1\n", "step[0].ratio_110");
  expect(grown + "wafer = \"211\"\n", "step[0].wafer");
  expect("material = \"SiGe\"\ngrowth_rate = \"0 nm/s\"\n", "step[0].growth_rate");
  expect(grown + "grows_on = [\"Ge\"]\n",
         "step[0].grows_on: is nothing that the step finds (Si, SiO2), so epitaxy grows nothing");
}

}  // namespace
}  // namespace scarp
