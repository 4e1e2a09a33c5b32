#include "models/catalogue/isotropic.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/models/model_fixture.h"

namespace scarp {
namespace {

TEST(Isotropic, EtchesEveryMaterialAtItsRateWhateverTheNormal) {
  const StepModel step =
      read_step("isotropic", R"(etch_rate = { Si = "0.6 um/min", SiO2 = "0 nm/s" })");
  EXPECT_FALSE(step.deposits);
  EXPECT_TRUE(step.model->species().empty());
  const std::vector<float> speeds =
      step.model->speeds(Points({"Si", "Si", "SiO2"}, {{0, 0, 1}, {1, 0, 0}, {0, 0, -1}}), {});
  EXPECT_THAT(speeds, testing::ElementsAre(-10, -10, 0));
  EXPECT_FALSE(std::signbit(speeds[2]));
}

TEST(Isotropic, GrowsTheMaterialThatIsDeposited) {
  const StepModel step = read_step("isotropic", "growth_rate = \"2 nm/s\"\nmaterial = \"Si3N4\"");
  EXPECT_EQ(step.deposits, Materials().id("Si3N4"));
  EXPECT_THAT(step.model->speeds(Points({"Si", "Si3N4"}), {}), testing::ElementsAre(2, 2));
}

}  // namespace
}  // namespace scarp
