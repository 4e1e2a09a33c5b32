// Open flat wafers of all chemistries: what a recipe etches or grows in some time against rates
// that were worked out by hand from the formulas and parameters of the models.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "apps/simulator/simulator.h"
#include "levelset/operations/layer_steps.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

/// A wafer, a step without its duration, and how fast it etches; below 0 it grows. Units: nm/s.
struct Blanket {
  const char* name;
  const char* wafer;
  std::string step;
  double rate;
};

/// Ions are nearly vertical, of exactly their energy where nothing else is said.
std::string plasma(const std::string& model, const std::string& keys = "",
                   const std::string& ion_keys = "", const std::string& deviation = "0 eV") {
  return "model = \"" + model + "\"\n" + keys +
         "[[step.ion]]\nsource_power = 1e5\nenergy_deviation = \"" + deviation + "\"\n" + ion_keys;
}

std::string fluorocarbon(const std::string& polymer_flux) {
  return plasma("fluorocarbon", "etchant_flux = \"1.5e17 /cm2/s\"\npolymer_flux = \"" +
                                    polymer_flux + " /cm2/s\"\n");
}

/// A Bosch cycle by particles: ions of flux J and neutrals, volumes of A^3 per particle.
std::string bosch(const std::string& rate) {
  return "model = \"multi_particle\"\n" + rate +
         "[[step.neutral]]\nname = \"neutral\"\nsticking = 0.1\n"
         "[[step.ion]]\nname = \"ion\"\nsource_power = 1e5\n";
}

/// The planes of a crystal, of a bath of 30 % KOH at 70 degrees Celsius.
std::string koh(const std::string& plane) {
  return "model = \"koh_etch\"\nazimuth = \"90 deg\"\nwafer = \"" + plane + "\"\n";
}

/// Its growth on a plane; 2 nm/s on {100}.
std::string epitaxy(const std::string& plane) {
  return "model = \"epitaxy\"\nmaterial = \"SiGe\"\ngrowth_rate = \"2 nm/s\"\n"
         "azimuth = \"90 deg\"\nwafer = \"" +
         plane + "\"\n";
}

/// A bath whose silica saturates at 4e18 /cm3 and reaches oxide at 10 um/s.
const std::string bath =
    "model = \"oxide_regrowth\"\nmaterial = \"SiO2\"\nsettling_rate = \"10 um/s\"\n"
    "saturation = \"4e18 /cm3\"\ndiffusivity = \"1e-6 cm2/s\"\nboundary_layer = \"10 um\"\n";

const std::string no_g = "sticking_in_balance = false\n";
const std::string hole_gases =
    "etchant_flux = \"4.5e18 /cm2/s\"\npassivation_flux = \"8e17 /cm2/s\"\nremoval_amplitude = 2\n";
const std::string hole_ions = "flux = \"1e16 /cm2/s\"\n";
const std::string no_oxygen = "passivation_flux = \"0 /cm2/s\"\n";
const std::string etch_rates =
    "[step.rate]\npolymer = \"-5.46875 nm/s * ion - 3 nm/s * neutral\"\n"
    "Si = \"-11.8125 nm/s * ion - 90 nm/s * neutral\"\n"
    "mask = \"-0.590625 nm/s * ion - 4.5 nm/s * neutral\"\n";

const std::vector<Blanket> blankets{
    // SF6/O2 and HBr/O2: 12 of ions, 1800 and 100 of gases in 1e15 /cm2/s, 100 eV.
    {"Sf6O2WithoutG", "Si", plasma("sf6_o2", no_g), 58.0683},
    {"Sf6O2", "Si", plasma("sf6_o2"), 47.7419},
    {"Sf6O2WithEnergies", "Si", plasma("sf6_o2", "", "", "10 eV"), 47.6859},
    {"HoleWithoutG", "Si", plasma("sf6_o2", hole_gases + no_g, hole_ions), 36.7140},
    {"Hole", "Si", plasma("sf6_o2", hole_gases, hole_ions), 28.9111},
    {"WithoutOxygen", "Si", plasma("sf6_o2", no_oxygen), 57.6046},
    {"HbrO2", "Si", plasma("hbr_o2"), 15.1083},
    {"HbrO2WithoutG", "Si", plasma("hbr_o2", no_g), 54.1532},
    {"Chemical", "Si", plasma("sf6_o2", no_oxygen, "flux = \"0 /cm2/s\"\n"), 12.0671},
    // A Bosch cycle: its chemistry, where polymer goes at 12 x 0.02 (sqrt(100) - sqrt(15)) / 5; and
    // by particles, 3.125 of ions and 2000 of neutrals, then 4.375 and 10000.
    {"Sf6C4f8", "Si", plasma("sf6_c4f8"), 57.6046},
    {"Sf6C4f8Polymer", "polymer", plasma("sf6_c4f8"), 0.294096},
    {"BoschFilm", "Si",
     bosch("material = \"polymer\"\nrate = \"0.3125 nm/s * ion + 10 nm/s * neutral\"\n"), -10.3125},
    {"BoschPolymer", "polymer", bosch(etch_rates), 8.46875},
    {"BoschSilicon", "Si", bosch(etch_rates), 101.8125},
    {"BoschMask", "mask", bosch(etch_rates), 5.090625},
    // Fluorocarbon on oxide: 56 of ions, 150 of etchant, and so much of what forms polymer.
    {"Fluorocarbon5", "SiO2", fluorocarbon("5e15"), 6.0995},
    {"Fluorocarbon20", "SiO2", fluorocarbon("2e16"), 5.4252},
    {"Fluorocarbon60", "SiO2", fluorocarbon("6e16"), 3.6269},
    {"Fluorocarbon100", "SiO2", fluorocarbon("1e17"), -1.1030},
    // Fluorine alone, four to an atom: what is covered leaves at 300 of 1e15 /cm2/s.
    {"Langmuir", "Si",
     "model = \"langmuir_transport\"\nflux = \"1.8e18 /cm2/s\"\nsticking = 0.7\n"
     "reaction = \"3e17 /cm2/s\"\nmolecules_per_atom = 4\n",
     12.0671},
    // A bath 10 um at rest: what settles is what comes through the layer, k c_s (S - 1) = D (1.5
    // c_s
    // - S c_s) / d.
    {"OxideRegrowthNitride", "Si3N4", bath + "bath_concentration = \"5e18 /cm3\"\n", 6.5 / 60},
    {"OxideRegrowthOxide", "SiO2", bath + "bath_concentration = \"6e18 /cm3\"\n",
     -4e-4 / 2.2 * 1e4 * 0.5 / 2},
    {"OxideRegrowthBelowSaturation", "SiO2",
     bath + "bath_concentration = \"3e18 /cm3\"\netch_rate = { SiO2 = \"0.2 nm/min\" }\n",
     0.2 / 60},
    // CF4/O2 without ions: the balance of 500 of F, 50 of O and 5 of C, on silicon and with 30 % of
    // germanium.
    {"Cf4O2Silicon", "Si", "model = \"cf4_o2\"\n", 300 * (1000 / 751660.0) / 4 / 5.02},
    {"Cf4O2Germanium", "SiGe", "model = \"cf4_o2\"\n", 5.474},
    {"Epitaxy100", "Si", epitaxy("100"), -2},
    {"Epitaxy110", "Si", epitaxy("110"), -1.3},
    {"Epitaxy111", "Si", epitaxy("111"), -1},
    {"Koh100", "Si", koh("100"), 1000.0 / 60},
    {"Koh110", "Si", koh("110"), 1855.0 / 60},
    {"Koh111", "Si", koh("111"), 7.3 / 60},
};

class BlanketWafer : public ::testing::TestWithParam<Blanket> {};

TEST_P(BlanketWafer, MovesAtTheRateOfTheFormulas) {
  const Blanket& blanket = GetParam();
  const double way = 25;  // nm, some time steps
  const Recipe recipe = read_text(
      "[domain]\nmode = \"2d\"\nspacing = \"10 nm\"\nextent = [\"100 nm\"]\n"
      "boundary = [\"periodic\"]\n[flux]\ntarget_error = 0.005\n"
      "[materials.polymer]\ndensity = \"" +
      std::string(blanket.name == std::string("Sf6C4f8Polymer") ? "5e22" : "2e22") +
      " /cm3\"\n[[geometry]]\nshape = \"wafer\"\nmaterial = \"" + blanket.wafer +
      "\"\n[[step]]\nduration = \"" + std::to_string(way / std::abs(blanket.rate)) + " s\"\n" +
      blanket.step);
  State state = start_state(recipe.domain.frame, recipe.start);
  const double before = highest_point(state.layers);
  double error = 0;
  double lowest = 0;
  while (!finished(state, recipe.steps)) {
    begin_step(state, recipe.steps);
    const Survey now = survey(state, recipe);
    for (const FluxField& flux : now.flux) error = std::max(error, flux.error);
    advance(state, recipe, now, std::numeric_limits<double>::infinity());
    lowest = survey(state, recipe).extent.lower.z;
  }
  const double tolerance = (0.01 + error) * way;
  const double expected = blanket.rate > 0 ? -way : way;
  EXPECT_NEAR(highest_point(state.layers) - before, expected, tolerance);
  EXPECT_NEAR(lowest - before, expected, tolerance);
}

INSTANTIATE_TEST_SUITE_P(Recipes, BlanketWafer, ::testing::ValuesIn(blankets),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace scarp
