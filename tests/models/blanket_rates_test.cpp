// Rates of open flat wafers to which models of a plasma are scaled.

#include <gtest/gtest.h>

#include <string>

#include "core/recipe/recipe_table.h"
#include "models/open_wafer.h"
#include "models/registry.h"

namespace scarp {
namespace {

const std::string etch =
    "duration = \"1 s\"\netchant_flux = \"1.5e17 /cm2/s\"\npolymer_flux = \"1e16 /cm2/s\"\n"
    "[[step.ion]]\nflux = \"5.6e16 /cm2/s\"\nenergy = \"100 eV\"\nsource_power = 100\n";

// So much polymer that it grows on everything.
const std::string growth =
    "duration = \"1 s\"\netchant_flux = \"1.5e17 /cm2/s\"\npolymer_flux = \"1e18 /cm2/s\"\n"
    "[[step.ion]]\nflux = \"1e15 /cm2/s\"\nenergy = \"100 eV\"\nsource_power = 100\n";

struct EtchStep {
  StepModel made;
  std::string errors{};
};

EtchStep read_etch_step(const std::string& keys) {
  const Materials materials;
  const RecipeFile file({"[[step]]\n" + keys, "r.toml"});
  const RecipeTable step = file.root().tables("step").front();
  std::vector<MaterialId> reachable{*materials.find("Si"), *materials.find("SiO2"),
                                    *materials.find("mask")};
  step.time("duration");
  EtchStep read{.made = read_model(step, {.materials = materials, .reachable = reachable})};
  try {
    file.finish();
  } catch (const InputError& error) {
    read.errors = error.what();
  }
  return read;
}

float open_rate(const SurfaceModel& model, const std::string& material) {
  const Materials materials;
  return open_wafer_speeds(model, materials.size())[*materials.find(material)];
}

TEST(BlanketRates, AreThoseOfAnOpenWafer) {
  const EtchStep plain = read_etch_step("model = \"fluorocarbon\"\n" + etch);
  const EtchStep scaled = read_etch_step(
      "model = \"fluorocarbon\"\nblanket_rate = { SiO2 = \"200 nm/min\", Si = \"4 nm/min\" }\n" +
      etch);
  ASSERT_TRUE(plain.made.model && scaled.made.model) << scaled.errors;
  EXPECT_NEAR(open_rate(*scaled.made.model, "SiO2"), -200.0 / 60, 1e-5);
  EXPECT_NEAR(open_rate(*scaled.made.model, "Si"), -4.0 / 60, 1e-6);
  EXPECT_EQ(open_rate(*scaled.made.model, "mask"), open_rate(*plain.made.model, "mask"));
  EXPECT_EQ(scaled.made.deposits, plain.made.deposits);
  EXPECT_EQ(scaled.made.model->balance() == nullptr, plain.made.model->balance() == nullptr);
}

TEST(BlanketRates, ScaleEtchingAloneAndAtAnyFlux) {
  const EtchStep plain = read_etch_step("model = \"fluorocarbon\"\n" + etch);
  const EtchStep scaled =
      read_etch_step("model = \"fluorocarbon\"\nblanket_rate = { SiO2 = \"200 nm/min\" }\n" + etch);
  ASSERT_TRUE(plain.made.model && scaled.made.model);
  const MaterialId oxide = *Materials().find("SiO2");
  const float factor = open_rate(*scaled.made.model, "SiO2") / open_rate(*plain.made.model, "SiO2");
  const std::vector<MaterialId> material(3, oxide);
  const std::vector<Vec3f> normal(3, Vec3f{0, 0, 1});
  std::size_t tallies = 0;
  for (const Species& species : plain.made.model->species()) tallies += 1 + species.yields.size();
  // Little, much, and no ions at all, where polymer grows.
  const std::vector<std::vector<float>> flux(tallies, {0.1F, 1.5F, 0.0F});
  std::vector<std::vector<float>> without_ions = flux;
  for (std::size_t t = 0; t < tallies; ++t) without_ions[t][2] = t < 2 ? 1.0F : 0.0F;
  const std::vector<std::span<const float>> spans(without_ions.begin(), without_ions.end());
  const SurfacePoints points{.material = material, .normal = normal};
  const std::vector<float> before = plain.made.model->speeds(points, spans);
  const std::vector<float> after = scaled.made.model->speeds(points, spans);
  for (std::size_t p = 0; p < before.size(); ++p)
    EXPECT_FLOAT_EQ(after[p], before[p] < 0 ? factor * before[p] : before[p]) << p;
  EXPECT_GT(before[2], 0);
}

// The wafer has silicon, oxide and a mask.
TEST(BlanketRates, OneValueIsForTheMaterialsOfTheWafer) {
  for (const std::string rate : {"\"60 nm/min\"", "{ default = \"60 nm/min\" }"}) {
    const EtchStep step =
        read_etch_step("model = \"fluorocarbon\"\nblanket_rate = " + rate + "\n" + etch);
    ASSERT_TRUE(step.made.model && step.errors.empty()) << rate << step.errors;
    for (const char* material : {"Si", "SiO2", "mask"})
      EXPECT_NEAR(open_rate(*step.made.model, material), -1, 1e-5) << material;
    const EtchStep plain = read_etch_step("model = \"fluorocarbon\"\n" + etch);
    EXPECT_EQ(open_rate(*step.made.model, "polymer"), open_rate(*plain.made.model, "polymer"));
  }
}

// A tool's table of rates is shared between recipes.
TEST(BlanketRates, OfAMaterialThatIsNotOnTheWaferAreNotUsed) {
  for (const std::string model : {"fluorocarbon", "cf4_o2"}) {
    const std::string head = "model = \"" + model + "\"\n";
    const std::string step = model == "cf4_o2" ? "duration = \"1 s\"\n" : etch;
    const EtchStep plain = read_etch_step(head + step);
    const EtchStep shared = read_etch_step(
        head + "blanket_rate = { polySi = \"100 nm/min\", Si = \"30 nm/min\" }\n" + step);
    ASSERT_TRUE(shared.made.model && shared.errors.empty()) << model << shared.errors;
    EXPECT_NEAR(open_rate(*shared.made.model, "Si"), -0.5, 1e-5) << model;
    EXPECT_EQ(open_rate(*shared.made.model, "SiO2"), open_rate(*plain.made.model, "SiO2"));
  }
}

TEST(BlanketRates, AreRefusedWhereThereIsNothingToScale) {
  const auto refusal = [](const std::string& rates, const std::string& step) {
    return read_etch_step("model = \"fluorocarbon\"\nblanket_rate = " + rates + "\n" + step).errors;
  };
  EXPECT_NE(refusal("{ SiO2 = \"1 nm/s\" }", growth)
                .find("on an open wafer of SiO2 the step deposits polymer instead of etching"),
            std::string::npos);
  EXPECT_NE(refusal("{ SiO2 = \"1 nm/s\", Si = \"1 nm/s\" }",
                    "sputter_amplitude = 0\netches = []\n" + etch)
                .find("the step does not etch an open wafer of SiO2"),
            std::string::npos);
  EXPECT_NE(refusal("\"1 nm/s\"", growth).find("the step etches no material of the wafer"),
            std::string::npos);
  EXPECT_NE(read_etch_step("model = \"isotropic\"\nduration = \"1 s\"\netch_rate = \"1 nm/s\"\n"
                           "blanket_rate = { Si = \"2 nm/s\" }\n")
                .errors.find("blanket_rate"),
            std::string::npos);
}

}  // namespace
}  // namespace scarp
