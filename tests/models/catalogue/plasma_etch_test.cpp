// The chemistry that sf6_o2 and hbr_o2 share, at points where all fluxes are known.

#include "models/catalogue/plasma_etch.h"

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

/// What arrives at one point: of both gases and of ions, along with what these bring.
struct Arrivals {
  double etchant = 1;
  double passivation = 1;
  double ions = 1;
};

/// Under vertical ions, all of them of their mean energy.
class PlasmaPoint : public ModelAtPoint {
 public:
  PlasmaPoint(const std::string& model, const std::string& keys, const std::string& material = "Si")
      : ModelAtPoint(model, keys, material) {}

  PlasmaPoint& under(const Arrivals& arrivals) {
    tallies_ = {static_cast<float>(arrivals.etchant)};
    if (coverage_names(&model()).size() == 2)
      tallies_.push_back(static_cast<float>(arrivals.passivation));
    for (const Species& each : species())
      if (each.ions) add_ions(each, arrivals.ions);
    return *this;
  }

  double etchant() const { return coverage(0); }
  double passivation() const { return coverage(1); }
};

struct Blanket {
  const char* name;
  const char* model;
  const char* keys;
  double etchant;
  double passivation;
  double rate;
};

std::string name_of(const testing::TestParamInfo<Blanket>& test) { return test.param.name; }

constexpr const char* hole_keys =
    "etchant_flux = \"4.5e18 /cm2/s\"\npassivation_flux = \"8e17 /cm2/s\"\n"
    "removal_amplitude = 2\n";
constexpr const char* hole_ions = "[[step.ion]]\nflux = \"1e16 /cm2/s\"\n";

const std::string hole_example = std::string(hole_keys) + hole_ions;
const std::string hole_without_g =
    std::string(hole_keys) + "sticking_in_balance = false\n" + hole_ions;

class BlanketRate : public testing::TestWithParam<Blanket> {};

TEST_P(BlanketRate, IsThatOfTheFormulas) {
  const Blanket& c = GetParam();
  PlasmaPoint point(c.model, c.keys);
  point.under({});
  EXPECT_NEAR(point.etchant(), c.etchant, 2e-5);
  EXPECT_NEAR(point.passivation(), c.passivation, 2e-5);
  EXPECT_NEAR(-point.speed(), c.rate, 1e-4 * c.rate);
}

INSTANTIATE_TEST_SUITE_P(
    Recipes, BlanketRate,
    testing::Values(Blanket{"Sf6O2WithoutG", "sf6_o2", "sticking_in_balance = false\n", 0.49056,
                            0.14715, 58.0683},
                    Blanket{"Sf6O2", "sf6_o2", "", 0.40265, 0.17255, 47.7419},
                    Blanket{"HoleWithoutG", "sf6_o2", hole_without_g.c_str(), 0.36206, 0.54478,
                            36.7140},
                    Blanket{"Hole", "sf6_o2", hole_example.c_str(), 0.28433, 0.61117, 28.9111},
                    Blanket{"WithoutOxygen", "sf6_o2", "passivation_flux = \"0 /cm2/s\"\n", 0.48661,
                            0, 57.6046},
                    Blanket{"HbrO2", "hbr_o2", "", 0.11004, 0.25707, 15.1083},
                    Blanket{"HbrO2WithoutG", "hbr_o2", "sticking_in_balance = false\n", 0.55287,
                            0.12915, 54.1532},
                    Blanket{"Chemical", "sf6_o2",
                            "passivation_flux = \"0 /cm2/s\"\n[[step.ion]]\nflux = \"0 /cm2/s\"\n",
                            0.80769, 0, 12.0671},
                    Blanket{"Sf6C4f8", "sf6_c4f8", "", 0.48661, 0, 57.6046}),
    name_of);

// Half the probability to stick is half the flux in the balance; without it there, it is not.
TEST(PlasmaEtch, StickingCountsInTheBalanceUnlessItIsLeftOut) {
  const std::string half = "passivation_sticking = 0.5\n";
  const std::string half_as_many = "passivation_flux = \"5e16 /cm2/s\"\n";
  const std::string left_out = "sticking_in_balance = false\n";
  PlasmaPoint in_balance("sf6_o2", half);
  PlasmaPoint same("sf6_o2", half_as_many);
  EXPECT_FLOAT_EQ(in_balance.under({}).passivation(), same.under({}).passivation());
  EXPECT_FLOAT_EQ(in_balance.sticking()[1].front(), 0.5 * same.sticking()[1].front());
  PlasmaPoint without("sf6_o2", half + left_out);
  PlasmaPoint full("sf6_o2", left_out);
  EXPECT_EQ(without.under({}).passivation(), full.under({}).passivation());
}

TEST(PlasmaEtch, CoveragesHaveTheirLimits) {
  PlasmaPoint point("sf6_o2", "");
  // a = (300 + 2 R) / 1260 F, b = (0.04 + R_p) / 100 F.
  point.under({.etchant = 0.5, .passivation = 0, .ions = 0});
  EXPECT_FLOAT_EQ(point.etchant(), 1 / (1 + 300 / 630.0));
  EXPECT_EQ(point.passivation(), 0);
  point.under({.etchant = 0, .passivation = 0.5, .ions = 0});
  EXPECT_EQ(point.etchant(), 0);
  EXPECT_FLOAT_EQ(point.passivation(), 1 / (1 + 0.04 / 50));
  EXPECT_EQ(point.speed(), 0);  // oxygen alone does not etch
  point.under({.etchant = 0, .passivation = 0, .ions = 0});
  EXPECT_EQ(point.etchant(), 0);
  EXPECT_EQ(point.passivation(), 0);
  EXPECT_EQ(point.speed(), 0);
  // Ions alone sputter.
  point.under({.etchant = 0, .passivation = 0, .ions = 0.5});
  EXPECT_NEAR(point.speed(), -0.4453 / 2, 1e-4);
}

// Sites that nothing leaves: the gases share them as they arrive, whatever the ratio of two zeros.
TEST(PlasmaEtch, NothingIsNotANumberWhereAllIsZero) {
  const std::string none = "\"0 /cm2/s\"\n";
  for (int bits = 0; bits < 256; ++bits) {
    const auto zero = [bits](int bit) { return (bits >> bit & 1) != 0; };
    std::string keys;
    if (zero(0)) keys += "etchant_flux = " + none;
    if (zero(1)) keys += "passivation_flux = " + none;
    if (zero(2)) keys += "etchant_desorption = " + none;
    if (zero(3)) keys += "passivation_desorption = " + none;
    if (zero(4)) keys += "etchant_sticking = 0\n";
    PlasmaPoint point("sf6_o2", keys);
    point.under({.etchant = zero(5) ? 0.0 : 1,
                 .passivation = zero(6) ? 0.0 : 1e-30,
                 .ions = zero(7) ? 0.0 : 1});
    EXPECT_TRUE(std::isfinite(point.speed())) << keys << bits;
    EXPECT_GE(point.etchant(), 0) << keys << bits;
    EXPECT_GE(point.passivation(), 0) << keys << bits;
    EXPECT_LE(point.etchant() + point.passivation(), 1 + 1e-6) << keys << bits;
    EXPECT_GE(point.sticking()[0].front(), 0) << keys << bits;
  }
  PlasmaPoint point("sf6_o2", "etchant_desorption = " + none + "passivation_desorption = " + none +
                                  "[[step.ion]]\nflux = " + none);
  point.under({});
  EXPECT_FLOAT_EQ(point.etchant(), 1260.0 / 1360);
  EXPECT_FLOAT_EQ(point.passivation(), 100.0 / 1360);
}

TEST(PlasmaEtch, CoveragesBalanceWhatArrives) {
  PlasmaPoint point("sf6_o2", "");
  RandomStream random({1, 2, 3, 4});
  for (int n = 0; n < 1000; ++n) {
    const auto log_uniform = [&] { return std::pow(10.0, 4 * random.uniform() - 4); };
    const Arrivals f{log_uniform(), log_uniform(), log_uniform()};
    point.under(f);
    const double e = point.etchant();
    const double p = point.passivation();
    const double bare = 1 - e - p;
    const double root = std::sqrt(100.0);
    const double etches = 12 * f.ions * 7 * (root - std::sqrt(15.0));
    const double removes = 12 * f.ions * 3 * (root - std::sqrt(10.0));
    // Coverages are single precision, so the bare part is known to 1e-7.
    EXPECT_NEAR(0.7 * 1800 * f.etchant * bare, (300 + 2 * etches) * e,
                1e-4 * (300 + 2 * etches) * e + 3e-7 * 1260 * f.etchant);
    EXPECT_NEAR(100 * f.passivation * bare, (0.04 + removes) * p,
                1e-4 * (0.04 + removes) * p + 3e-7 * 100 * f.passivation);
    EXPECT_NEAR(point.sticking()[0].front(), 0.7 * bare, 1e-6);
    EXPECT_NEAR(point.sticking()[1].front(), bare, 1e-6);
    EXPECT_TRUE(point.sticking()[2].empty());  // of ions: by their angle
  }
}

TEST(PlasmaEtch, AMaskIsSputteredOnly) {
  // 12 x 0.0139 (10 - sqrt(18)) / 2.2 of oxide.
  PlasmaPoint oxide("sf6_o2", "", "SiO2");
  EXPECT_NEAR(oxide.under({}).speed(), -12 * 0.0139 * (10 - std::sqrt(18.0)) / 2.2, 1e-5);
  EXPECT_GT(oxide.etchant(), 0.3);  // it is covered all the same
  PlasmaPoint etched("sf6_o2", "etches = [\"SiO2\"]\n", "SiO2");
  EXPECT_LT(etched.under({}).speed(), -50);
  PlasmaPoint silicon("sf6_o2", "etches = [\"SiO2\"]\n");
  EXPECT_NEAR(silicon.under({}).speed(), -0.4453, 1e-4);
  PlasmaPoint own("sf6_o2", "sputter_amplitude = { SiO2 = 0.0278 }\n", "SiO2");
  EXPECT_NEAR(own.under({}).speed(), 2 * oxide.speed(), 1e-5);
}

// A yield belongs to one amplitude, threshold and angle; of Si and SiO2 one of them differs.
TEST(PlasmaEtch, MaterialsShareAYieldOnlyIfItIsTheSame) {
  const std::string alike = "sputter_amplitude = 0.03\nsputter_threshold = \"20 eV\"\n";
  const auto yields = [](const std::string& keys) {
    return read_step("sf6_o2", keys).model->species().back().yields;
  };
  EXPECT_EQ(yields(alike).size(), 3U);
  const auto other_threshold = yields(
      "sputter_amplitude = 0.03\nsputter_threshold = { Si = \"20 eV\", SiO2 = \"50 eV\" }\n");
  ASSERT_EQ(other_threshold.size(), 4U);
  EXPECT_EQ(other_threshold[3].threshold, 50);
  EXPECT_EQ(yields(alike + "sputter_factor = { Si = 9.3, SiO2 = 2 }\n").size(), 4U);
  PlasmaPoint oxide("sf6_o2",
                    "sputter_amplitude = 0.03\n"
                    "sputter_threshold = { Si = \"20 eV\", SiO2 = \"50 eV\" }\n",
                    "SiO2");
  EXPECT_NEAR(oxide.under({}).speed(), -12 * 0.03 * (10 - std::sqrt(50.0)) / 2.2, 1e-5);
}

// 12 x 0.02 (10 - sqrt(15)) / rho of polymer, which fluorine leaves alone and hardly sticks to.
TEST(PlasmaEtch, ThePolymerOfABoschProcessIsSputteredOnly) {
  PlasmaPoint polymer("sf6_c4f8", "", "polymer");
  EXPECT_NEAR(polymer.under({}).speed(), -12 * 0.02 * (10 - std::sqrt(15.0)) / 2, 1e-5);
  EXPECT_LE(polymer.sticking()[0].front(), 0.02);
  EXPECT_EQ(polymer.sticking().size(), 2U);
  const StepModel step = read_step("sf6_c4f8", "");
  EXPECT_EQ(coverage_names(step.model.get()), std::vector<std::string>{"F"});
  EXPECT_FALSE(step.deposits.has_value());
  const std::vector<Species> species = step.model->species();
  ASSERT_EQ(species.size(), 2U);
  EXPECT_EQ(species[1].yields[0].name, "enhanced");
  EXPECT_EQ(species[1].ions->least_energy, 15);
}

TEST(PlasmaEtch, IonsOfSeveralKindsAddUp) {
  // Without gases what they sputter is the sum of their own.
  const std::string no_gases = "etchant_flux = \"0 /cm2/s\"\npassivation_flux = \"0 /cm2/s\"\n";
  PlasmaPoint unlike("sf6_o2", no_gases +
                                   "[[step.ion]]\nflux = \"6e15 /cm2/s\"\n"
                                   "[[step.ion]]\nflux = \"3e15 /cm2/s\"\nenergy = \"400 eV\"\n");
  const double root = std::sqrt(20.0);
  EXPECT_NEAR(unlike.under({}).speed(), -0.0337 * (6 * (10 - root) + 3 * (20 - root)) / 5.02, 1e-4);
  const std::string half = "[[step.ion]]\nflux = \"6e15 /cm2/s\"\n";
  PlasmaPoint two("sf6_o2", half + half);
  PlasmaPoint one("sf6_o2", "");
  EXPECT_FLOAT_EQ(two.under({}).speed(), one.under({}).speed());
  const std::vector<Species> species = read_step("sf6_o2", half + half).model->species();
  ASSERT_EQ(species.size(), 4U);
  EXPECT_EQ(species[2].name, "ion_1");
  EXPECT_EQ(species[3].yields.front().name, "enhanced_2");
  EXPECT_EQ(species[3].ions->least_energy, 10);  // of the passivation, which needs least
}

TEST(PlasmaEtch, LeansWithItsIons) {
  EXPECT_TRUE(read_step("sf6_o2", "").model->angular().is_mirror_symmetric(0));
  EXPECT_FALSE(read_step("sf6_o2", "[[step.ion]]\ntilt = \"9 deg\"\n")
                   .model->angular()
                   .is_mirror_symmetric(0));
}

TEST(PlasmaEtch, SaysWhatIsWrong) {
  const auto expect = [](const std::string& keys, const std::string& message) {
    EXPECT_THAT([&] { read_step("sf6_o2", keys); }, ThrowsMessage<InputError>(HasSubstr(message)))
        << keys;
  };
  expect("etchant_flux = 5\n", "step[0].etchant_flux: 5");
  expect("etchant_flux = \"5 nm/s\"\n", "step[0].etchant_flux");
  expect("etchant_flux = \"-1e18 /cm2/s\"\n", "outside [0, ");
  expect("etchant_sticking = 1.5\n", "step[0].etchant_sticking: 1.5 is outside [0, 1]");
  expect("etches = [\"Su\"]\n", "step[0].etches[0]");
  expect("sputter_amplitude = { Si = 1, default = -1 }\n", "step[0].sputter_amplitude.default");
  expect("oxygen_flux = \"1e17 /cm2/s\"\n", "step[0].oxygen_flux: unknown key");
  expect("[[step.ion]]\nflux = \"1e16 nm\"\n", "step[0].ion[0].flux");
}

// Values are known of few materials; others have to be given.
TEST(PlasmaEtch, AMaterialWithoutYieldIsNamed) {
  const auto read = [](const std::string& keys) {
    const RecipeFile file({"[[step]]\n" + keys, "r.toml"});
    const Materials materials;
    find_model("sf6_o2")->read(file.root().tables("step")[0],
                               {materials, {materials.id("Si"), materials.id("resist")}});
    file.finish();
    return file.resolved();
  };
  EXPECT_THAT([&] { read("\n"); },
              ThrowsMessage<InputError>(testing::AllOf(
                  HasSubstr("step[0].sputter_amplitude: no value for resist, which this step can "
                            "reach; add sputter_amplitude = { resist = ... }"),
                  HasSubstr("step[0].sputter_threshold: no value for resist"))));
  const std::string resist =
      "sputter_amplitude = { resist = 0.02 }\nsputter_threshold = { resist = \"15 eV\" }\n";
  const std::string resolved = read(resist);
  EXPECT_THAT(resolved, HasSubstr("Si = 0.0337"));
  EXPECT_THAT(resolved, HasSubstr("resist = 0.02"));
}

}  // namespace
}  // namespace scarp
