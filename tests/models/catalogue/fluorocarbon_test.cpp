// Etching that turns into deposition, at points where all fluxes are known.

#include "models/catalogue/fluorocarbon.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "tests/models/model_fixture.h"

namespace scarp {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

/// What arrives at one point: of both radicals and of ions, along with what these bring.
struct RadicalsAndIons {
  double etchant = 1;
  double former = 1;
  double ions = 1;
};

/// Under vertical ions, all of them of their mean energy.
class FluorocarbonPoint : public ModelAtPoint {
 public:
  FluorocarbonPoint(const std::string& keys, const std::string& material)
      : ModelAtPoint("fluorocarbon", keys, material) {}

  FluorocarbonPoint& under(const RadicalsAndIons& arrivals) {
    tallies_ = {static_cast<float>(arrivals.etchant), static_cast<float>(arrivals.former)};
    for (const Species& each : species())
      if (each.ions) add_ions(each, arrivals.ions);
    return *this;
  }
};

std::string radicals(double etchant, double former) {
  return "etchant_flux = \"" + std::to_string(etchant) + "e15 /cm2/s\"\npolymer_flux = \"" +
         std::to_string(former) + "e15 /cm2/s\"\n";
}

struct OxideRate {
  double former = 0;
  double rate = 0;
};

// Of 150e15 etchant and 56e15 ions per cm2 and s; between 60 and 100 of the former the etch stops.
TEST(Fluorocarbon, EtchesOxideUntilPolymerGrows) {
  for (const auto& [former, rate] :
       {OxideRate{5, -6.0995}, {20, -5.4252}, {60, -3.6269}, {100, 1.1030}}) {
    FluorocarbonPoint oxide(radicals(150, former), "SiO2");
    EXPECT_NEAR(oxide.under({}).speed(), rate, 1e-4 * std::abs(rate)) << former;
  }
  FluorocarbonPoint oxide(radicals(150, 5), "SiO2");
  oxide.under({});
  EXPECT_NEAR(oxide.coverage(0), 0.76441, 2e-5);
  EXPECT_NEAR(oxide.coverage(1) + oxide.coverage(2), 0.05243, 2e-5);
  EXPECT_NEAR(oxide.coverage(2) / 0.05243, 0.73562, 2e-4);
}

TEST(Fluorocarbon, CoveragesHaveTheirLimits) {
  FluorocarbonPoint oxide(radicals(150, 5), "SiO2");
  // Without ions: nothing is etched but by evaporation, and a former that sticks grows at once.
  oxide.under({.former = 0, .ions = 0});
  EXPECT_NEAR(oxide.coverage(0), 1, 1e-4);
  EXPECT_NEAR(oxide.speed(), -2.789e-3 * std::exp(-0.168 / (8.617333e-5 * 300)) * 150 / 2.2, 1e-7);
  oxide.under({.etchant = 0, .ions = 0});
  EXPECT_NEAR(oxide.speed(), 5 * 0.26 / 2, 1e-6);
  EXPECT_EQ(oxide.coverage(1), 1);
  // Ions alone sputter.
  oxide.under({.etchant = 0, .former = 0});
  EXPECT_NEAR(oxide.speed(), -56 * 0.0139 * (10 - std::sqrt(18.0)) / 2.2, 1e-5);
  oxide.under({.etchant = 0, .former = 0, .ions = 0});
  EXPECT_EQ(oxide.speed(), 0);
}

TEST(Fluorocarbon, NothingIsNotANumberWhereAllIsZero) {
  const std::string none = "\"0 /cm2/s\"\n";
  for (const std::string material : {"SiO2", "polymer", "mask"}) {
    for (int bits = 0; bits < 64; ++bits) {
      const auto zero = [bits](int bit) { return (bits >> bit & 1) != 0; };
      std::string keys;
      if (zero(0)) keys += "etchant_flux = " + none;
      if (zero(1)) keys += "polymer_flux = " + none;
      if (zero(2)) keys += "etchant_sticking = 0\n";
      FluorocarbonPoint point(keys, material);
      point.under(
          {.etchant = zero(3) ? 0.0 : 1, .former = zero(4) ? 0.0 : 1, .ions = zero(5) ? 0.0 : 1});
      EXPECT_TRUE(std::isfinite(point.speed())) << keys << bits;
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_GE(point.coverage(k), 0) << keys << bits;
        sum += point.coverage(k);
      }
      EXPECT_LE(sum, 1 + 1e-6) << keys << bits;
      EXPECT_GE(point.sticking()[0].front(), 0) << keys << bits;
      EXPECT_LE(point.sticking()[0].front(), 1) << keys << bits;
    }
  }
}

// What sticks is what is used up: by etching and evaporation of covered sites, and by polymer.
TEST(Fluorocarbon, EtchantThatSticksIsUsedUp) {
  FluorocarbonPoint oxide(radicals(150, 20), "SiO2");
  for (const double ions : {0.01, 0.3, 1.0}) {
    for (const double former : {0.0, 0.2, 1.0}) {
      oxide.under({.former = former, .ions = ions});
      const double etched = 56 * ions * 0.0361 * 8 + 2.789e-3 * std::exp(-0.168 / 0.02585200) * 150;
      const double removed = 56 * ions * 0.0722 * 8;
      EXPECT_NEAR(150 * oxide.sticking()[0].front(),
                  2 * etched * oxide.coverage(0) + removed * oxide.coverage(2), 1e-4 * 150)
          << ions << ' ' << former;
      EXPECT_TRUE(oxide.sticking()[1].empty());  // of the former: that of the material
    }
  }
}

// Until coverages are known, and of the former always.
TEST(Fluorocarbon, RadicalsStickToBareMaterialsAsTheRecipeSays) {
  const FluorocarbonPoint point(
      "etchant_sticking = { SiO2 = 0.7, Si = 0.4, polymer = 0.2, default = 0.1 }\n"
      "polymer_sticking = { SiO2 = 0.3, Si = 0.5, polymer = 0.6, default = 0.1 }\n",
      "SiO2");
  const Materials materials;
  const auto of = [&](std::size_t species, const char* material) {
    return point.species()[species].sticking.at(materials.id(material));
  };
  EXPECT_FLOAT_EQ(of(0, "SiO2"), 0.7F);
  EXPECT_FLOAT_EQ(of(0, "Si"), 0.4F);
  EXPECT_FLOAT_EQ(of(1, "SiO2"), 0.3F);
  EXPECT_FLOAT_EQ(of(1, "Si"), 0.5F);
  EXPECT_FLOAT_EQ(of(1, "polymer"), 0.6F);
}

// (100 x 0.26 - 32.35 x 90 / 122.35) / 2, (5 x 0.26 - 23.80) / 2.
TEST(Fluorocarbon, PolymerGrowsOrGoes) {
  const double removed = 56 * 0.0722 * 8 * 90 / (90 + 56 * 0.0722 * 8);
  for (const double former : {5.0, 60.0, 100.0}) {
    FluorocarbonPoint film(radicals(150, former), "polymer");
    EXPECT_NEAR(film.under({}).speed(), (0.26 * former - removed) / 2, 1e-4) << former;
    EXPECT_FLOAT_EQ(film.coverage(1) + film.coverage(2), 1);
    EXPECT_EQ(film.coverage(0), 0);
  }
  const StepModel step = read_step("fluorocarbon", "");
  EXPECT_EQ(step.deposits, Materials().id("polymer"));
  EXPECT_EQ(coverage_names(step.model.get()).size(), 3U);
}

TEST(Fluorocarbon, AMaskIsSputteredOnly) {
  FluorocarbonPoint mask(radicals(150, 5), "mask");
  EXPECT_NEAR(mask.under({}).speed(), -56 * 0.0139 * (10 - std::sqrt(20.0)) / 500, 1e-6);
  FluorocarbonPoint nitride("etches = [\"SiO2\"]\n" + radicals(150, 5), "Si3N4");
  EXPECT_NEAR(nitride.under({}).speed(), -56 * 0.0139 * (10 - std::sqrt(18.0)) / 2.3, 1e-5);
}

TEST(Fluorocarbon, MaterialsHaveYieldsOfTheirOwn) {
  const auto names = [](const std::string& keys) {
    std::vector<std::string> all;
    const FluorocarbonPoint point(keys, "mask");
    for (const YieldLaw& law : point.species()[2].yields) all.push_back(law.name);
    return all;
  };
  using List = std::vector<std::string>;
  EXPECT_EQ(names(""), (List{"removal", "sputter_Si", "enhanced_Si", "sputter_mask"}));
  EXPECT_EQ(names("enhanced_amplitude = { SiO2 = 0.05 , default = 0.03 }\n").size(), 5U);
  EXPECT_EQ(names("sputter_factor = { SiO2 = 2, default = 9.3 }\n").size(), 5U);
  // Of the polymer there is none: ions take it off by its removal.
  EXPECT_EQ(names("sputter_factor = { polymer = 2, default = 9.3 }\n").size(), 4U);
  const std::string dense = radicals(1e5, 0) + "evaporation = 0\n";
  FluorocarbonPoint faster(dense + "enhanced_amplitude = { SiO2 = 0.0722, default = 0 }\n", "SiO2");
  FluorocarbonPoint slower(dense, "SiO2");
  EXPECT_NEAR(faster.under({}).speed() / slower.under({}).speed(), 2, 0.01);
  // Warmer wafers evaporate more.
  FluorocarbonPoint warm(radicals(150, 0) + "temperature = \"600 K\"\n", "SiO2");
  EXPECT_NEAR(warm.under({.ions = 0}).speed(),
              -2.789e-3 * std::exp(-0.168 / (8.617333e-5 * 600)) * 150 / 2.2, 1e-4);
}

TEST(Fluorocarbon, IonsOfSeveralKindsAddUp) {
  const std::string gases = radicals(150, 5);
  const std::string half = "[[step.ion]]\nflux = \"2.8e16 /cm2/s\"\n";
  FluorocarbonPoint two(gases + half + half, "SiO2");
  FluorocarbonPoint one(gases, "SiO2");
  EXPECT_FLOAT_EQ(two.under({}).speed(), one.under({}).speed());
  FluorocarbonPoint unlike(radicals(0, 0) + half + half + "energy = \"400 eV\"\n", "SiO2");
  EXPECT_NEAR(unlike.under({}).speed(), -28 * 0.0139 * (10 + 20 - 2 * std::sqrt(18.0)) / 2.2, 1e-4);
  EXPECT_FALSE(read_step("fluorocarbon", "[[step.ion]]\ntilt = \"9 deg\"\n")
                   .model->angular()
                   .is_mirror_symmetric(0));
}

TEST(Fluorocarbon, SaysWhatIsWrong) {
  const auto expect = [](const std::string& keys, const std::string& message) {
    EXPECT_THAT([&] { read_step("fluorocarbon", keys); },
                ThrowsMessage<InputError>(HasSubstr(message)))
        << keys;
  };
  expect("etchant_flux = 5\n", "step[0].etchant_flux");
  expect("polymer_sticking = { SiO2 = 1.5, Si = 0 }\n", "step[0].polymer_sticking.SiO2: 1.5");
  expect("temperature = \"0 K\"\n", "step[0].temperature");
  expect("material = \"teflon\"\n", "step[0].material");
  expect("etches = [\"SiO3\"]\n", "step[0].etches[0]");
  expect("oxygen_flux = \"1e17 /cm2/s\"\n", "step[0].oxygen_flux: unknown key");
}

}  // namespace
}  // namespace scarp
