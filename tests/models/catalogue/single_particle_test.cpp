#include "models/catalogue/single_particle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/models/model_fixture.h"

namespace scarp {
namespace {

TEST(SingleParticle, GrowsWithTheRateTimesTheFlux) {
  const StepModel step = read_step(
      "single_particle", "growth_rate = \"6 um/min\"\nmaterial = \"SiO2\"\nsticking = 0.1");
  EXPECT_EQ(step.deposits, Materials().id("SiO2"));
  const std::vector<float> flux{1, 0.25F, 0};
  const std::vector<std::span<const float>> tallies{flux};
  EXPECT_THAT(step.model->speeds(Points({"Si", "SiO2", "SiO2"}), tallies),
              testing::ElementsAre(100, 25, 0));
}

TEST(SingleParticle, EtchesByMaterial) {
  const StepModel step =
      read_step("single_particle", R"(etch_rate = { Si = "8 nm/s", SiO2 = "1 nm/s" })");
  EXPECT_FALSE(step.deposits);
  const std::vector<float> flux{0.5F, 0.5F};
  const std::vector<std::span<const float>> tallies{flux};
  EXPECT_THAT(step.model->speeds(Points({"Si", "SiO2"}), tallies), testing::ElementsAre(-4, -0.5F));
}

TEST(SingleParticle, HandsItsSpeciesToTheTracer) {
  const StepModel step = read_step("single_particle", R"(etch_rate = "1 nm/s"
sticking = { Si = 0.5, default = 0.02 }
source_power = 30)");
  const std::vector<Species> species = step.model->species();
  ASSERT_EQ(species.size(), 1U);
  EXPECT_EQ(species[0].source.kind, SourceLobe::Kind::cosine);
  EXPECT_EQ(species[0].source.cosine_power, 30);
  const Materials materials;
  ASSERT_EQ(species[0].sticking.size(), materials.size());
  EXPECT_EQ(species[0].sticking[materials.id("Si")], 0.5F);
  EXPECT_EQ(species[0].sticking[materials.id("SiO2")], 0.02F);
}

TEST(SingleParticle, ComesFromTheAnglesOfATable) {
  const Species species = read_step("single_particle", R"(etch_rate = "1 nm/s"
source_table = [["0 deg", 1], ["60 deg", 1]])")
                              .model->species()[0];
  ASSERT_FALSE(species.source.table.empty());
  EXPECT_NEAR(species.source.table.cosine(0.5), 0.75, 1e-6);
  EXPECT_FALSE(species.source.is_lambert());
}

TEST(SingleParticle, ComesFromWhereAMapSays) {
  const auto map = [](const std::string& rows, bool two_dimensional = false) {
    return read_step("single_particle", "etch_rate = \"1 nm/s\"\nsource_map = " + rows,
                     two_dimensional)
        .model->species()[0]
        .source.map;
  };
  const SourceMap over_both = map(R"([
    ["-50 nm", "-60 nm", 1], ["-50 nm", "60 nm", 1], ["50 nm", "-60 nm", 3], ["50 nm", "60 nm", 3]])");
  EXPECT_NEAR(over_both.at(0.25, 0.9), 0.75, 1e-12);
  const SourceMap over_x = map(R"([["-1 um", 1], ["0 um", 2], ["1 um", 1]])", true);
  EXPECT_NEAR(over_x.at(0, 0), 1.95 / 1.975, 1e-12);

  const auto expect = [&](const std::string& rows, const std::string& message) {
    EXPECT_THAT([&] { map(rows); },
                testing::ThrowsMessage<InputError>(testing::HasSubstr("step[0]." + message)));
  };
  expect(R"([["-50 nm", 1], ["50 nm", 1]])", "source_map[0]: has 2 entries; 3 are wanted");
  expect(R"([["-50 nm", "0 nm", 1], ["50 nm", "0 nm", 1]])",
         "source_map[0]: for every x two or more y are wanted");
  const std::string sides = R"([["-50 nm", "-50 nm", 1], ["-50 nm", "50 nm", 1], )";
  expect(sides + R"(["40 nm", "-50 nm", 1], ["40 nm", "50 nm", 1]])",
         "source_map: does not reach over the domain, which goes along x from -50 nm to 50 nm");
  expect(sides + R"(["50 nm", "-50 nm", 1], ["50 nm", "40 nm", 1]])",
         "source_map[3]: for every x the same y are wanted");
  expect(sides + R"(["50 nm", "-50 nm", 1]])", "source_map[2]: for every x the same y are wanted");
  expect(sides + R"(["50 nm", "-50 nm", 1], ["60 nm", "50 nm", 1]])",
         "source_map[3]: for every x the same y are wanted");
  expect(R"([["-50 nm", "-50 nm", 0], ["-50 nm", "50 nm", 0], ["50 nm", "-50 nm", 0],
             ["50 nm", "50 nm", 0]])",
         "source_map: a distribution is zero everywhere");
}

TEST(SingleParticle, SticksAndComesFromAGasInEquilibriumByDefault) {
  const Species species =
      read_step("single_particle", "etch_rate = \"1 nm/s\"").model->species()[0];
  EXPECT_EQ(species.source.cosine_power, 1);
  for (const float s : species.sticking) EXPECT_EQ(s, 1);
}

}  // namespace
}  // namespace scarp
