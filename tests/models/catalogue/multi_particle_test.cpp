#include "models/catalogue/multi_particle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "tests/models/model_fixture.h"

namespace scarp {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr const char* plasma =
    R"(rate = { Si = "-100 nm/s * F^0.5 * etch - 1 nm/s * ion", SiO2 = "-2 nm/s * ion" }
[[step.neutral]]
name = "F"
sticking = { Si = 0.7, default = 0.01 }
[[step.neutral]]
name = "O"
source_power = 2
[[step.ion]]
name = "ion"
source_power = 1000
energy = "64 eV"
energy_deviation = "0 eV"
[[step.ion.yield]]
name = "etch"
amplitude = 7
threshold = "16 eV"
angular = "enhanced"
[[step.ion.yield]]
name = "sputter"
amplitude = 0.5
threshold = "25 eV"
angular = "sputter"
)";

double at_angle(const AngleTable& table, double degrees) {
  return table.at(AngleTable::half_sine(std::cos(degrees * std::numbers::pi / 180)));
}

TEST(MultiParticle, HandsItsSpeciesToTheTracer) {
  const StepModel step = read_step("multi_particle", plasma);
  const Materials materials;
  const std::vector<Species> species = step.model->species();
  ASSERT_EQ(species.size(), 3U);
  EXPECT_EQ(species[0].name, "F");
  EXPECT_EQ(species[0].sticking[materials.id("Si")], 0.7F);
  EXPECT_EQ(species[0].sticking[materials.id("SiO2")], 0.01F);
  EXPECT_FALSE(species[0].ions.has_value());
  EXPECT_EQ(species[1].source.cosine_power, 2);
  ASSERT_TRUE(species[2].ions.has_value());
  EXPECT_EQ(species[2].source.cosine_power, 1000);
  EXPECT_EQ(species[2].ions->energy.quantile(0.3), 64);
  EXPECT_EQ(species[2].ions->least_energy, 16);  // of the yield that needs least
  ASSERT_EQ(species[2].yields.size(), 2U);
  EXPECT_NEAR(species[2].yields[0].at(64, 0), 7 * 4, 1e-5);
  EXPECT_NEAR(at_angle(species[2].yields[0].factor, 60), 1, 1e-3);
  EXPECT_NEAR(at_angle(species[2].yields[0].factor, 75), 0.5, 1e-4);
  EXPECT_NEAR(at_angle(species[2].yields[1].factor, 52.58), 4.172, 1e-3);
  EXPECT_FALSE(step.deposits.has_value());
}

TEST(MultiParticle, IonsAreReflectedAsTheirKeysSay) {
  const StepModel step = read_step("multi_particle", R"(rate = "-1 nm/s * some * other * y"
[[step.ion]]
name = "some"
[[step.ion]]
name = "other"
energy = "200 eV"
energy_deviation = "20 eV"
sticks_to = "40 deg"
reflects_from = "60 deg"
narrowest_at = "85 deg"
inflection = "80 deg"
energy_power = 5
[[step.ion.yield]]
name = "y"
amplitude = 1
threshold = "7 eV"
angular = "sputter"
sputter_factor = 2
)");
  const std::vector<Species> species = step.model->species();
  ASSERT_EQ(species.size(), 2U);
  for (const Species& each : species) {
    EXPECT_THAT(each.sticking, testing::Each(1.0F));
    EXPECT_EQ(each.ions->energy_deviation, 0.1);
  }
  const Ions& some = *species[0].ions;
  EXPECT_EQ(species[0].source.cosine_power, 500);
  EXPECT_NEAR(some.energy.mean(), 100, 1e-3);
  EXPECT_NEAR(some.energy.quantile(0.975), 100 + 19.6, 0.01);
  EXPECT_EQ(some.least_energy, 0);  // all count, there is no yield
  EXPECT_NEAR(at_angle(some.sticking, 69), 1, 1e-6);
  EXPECT_NEAR(at_angle(some.sticking, 80), 0.5, 1e-3);
  EXPECT_NEAR(at_angle(some.cone, 89) * 180 / std::numbers::pi, 10, 1e-3);
  EXPECT_NEAR(at_angle(some.energy_kept, 80), 0.3096, 1e-3);
  const Ions& other = *species[1].ions;
  EXPECT_NEAR(other.energy.quantile(0.975), 200 + 39.2, 0.02);
  EXPECT_EQ(other.least_energy, 7);
  EXPECT_NEAR(at_angle(other.sticking, 50), 0.5, 1e-3);
  EXPECT_NEAR(at_angle(other.cone, 89) * 180 / std::numbers::pi, 5, 1e-3);
  // A = 1 / (1 + 5 / 8), at half the inflection (1 / 2)^5 of it.
  EXPECT_NEAR(at_angle(other.energy_kept, 40), 8.0 / 13 / 32, 1e-4);
  EXPECT_NEAR(species[1].yields[0].factor.at(AngleTable::half_sine(0.5)), 0.5 * 2.5, 1e-4);
}

TEST(MultiParticle, MovesAsItsFormulasSay) {
  const StepModel step = read_step("multi_particle", plasma);
  // F, O, ion, etch, sputter
  const std::vector<float> f{0.25F, 0.25F};
  const std::vector<float> oxygen{1, 1};
  const std::vector<float> ion{0.5F, 0.5F};
  const std::vector<float> etch{2, 2};
  const std::vector<float> sputter{0, 0};
  const std::vector<std::span<const float>> flux{f, oxygen, ion, etch, sputter};
  EXPECT_THAT(step.model->speeds(Points({"Si", "SiO2"}), flux), ElementsAre(-100.5F, -1));
  EXPECT_EQ(step.model->formula(Materials().id("SiO2")), "-2 nm/s * ion");
  EXPECT_EQ(step.model->formula(Materials().id("W")), "");
}

TEST(MultiParticle, GrowsWhatItNames) {
  const StepModel step = read_step("multi_particle", R"(rate = "6 um/min * TEOS"
material = "SiO2"
[[step.neutral]]
name = "TEOS"
sticking = 0.1
)");
  EXPECT_EQ(step.deposits, Materials().id("SiO2"));
  const std::vector<float> flux{0.5F};
  const std::vector<std::span<const float>> tallies{flux};
  EXPECT_THAT(step.model->speeds(Points({"SiO2"}), tallies), ElementsAre(50));
}

TEST(MultiParticle, IsMirrorSymmetricUnlessItsIonsLean) {
  const auto with_ion = [](const std::string& keys) {
    return read_step("multi_particle",
                     "rate = \"-1 nm/s * i\"\n[[step.ion]]\nname = \"i\"\n" + keys)
        .model;
  };
  EXPECT_TRUE(with_ion("")->angular().is_mirror_symmetric(0));
  EXPECT_FALSE(with_ion("tilt = \"30 deg\"")->angular().is_mirror_symmetric(0));
  EXPECT_TRUE(with_ion("tilt = \"30 deg\"")->angular().is_mirror_symmetric(1));
  EXPECT_FALSE(
      with_ion("tilt = \"30 deg\"\nazimuth = \"90 deg\"")->angular().is_mirror_symmetric(1));
  EXPECT_TRUE(with_ion("tilt = \"30 deg\"\nrotating = true")->angular().is_mirror_symmetric(0));
}

TEST(MultiParticle, TakesTheEnergiesAndAnglesOfTables) {
  const auto ion = [](const std::string& keys) {
    return read_step("multi_particle",
                     "rate = \"-1 nm/s * i\"\n[[step.ion]]\nname = \"i\"\n" + keys)
        .model->species()[0];
  };
  const Species two_peaks = ion("energy = \"200 eV\"\nenergy_width = \"60 eV\"\n");
  EXPECT_NEAR(two_peaks.ions->energy.quantile(0), 170, 1e-3);
  EXPECT_NEAR(two_peaks.ions->energy.quantile(0.5), 200, 1e-3);
  EXPECT_NEAR(two_peaks.ions->energy.quantile(0.25), 200 - 30 / std::sqrt(2.0), 1e-3);

  const Species rising =
      ion("energy_table = [[\"0 eV\", 0], [\"0.1 keV\", 3]]\n"
          "source_table = [[\"0 deg\", 2], [\"60 deg\", 2]]\n");
  EXPECT_NEAR(rising.ions->energy.quantile(0.25), 50, 0.01);
  ASSERT_FALSE(rising.source.table.empty());
  // Even over the cap within 60 degrees, half of the half space.
  EXPECT_NEAR(rising.source.table.at(0.8), 1 / std::numbers::pi, 1e-6);
  EXPECT_EQ(rising.source.table.at(0.4), 0);
  EXPECT_TRUE(two_peaks.source.table.empty());
}

TEST(MultiParticle, TakesYieldsAndStickingFromTables) {
  const Species ion = read_step("multi_particle", R"(rate = "-1 nm/s * a * b * c"
[[step.ion]]
name = "ion"
energy = "60 eV"
energy_deviation = "0 eV"
sticking_table = [["0 deg", 1], ["50 deg", 0.5], ["90 deg", 0]]
[[step.ion.yield]]
name = "a"
amplitude = 2
threshold = "16 eV"
angular_table = [["0 deg", 1], ["90 deg", 2]]
[[step.ion.yield]]
name = "b"
energy_table = [["20 eV", 0], ["100 eV", 4]]
angular = "enhanced"
[[step.ion.yield]]
name = "c"
table = [["30 eV", "0 deg", 0], ["30 eV", "90 deg", 0],
         ["60 eV", "0 deg", 1], ["60 eV", "45 deg", 3], ["60 eV", "90 deg", 0]]
)")
                          .model->species()[0];
  EXPECT_NEAR(at_angle(ion.ions->sticking, 25), 0.75, 1e-3);
  EXPECT_NEAR(at_angle(ion.ions->sticking, 70), 0.25, 1e-3);
  EXPECT_EQ(ion.ions->least_energy, 16);
  const auto at = [&](std::size_t law, double energy, double degrees) {
    return ion.yields[law].at(energy,
                              AngleTable::half_sine(std::cos(degrees * std::numbers::pi / 180)));
  };
  EXPECT_NEAR(at(0, 36, 45), 2 * 2 * 1.5, 1e-3);
  EXPECT_NEAR(at(1, 60, 30), 2, 1e-3);
  EXPECT_NEAR(at(1, 60, 75), 1, 1e-3);
  EXPECT_EQ(at(1, 20, 0), 0);
  EXPECT_NEAR(at(2, 45, 45), 1.5, 1e-2);
  EXPECT_NEAR(at(2, 60, 22.5), 2, 1e-2);
}

TEST(MultiParticle, RefusesTablesOfYieldsThatMakeNoSense) {
  const auto expect = [](const std::string& keys, const std::string& message) {
    EXPECT_THAT(
        [&] {
          read_step("multi_particle",
                    "rate = \"-1 nm/s * y\"\n[[step.ion]]\nname = \"i\"\nenergy_deviation = "
                    "\"0 eV\"\n[[step.ion.yield]]\nname = \"y\"\n" +
                        keys);
        },
        ThrowsMessage<InputError>(HasSubstr("step[0].ion[0].yield[0]." + message)))
        << keys;
  };
  const std::string energies = "energy_table = [[\"20 eV\", 0], [\"100 eV\", 3]]\n";
  expect(energies + "amplitude = 1\n", "amplitude: energy_table and amplitude exclude each other");
  expect(energies + "threshold = \"1 eV\"\n",
         "threshold: energy_table and threshold exclude each other");
  expect("energy_table = [[\"20 eV\", 0], [\"99 eV\", 3]]\n",
         "energy_table: ends at 99 eV, but ions of up to 100 eV come from the source");
  expect("energy_table = [[\"20 eV\", 1], [\"100 eV\", 3]]\n",
         "energy_table: begins at 20 eV with a yield");
  expect("energy_table = [[\"20 eV\", 0], [\"20 eV\", 3]]\n",
         "energy_table[1]: rows have to ascend by energy");
  expect("energy_table = [[\"20 eV\", 0], [\"100 eV\", -3]]\n",
         "energy_table[1][1]: -3 is outside [0, 1e6]");
  const std::string angles = "angular_table = [[\"0 deg\", 1], [\"90 deg\", 3]]\n";
  expect(angles + "amplitude = 1\nangular = \"cosine\"\n",
         "angular: angular_table and angular exclude each other");
  expect(angles + "amplitude = 1\nsputter_factor = 1\n",
         "sputter_factor: angular_table and sputter_factor exclude each other");
  expect("amplitude = 1\nangular_table = [[\"0 deg\", 1], [\"80 deg\", 3]]\n",
         "angular_table: its angles have to go from 0 to 90 deg");
  const std::string both =
      "table = [[\"0 eV\", \"0 deg\", 1], [\"0 eV\", \"90 deg\", 1], "
      "[\"100 eV\", \"0 deg\", 1], [\"100 eV\", \"90 deg\", 2]]\n";
  expect(both + energies, "energy_table: table and energy_table exclude each other");
  expect(both + angles, "angular_table: table and angular_table exclude each other");
  expect(
      "table = [[\"0 eV\", \"0 deg\", 1], [\"0 eV\", \"90 deg\", 1], [\"100 eV\", \"0 deg\", 1]]\n",
      "table[2]: of 100 eV: its angles have to go from 0 to 90 deg");
  expect("table = [[\"0 eV\", \"0 deg\", 1], [\"0 eV\", \"0 deg\", 1]]\n",
         "table[1]: rows have to ascend by energy, then by angle");
}

TEST(MultiParticle, NeutralsMayLeanLikeIons) {
  const auto source = [](const std::string& keys) {
    const StepModel step = read_step(
        "multi_particle", "rate = \"1 nm/s * g\"\n[[step.neutral]]\nname = \"g\"\n" + keys);
    EXPECT_EQ(step.model->angular().is_mirror_symmetric(0),
              keys.find("tilt") == std::string::npos || keys.find("rotating") != std::string::npos);
    return step.model->species()[0].source;
  };
  EXPECT_EQ(source("").direction.z, -1);
  EXPECT_NEAR(source("tilt = \"30 deg\"\n").direction.x, 0.5, 1e-15);
  EXPECT_NEAR(source("tilt = \"30 deg\"\nazimuth = \"180 deg\"\n").direction.x, -0.5, 1e-15);
  EXPECT_TRUE(source("tilt = \"30 deg\"\nrotating = true\n").rotating);
  EXPECT_TRUE(source("").map.empty());
  EXPECT_FALSE(source("source_table = [[\"0 deg\", 1], [\"90 deg\", 0]]\n").table.empty());
}

TEST(MultiParticle, RefusesDistributionsThatMakeNoSense) {
  const auto expect = [](const std::string& keys, const std::string& message) {
    EXPECT_THAT(
        [&] {
          read_step("multi_particle",
                    "rate = \"-1 nm/s * i\"\n[[step.ion]]\nname = \"i\"\n" + keys);
        },
        ThrowsMessage<InputError>(HasSubstr("step[0].ion[0]." + message)))
        << keys;
  };
  expect("energy_width = \"201 eV\"\n",
         "energy_width: the lower peak lies at a negative energy; at most twice the mean, 200 eV");
  expect("energy_width = \"20 eV\"\nenergy_deviation = \"1 eV\"\n",
         "energy_deviation: energy_width and energy_deviation exclude each other; leave one out");
  const std::string energies = "energy_table = [[\"0 eV\", 0], [\"90 eV\", 3]]\n";
  expect(energies + "energy = \"9 eV\"\n", "energy: energy_table and energy exclude each other");
  expect(energies + "energy_deviation = \"9 eV\"\n",
         "energy_deviation: energy_table and energy_deviation exclude each other");
  expect(energies + "energy_width = \"9 eV\"\n",
         "energy_width: energy_table and energy_width exclude each other");
  expect("energy_table = [[\"0 eV\", 0], [\"90 eV\", 0]]\n",
         "energy_table: a distribution is zero everywhere");
  expect("energy_table = [[\"9 eV\", 1], [\"9 eV\", 0]]\n",
         "energy_table[1]: rows have to ascend by energy");
  expect("energy_table = [[\"-9 eV\", 1], [\"9 eV\", 0]]\n",
         "energy_table[0][0]: \"-9 eV\" is outside [0, ");
  const std::string angles = "source_table = [[\"0 deg\", 1], [\"90 deg\", 0]]\n";
  expect(angles + "source_power = 2\n",
         "source_power: source_table and source_power exclude each other");
  expect("source_table = [[\"0 deg\", 1], [\"91 deg\", 0]]\n",
         "source_table[1][0]: \"91 deg\" is outside [0, 90 deg]");
  expect("source_table = [[\"0 deg\", 1], [\"90 deg\", 0.1]]\n",
         "source_table[1]: has to be 0 at 90 deg");
  expect("source_table = [[\"0 deg\", 1, 2], [\"9 deg\", 0]]\n",
         "source_table[0]: has 3 entries; 2 are wanted");
  expect("source_table = [[\"0 deg\", -1], [\"9 deg\", 0]]\n", "source_table[0][1]: -1 is below 0");
  const std::string sticking = "sticking_table = [[\"0 deg\", 1], [\"90 deg\", 0]]\n";
  expect(sticking + "sticks_to = \"9 deg\"\n",
         "sticks_to: sticking_table and sticks_to exclude each other");
  expect(sticking + "reflects_from = \"9 deg\"\n",
         "reflects_from: sticking_table and reflects_from exclude each other");
  expect("sticking_table = [[\"0 deg\", 1], [\"90 deg\", 1.1]]\n",
         "sticking_table[1][1]: 1.1 is outside [0, 1]");
  expect("sticking_table = [[\"9 deg\", 1], [\"90 deg\", 1]]\n",
         "sticking_table: its angles have to go from 0 to 90 deg");
  expect("source_table = \"absent.csv\"\n", "source_table: absent.csv: cannot be read");
}

TEST(MultiParticle, SaysWhatIsWrong) {
  const auto expect = [](const std::string& keys, const std::string& message) {
    EXPECT_THAT([&] { read_step("multi_particle", keys); },
                ThrowsMessage<InputError>(HasSubstr(message)))
        << keys;
  };
  const std::string neutral = "[[step.neutral]]\nname = \"F\"\n";
  expect("rate = \"1 nm/s\"\n", "nothing arrives; add a [[step.neutral]] or a [[step.ion]]");
  expect(neutral, "step[0].rate: missing");
  expect("rate = \"1 nm/s * G\"\n" + neutral,
         "r.toml:2:8: step[0].rate: in \"1 nm/s * G\", column 10: there is no G");
  expect("rate = { Si = \"1 nm/s * F\" }\n" + neutral, "no value for SiO2");
  expect("rate = { Si = 5, default = \"0\" }\n" + neutral, "step[0].rate.Si: 5 is not a text");
  expect("rate = \"1 nm/s * F\"\n" + neutral + neutral, "there is another F in this step");
  expect("rate = \"1 nm/s\"\n[[step.neutral]]\nname = \"a b\"\n", "has to be a word");
  expect("rate = \"1 nm/s\"\n[[step.neutral]]\nname = \"max\"\n", "name of a function");
  expect(
      "rate = \"1 nm/s * i\"\n[[step.ion]]\nname = \"i\"\nsticks_to = \"80 deg\"\n"
      "reflects_from = \"70 deg\"\n",
      "step[0].ion[0].reflects_from: has to be at least sticks_to");
  expect("rate = \"1 nm/s * i\"\n[[step.ion]]\nname = \"i\"\n[[step.ion.yield]]\nname = \"y\"\n",
         "step[0].ion[0].yield[0].amplitude: missing");
}

TEST(MultiParticle, SaysWhatIsWrongOnce) {
  const auto message = [](const std::string& keys) {
    try {
      read_step("multi_particle", keys);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  // The same text for two materials, and another one.
  EXPECT_EQ(message("rate = { Si = \"1 nm/s * G\", SiO2 = \"1 nm/s * G\", W = \"F\" }\n"
                    "[[step.neutral]]\nname = \"F\"\n"),
            "r.toml:2:8: step[0].rate: in \"1 nm/s * G\", column 10: there is no G; there are F\n"
            "r.toml:2:8: step[0].rate: in \"F\", column 1: the formula is a number, not a rate; "
            "write its rates with a unit, for example \"-20 nm/s * F\"");
  // Formulas do not know what is misnamed.
  EXPECT_EQ(message("rate = \"1 nm/s * F\"\n[[step.neutral]]\nnam = \"F\"\n"),
            "r.toml:4:1: step[0].neutral[0].nam: unknown key (did you mean name?)");
  EXPECT_EQ(message("rate = \"1 nm/s * F2\"\n[[step.neutral]]\nname = \"2F\"\n"),
            "r.toml:4:8: step[0].neutral[0].name: has to be a word of letters, digits and _ that "
            "begins with a letter and is not the name of a function");
  // What is long is not quoted.
  EXPECT_EQ(message("rate = \"" + std::string(5000, '-') + "\"\n[[step.neutral]]\nname = \"F\"\n"),
            "r.toml:2:8: step[0].rate: column 1: the formula is longer than 4096 characters");
}

}  // namespace
}  // namespace scarp
