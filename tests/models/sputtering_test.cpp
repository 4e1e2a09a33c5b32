// Ions that sputter, at points where all fluxes are known.

#include "models/sputtering.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "models/open_response.h"
#include "tests/models/model_fixture.h"

namespace scarp {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double degree = std::numbers::pi / 180;

const std::string silicon_alone = "etch_rate = { Si = \"2 nm/s\", SiO2 = \"0 nm/s\" }\n";
const std::string parallel = "[[step.ion]]\nsource_power = 1e6\n";

Species ions_of(const std::string& keys) {
  const StepModel step = read_step("ion_milling", keys);
  for (const Species& species : step.model->species())
    if (species.ions) return species;
  return {};
}

double flat(const Species& ions) { return OpenResponse(ions, ions.yields.front()).flat(); }

Vec3d at_angle(double degrees) {
  return {std::sin(degrees * degree), 0, std::cos(degrees * degree)};
}

// What a parallel beam makes of a slope is cos(theta) Y(theta).
TEST(OpenResponse, OfABeamIsTheYieldTimesTheCosine) {
  const Species ions = ions_of(silicon_alone + parallel + "energy_deviation = \"0 eV\"\n");
  const double strength = std::sqrt(100.0) - std::sqrt(20.0);
  const OpenResponse response(ions, ions.yields.front());
  for (const double theta : {0.0, 30.0, 41.91, 52.58, 80.0}) {
    const double c = std::cos(theta * degree);
    const double expected = strength * c * c * (1 + 9.3 * (1 - c * c));
    EXPECT_NEAR(response.at(at_angle(theta)), expected, 2e-3 * expected) << theta;
    EXPECT_NEAR(response.factor().value(Vec3f(at_angle(theta))), expected, 2e-3 * expected);
  }
  EXPECT_EQ(response.at({0, 0, -1}), 0);
}

// The mean of cos^k under a lobe cos^n is (n + 1) / (n + k + 1).
TEST(OpenResponse, OfALobeIsTheMeanOverIt) {
  for (const double n : {1.0, 20.0, 400.0}) {
    const Species ions = ions_of(silicon_alone + "[[step.ion]]\nenergy_deviation = \"0 eV\"\n" +
                                 "source_power = " + std::to_string(n) + "\n");
    // cos + 9.3 cos - 9.3 cos^3
    const double mean = 10.3 * (n + 1) / (n + 2) - 9.3 * (n + 1) / (n + 4);
    const double strength = std::sqrt(100.0) - std::sqrt(20.0);
    EXPECT_NEAR(flat(ions), strength * mean, 1e-3 * strength * mean) << n;
  }
}

// On a turning wafer a wall gets the mean of cos(phi) over half of the azimuths.
TEST(OpenResponse, OfATurningWaferIsTheMeanOverAzimuths) {
  const std::string keys = silicon_alone + "sputter_factor = -1\n" + parallel +
                           "tilt = \"35 deg\"\nenergy_deviation = \"0 eV\"\n";
  const Species turning = ions_of(keys + "rotating = true\n");
  const Species still = ions_of(keys);
  EXPECT_NEAR(flat(turning), flat(still), 1e-3 * flat(still));
  // With B = -1 the yield is cos^3: of a wall tan(35 deg) times the mean of cos(phi)^4 over all
  // azimuths with cos(phi) > 0, 3 / 16, times sin^3, over cos of the tilt for the plane's flux.
  const double strength = std::sqrt(100.0) - std::sqrt(20.0);
  const double expected =
      strength * std::pow(std::sin(35 * degree), 4) / std::cos(35 * degree) * 3.0 / 16;
  const OpenResponse response(turning, turning.yields.front());
  EXPECT_NEAR(response.at({1, 0, 0}), expected, 5e-3 * expected);
  EXPECT_NEAR(response.at({0.6, 0.8, 0}), expected, 5e-3 * expected);
  EXPECT_NEAR(response.factor().value({1, 0, 0}), expected, 5e-3 * expected);
}

class SputterPoint : public ModelAtPoint {
 public:
  SputterPoint(const std::string& model, const std::string& keys,
               const std::string& material = "Si", Vec3f normal = {0, 0, 1})
      : ModelAtPoint(model, keys, material, normal) {}

  /// Tallies of what comes from above, beams left out; what arrives of sputtered atoms, and the
  /// part from which the source is seen.
  SputterPoint& under(std::vector<float> from_above, float sputtered = 0, float seen = 1) {
    tallies_ = std::move(from_above);
    for (const Species& each : species()) {
      if (each.source.kind == SourceLobe::Kind::beam) tallies_.insert(tallies_.end(), {0, seen});
      if (each.source.kind == SourceLobe::Kind::none) tallies_.push_back(sputtered);
    }
    return *this;
  }
};

TEST(IonMilling, EtchesAnOpenWaferAtTheRate) {
  for (const std::string ion :
       {"", "[[step.ion]]\nsource_power = 20\ntilt = \"35 deg\"\nrotating = true\n"}) {
    SputterPoint point("ion_milling", silicon_alone + ion);
    const auto yield = static_cast<float>(flat(ions_of(silicon_alone + ion)));
    EXPECT_FLOAT_EQ(point.under({1, yield}).speed(), -2);
    EXPECT_FLOAT_EQ(point.under({1, yield / 4}).speed(), -0.5);
    SputterPoint oxide("ion_milling", silicon_alone + ion, "SiO2");
    EXPECT_EQ(oxide.under({1, yield}).speed(), 0);
  }
}

TEST(IonMilling, IonsOfSeveralKindsShareTheRate) {
  const std::string keys =
      silicon_alone + "[[step.ion]]\nshare = 3\n[[step.ion]]\nenergy = \"400 eV\"\n";
  SputterPoint point("ion_milling", keys);
  const std::vector<Species> species = point.model().species();
  ASSERT_EQ(species.size(), 4U);
  EXPECT_EQ(species[1].yields.front().name, "sputter_Si_2");
  const auto first = static_cast<float>(flat(species[0]));
  const auto second = static_cast<float>(flat(species[1]));
  EXPECT_FLOAT_EQ(point.under({1, first, 1, second}).speed(), -2);
  EXPECT_FLOAT_EQ(point.under({1, first, 0, 0}).speed(), -1.5);
}

TEST(IonMilling, MaterialsHaveYieldsOfTheirOwn) {
  const std::string keys =
      "etch_rate = { Si = \"2 nm/s\", SiO2 = \"1 nm/s\" }\n"
      "sputter_factor = { Si = 9.3, SiO2 = 2 }\n";
  const Species ions = ions_of(keys);
  ASSERT_EQ(ions.yields.size(), 2U);
  SputterPoint oxide("ion_milling", keys, "SiO2");
  const auto yield = static_cast<float>(OpenResponse(ions, ions.yields[1]).flat());
  EXPECT_FLOAT_EQ(oxide.under({1, 100, yield}).speed(), -1);
  EXPECT_EQ(ions_of("etch_rate = \"1 nm/s\"\n").yields.size(), 1U);
  EXPECT_EQ(ions_of("etch_rate = \"1 nm/s\"\nthreshold = { Si = \"20 eV\", SiO2 = \"30 eV\" }\n")
                .yields.size(),
            2U);
}

// The form of 10.1109/SISPAD62626.2024.10733316 with the numbers of a blazed grating.
TEST(IonMilling, TakesAPolynomialOrATableOfTheAngle) {
  const Species milling =
      ions_of(silicon_alone + "angular_polynomial = [[1, 1.075], [2, -1.55], [3, 0.65]]\n");
  const Species by_table = ions_of(
      silicon_alone + "angular_table = [[\"0 deg\", 2], [\"60 deg\", 6], [\"90 deg\", 0]]\n");
  const auto factor = [](const Species& ions, double theta) {
    return ions.yields.front().factor.at(std::sin(theta * degree / 2));
  };
  for (const auto& [theta, value] : {std::pair{0.0, 1.0},
                                     {30.0, 1.0895},
                                     {45.0, 1.2283},
                                     {59.26, 1.3218},
                                     {70.0, 1.2135},
                                     {80.0, 0.8191}})
    EXPECT_NEAR(factor(milling, theta), value, 1e-3) << theta;
  EXPECT_NEAR(factor(by_table, 60), 3, 1e-3);
  EXPECT_NEAR(factor(by_table, 30), 2, 1e-3);
}

// As many atoms as the rate times the density; what settles is divided by that of the film.
TEST(IonMilling, WhatIsSputteredSettlesAsAFilm) {
  const std::string keys =
      "etch_rate = { Si = \"2 nm/s\", SiO2 = \"1 nm/s\" }\nmaterial = \"SiO2\"\n"
      "redeposition_sticking = { Si = 0.5, SiO2 = 1 }\n";
  const StepModel step = read_step("ion_milling", keys);
  EXPECT_EQ(step.deposits, Materials().id("SiO2"));
  const std::vector<Species> species = step.model->species();
  ASSERT_EQ(species.size(), 3U);
  EXPECT_EQ(species[2].source.kind, SourceLobe::Kind::none);
  EXPECT_EQ(species[2].sticking[Materials().id("Si")], 0.5F);
  const auto yield = static_cast<float>(flat(ions_of(keys)));
  const double unit = 2 * 5.02;  // of the fastest material
  SputterPoint silicon("ion_milling", keys);
  SputterPoint oxide("ion_milling", keys, "SiO2");
  EXPECT_FLOAT_EQ(silicon.under({1, yield}).emission(), 1);
  EXPECT_FLOAT_EQ(silicon.speed(), -2);
  EXPECT_FLOAT_EQ(oxide.under({1, yield}).emission(), 2.2 / unit);
  // Less settles than leaves: the material goes; more: the film grows.
  EXPECT_FLOAT_EQ(silicon.under({1, yield}, 1).speed(), -2 * 0.5);
  EXPECT_FLOAT_EQ(silicon.under({0, 0}, 1).speed(), 0.5 * unit / 2.2);
  EXPECT_FLOAT_EQ(oxide.under({0, 0}, 1).speed(), unit / 2.2);
  EXPECT_FLOAT_EQ(silicon.emission(), 0);
  // Without a film atoms are gone.
  EXPECT_EQ(read_step("ion_milling", silicon_alone).model->species().size(), 2U);
  EXPECT_EQ(read_step("ion_milling", silicon_alone).model->emitter(), nullptr);
}

// speeds() is the first part plus the factor times its amplitude, of a part in sight between 0 and
// 1; what is more was reflected.
TEST(IonMilling, PartsOfTheSpeedAddUp) {
  const std::string keys =
      "etch_rate = \"2 nm/s\"\nmaterial = \"SiO2\"\nsputter_factor = { Si = 9.3, SiO2 = 2 }\n";
  const Vec3f normal = Vec3f(at_angle(50));
  SputterPoint point("ion_milling", keys, "Si", normal);
  const std::vector<AngularFactor> factors = point.model().angular().factors();
  ASSERT_EQ(factors.size(), 2U);
  const float open = factors[0].value(normal);
  double unit_amplitude = 0;
  for (const auto& [part, seen] :
       {std::pair{1.0F, 1.0F}, {0.25F, 0.25F}, {3.0F, 1.0F}, {0.0F, 0.0F}}) {
    for (const float settles : {0.0F, 0.3F, 20.0F}) {
      point.under({1, part * open, 0}, settles);
      const std::vector<float> parts = point.amplitudes();
      ASSERT_EQ(parts.size(), 3U);
      EXPECT_NEAR(parts[0] + parts[1] * open, point.speed(), 1e-5 * (1 + std::abs(point.speed())));
      EXPECT_EQ(parts[2], 0);
      if (settles > 0) continue;
      if (unit_amplitude == 0) unit_amplitude = parts[1];
      EXPECT_NEAR(parts[1], seen * unit_amplitude, 1e-5 * std::abs(unit_amplitude));
    }
  }
}

// A wall along the ions gets next to nothing, whether it sees them or not: a beam tells.
TEST(IonMilling, WallsAlongTheIonsTurnIfTheyAreInSight) {
  SputterPoint wall("ion_milling", silicon_alone + parallel, "Si", {1, 0, 0});
  SputterPoint top("ion_milling", silicon_alone + parallel);
  const float yield = top.model().angular().factors()[0].value({0, 0, 1});
  const float whole = top.under({1, yield}).amplitudes()[1];
  EXPECT_FLOAT_EQ(wall.under({0, 0}, 0, 1).amplitudes()[1], whole);
  EXPECT_FLOAT_EQ(wall.under({0, 0}, 0, 0.5).amplitudes()[1], 0.5 * whole);
  EXPECT_EQ(wall.under({0, 0}, 0, 0).amplitudes()[1], 0);
  // Their axis lies in the cross-section; where the wafer turns ions reach all walls.
  const auto axis = [](const std::string& keys) {
    const auto species =
        read_step("ion_milling", silicon_alone + "[[step.ion]]\n" + keys, true).model->species();
    return species.size() > 1 ? species[1].source.direction : Vec3d{};
  };
  EXPECT_EQ(axis("tilt = \"30 deg\"\nazimuth = \"90 deg\"\n"), (Vec3d{0, 0, -1}));
  EXPECT_NEAR(axis("tilt = \"30 deg\"\n").x, 0.5, 1e-12);
  EXPECT_EQ(axis("tilt = \"30 deg\"\nrotating = true\n"), Vec3d{});
  EXPECT_EQ(axis("rotating = true\n"), (Vec3d{0, 0, -1}));
}

// So do slopes that get less than a twentieth of the best; of others what they get tells.
TEST(IonMilling, SlopesThatIonsGrazeTurnIfTheyAreInSight) {
  const std::string keys = silicon_alone + parallel;
  SputterPoint top("ion_milling", keys);
  const AngularFactor factor = top.model().angular().factors()[0];
  const float whole = top.under({1, factor.value({0, 0, 1})}).amplitudes()[1];
  const auto slope_with = [&](double part) {
    double low = 60;
    double high = 90;
    for (int n = 0; n < 50; ++n) {
      const double middle = 0.5 * (low + high);
      const bool has_more = factor.value(Vec3f(at_angle(middle))) > part * factor.bounds().value;
      (has_more ? low : high) = middle;
    }
    return Vec3f(at_angle(low));
  };
  // In sight by nine tenths, but of what the source would bring only a half arrives.
  for (const auto& [part, seen] : {std::pair{0.06, 0.5F}, {0.04, 0.9F}}) {
    const Vec3f normal = slope_with(part);
    SputterPoint slope("ion_milling", keys, "Si", normal);
    const float found = slope.under({0, 0.5F * factor.value(normal)}, 0, 0.9F).amplitudes()[1];
    EXPECT_NEAR(found, seen * whole, 1e-4 * std::abs(whole)) << part;
  }
}

TEST(IonMilling, LeansWithItsIons) {
  EXPECT_TRUE(read_step("ion_milling", silicon_alone).model->angular().is_mirror_symmetric(0));
  const std::string tilted = silicon_alone + "[[step.ion]]\ntilt = \"35 deg\"\n";
  EXPECT_FALSE(read_step("ion_milling", tilted).model->angular().is_mirror_symmetric(0));
  EXPECT_TRUE(read_step("ion_milling", tilted).model->angular().is_mirror_symmetric(1));
  EXPECT_TRUE(read_step("ion_milling", tilted + "rotating = true\n")
                  .model->angular()
                  .is_mirror_symmetric(0));
}

TEST(IonMilling, SaysWhatIsWrong) {
  const auto expect = [](const std::string& keys, const std::string& message) {
    EXPECT_THAT([&] { read_step("ion_milling", keys); },
                ThrowsMessage<InputError>(HasSubstr(message)))
        << keys;
  };
  expect("", "step[0].etch_rate: missing");
  expect("etch_rate = { Si = \"1 nm/s\" }\n", "no value for SiO2");
  expect("etch_rate = \"-1 nm/s\"\n", "step[0].etch_rate");
  expect("etch_rate = \"1 nm/s\"\nthreshold = \"500 eV\"\n",
         "step[0].threshold: no ion has as much energy, so none makes the etch rate of Si; lower");
  expect(silicon_alone +
             "threshold = \"50 eV\"\n[[step.ion]]\n[[step.ion]]\nenergy = \"20 eV\"\n"
             "energy_deviation = \"0 eV\"\n",
         "step[0].threshold: ion[1] never has as much energy, so its share of the etch rate of Si");
  expect(silicon_alone + "redeposition_sticking = 0\n", "step[0].redeposition_sticking: 0 is");
  expect(silicon_alone + "angular_polynomial = [[1, 1], [2, -1]]\n",
         "step[0].angular_polynomial: is 0 for ions along the normal");
  expect(silicon_alone + "sputter_factor = 5\nangular_polynomial = [[1, 1]]\n",
         "step[0].sputter_factor: angular_polynomial and sputter_factor exclude each other");
  expect(silicon_alone + "[[step.ion]]\nshare = 0\n", "step[0].ion[0].share");
}

const std::string tantalum = "growth_rate = \"2 nm/s\"\nmaterial = \"Ta\"\n";
const std::string resputtered =
    tantalum + "resputter_amplitude = { Ta = 0.03, Si = 0.04, SiO2 = 0.02 }\n[[step.ion]]\n";

TEST(SputterDeposition, GrowsAtTheRateOfAnOpenWafer) {
  const StepModel step = read_step("sputter_deposition", tantalum);
  EXPECT_EQ(step.deposits, Materials().id("Ta"));
  EXPECT_EQ(step.model->species().size(), 1U);
  EXPECT_TRUE(step.model->angular().factors().empty());
  const std::string half_sticks = tantalum + "sticking = { Ta = 0.5, default = 0.25 }\n";
  // Tallies of ions are none, those of atoms come first.
  SputterPoint film("sputter_deposition", half_sticks, "Ta");
  SputterPoint silicon("sputter_deposition", half_sticks);
  EXPECT_FLOAT_EQ(film.under({1}).speed(), 2);
  EXPECT_FLOAT_EQ(film.under({0.5}).speed(), 1);
  EXPECT_FLOAT_EQ(silicon.under({1}).speed(), 1);
}

// 1 x 0.03 (sqrt(100) - sqrt(20)) 1e15 atoms per cm2 and s are sputtered, 5.46 x 2 arrive.
TEST(SputterDeposition, IonsTakeAwayWhatTheySputter) {
  SputterPoint film("sputter_deposition", resputtered, "Ta");
  SputterPoint silicon("sputter_deposition", resputtered);
  const double rho = Materials()[Materials().id("Ta")].density;
  const float strength = static_cast<float>(std::sqrt(100.0) - std::sqrt(20.0));
  EXPECT_NEAR(film.under({1, 1, strength}).speed(), 2 - 0.03 * strength / rho, 1e-5);
  EXPECT_NEAR(film.under({1, 1, strength}, 0.1F).speed(), 2.2 - 0.03 * strength / rho, 1e-5);
  EXPECT_NEAR(film.emission(), 0.03 * strength / (2 * rho), 1e-6);
  // What is below goes by its own density once more leaves than arrives.
  EXPECT_NEAR(silicon.under({0, 1, strength}).speed(), -0.04 * strength / 5.02, 1e-5);
  const std::vector<Species> species = film.model().species();
  ASSERT_EQ(species.size(), 4U);  // atoms, ions, their axis, sputtered atoms
  EXPECT_EQ(species[3].source.kind, SourceLobe::Kind::none);
}

TEST(SputterDeposition, AtomsComeAsTheRecipeSays) {
  const Species atoms = read_step("sputter_deposition",
                                  tantalum +
                                      "source_power = 7\ntilt = \"30 deg\"\nrotating = true\n"
                                      "source_map = [[\"-60 nm\", 1], [\"60 nm\", 3]]\n",
                                  true)
                            .model->species()[0];
  EXPECT_EQ(atoms.source.cosine_power, 7);
  EXPECT_TRUE(atoms.source.rotating);
  EXPECT_NEAR(atoms.source.direction.x, 0.5, 1e-12);
  EXPECT_FALSE(atoms.source.map.empty());
}

TEST(SputterDeposition, SaysWhatIsWrong) {
  const auto expect = [](const std::string& keys, const std::string& message) {
    EXPECT_THAT([&] { read_step("sputter_deposition", keys); },
                ThrowsMessage<InputError>(HasSubstr(message)))
        << keys;
  };
  expect("material = \"Ta\"\n", "step[0].growth_rate: missing");
  expect("growth_rate = \"1 nm/s\"\n", "step[0].material: missing");
  expect("growth_rate = \"0 nm/s\"\nmaterial = \"Ta\"\n", "step[0].growth_rate");
  expect(tantalum + "sticking = 0\n", "step[0].sticking: 0 is outside");
  expect(tantalum + "[[step.ion]]\n", "step[0].resputter_amplitude: missing");
}

}  // namespace
}  // namespace scarp
