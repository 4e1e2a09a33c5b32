// Yields and sticking that are tables, with all engines.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/error.h"
#include "tests/flux/ion_traces.h"
#include "tests/flux/polar_tables.h"

namespace scarp {
namespace {

using exact::degree;
using exact::Shape;
using Engine = FluxOptions::Engine;

/// A law by a table in steps of an eV.
YieldLaw tabulated(const YieldLaw& law, double largest_energy) {
  YieldLaw table{.name = law.name};
  for (double E = 0; E < largest_energy + 1; ++E) {
    table.table.push_back({E, AngleTable([&](double theta) {
                             return law.at(E, AngleTable::half_sine(std::cos(theta)));
                           })});
  }
  return table;
}

TEST(YieldTable, IsLinearInTheEnergyAndInTheAngle) {
  const AngleTable none(0);
  const AngleTable some([](double theta) { return theta; });
  const AngleTable more([](double theta) { return 3 * theta; });
  const YieldLaw law{.name = "y", .table = {{20, none}, {30, none}, {50, some}, {90, more}}};
  const double at = AngleTable::half_sine(std::cos(0.5));
  EXPECT_EQ(law.at(10, at), 0);
  EXPECT_EQ(law.at(30, at), 0);
  EXPECT_NEAR(law.at(40, at), 0.25, 1e-5);
  EXPECT_NEAR(law.at(50, at), 0.5, 1e-5);
  EXPECT_NEAR(law.at(80, at), 1.25, 1e-5);
  EXPECT_EQ(law.least_energy(), 30);
  EXPECT_NEAR(law.largest(40), exact::right_angle, 1e-5);
  EXPECT_NEAR(law.largest(51), 3 * exact::right_angle, 1e-5);
  // Energies evenly from 40 to 60 eV.
  const MeanYield mean(law,
                       EnergyDistribution::tabulated(std::array{40.0, 60.0}, std::array{1., 1.}));
  EXPECT_NEAR(mean.at(at), (0.5 * (0.25 + 0.5) + 0.5 * (0.5 + 0.75)) / 2, 1e-4);
}

// The same rays and particles: only what lies between the rows differs, which is an eighth of the
// second derivative of the square root of an energy.
TEST(YieldTable, OfALawGivesTheYieldsOfTheLaw) {
  const Shape shape = exact::trench(2);
  const Species ions = exact::plasma_ions();
  Species by_table = ions;
  by_table.yields[0] = tabulated(ions.yields[0], ions.ions->energy.largest());
  for (const Engine engine : {Engine::forward, Engine::gather}) {
    const FluxOptions options{.engine = engine, .rays = 1 << 15};
    const FluxField law = exact::trace(shape, ions, options);
    const FluxField table = exact::trace(shape, by_table, options);
    EXPECT_EQ(table.arrivals().mean, law.arrivals().mean);
    for (std::size_t f = 0; f < shape.mesh.triangles.size(); ++f) {
      const double yield = law.tallies[1].mean[f];
      EXPECT_NEAR(table.tallies[1].mean[f], yield, 2e-3 * yield + 1e-5) << f;
    }
  }
}

// One that is no product, on a flat wafer: Y = sqrt(E) cos(theta sqrt(E) / 10).
TEST(YieldTable, OnAFlatWaferHasTheMeanOverEnergiesAndAngles) {
  const auto yield = [](double E, double theta) {
    return std::sqrt(E) * std::cos(theta * std::sqrt(E) / 10);
  };
  YieldLaw law{.name = "y"};
  for (double E = 0; E <= 100; ++E)
    law.table.push_back({E, AngleTable([&](double theta) { return yield(E, theta); })});
  const auto lobe = [](double theta) { return std::exp(-std::pow(theta / (30 * degree), 2)); };
  Species ions{.name = "ion",
               .source = {.table = exact::polar_table(lobe)},
               .ions = Ions{.energy = EnergyDistribution::tabulated(std::array{20.0, 100.0},
                                                                    std::array{1.0, 0.0})},
               .yields = {law}};
  double expected = 0;
  double norm = 0;
  for (double E = 20.25; E < 100; E += 0.5) {
    norm += 100 - E;
    expected += (100 - E) * exact::polar_mean(lobe, [&](double theta) { return yield(E, theta); });
  }
  expected /= norm;
  const Shape wafer = exact::flat_wafer(20, 4);
  for (const Engine engine : {Engine::forward, Engine::gather}) {
    const FluxField flux = exact::trace(wafer, ions, {.engine = engine, .rays = 1 << 17});
    const exact::Mean mean = exact::mean_of(wafer.mesh, flux.tallies[1], exact::everywhere);
    EXPECT_NEAR(mean.value, expected, 4 * mean.error + 3e-4 * expected);
    EXPECT_LT(mean.error, 5e-3 * expected);
  }
}

TEST(StickingTable, OfALawGivesTheFluxOfTheLaw) {
  const Shape shape = exact::trench(2);
  const Species ions = exact::plasma_ions();
  Species by_table = ions;
  by_table.ions->sticking =
      AngleTable::tabulated(std::array{0.0, 70 * degree, 90 * degree}, std::array{1.0, 1.0, 0.0});
  for (const Engine engine : {Engine::forward, Engine::gather}) {
    const FluxOptions options{.engine = engine, .rays = 1 << 15};
    const FluxField law = exact::trace(shape, ions, options);
    const FluxField table = exact::trace(shape, by_table, options);
    EXPECT_EQ(table.arrivals().mean, law.arrivals().mean);
  }
}

TEST(YieldTable, IsRefusedWhereItWouldBeGuessed) {
  using testing::HasSubstr;
  using testing::ThrowsMessage;
  const auto check = [](const std::vector<YieldLaw::AtEnergy>& table, double largest) {
    return [=] { YieldLaw{.name = "y", .table = table}.check(largest); };
  };
  EXPECT_NO_THROW(check({{0, 1}, {100, 2}}, 100)());
  EXPECT_NO_THROW(check({{20, 0}, {100, 2}}, 100)());
  EXPECT_THAT(check({{20, 1}, {100, 2}}, 100),
              ThrowsMessage<InputError>(HasSubstr("begins at 20 eV with a yield")));
  EXPECT_THAT(check({{0, 1}, {100, 2}}, 101),
              ThrowsMessage<InputError>(HasSubstr("ends at 100 eV, but ions of up to 101 eV")));
  EXPECT_THAT(check({{0, 1}, {0, 2}}, 0), ThrowsMessage<InputError>(HasSubstr("ascend")));
  EXPECT_THAT(check({{0, -1}, {9, 2}}, 0), ThrowsMessage<InputError>(HasSubstr("negative")));

  Species ions = exact::plasma_ions();
  ions.yields[0].table = {{0, 1}, {50, 1}};
  EXPECT_THAT([&] { exact::trace(exact::flat_wafer(20, 2), ions, {.rays = 1}); },
              ThrowsMessage<InputError>(HasSubstr("species ion: yield sputter ends at 50 eV")));
}

}  // namespace
}  // namespace scarp
