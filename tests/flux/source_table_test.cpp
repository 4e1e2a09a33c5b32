// Sources whose angles and energies are tables, with all engines.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "core/running_statistics.h"
#include "tests/flux/direct_flux.h"
#include "tests/flux/ion_traces.h"
#include "tests/flux/polar_tables.h"

namespace scarp {
namespace {

using exact::degree;
using exact::Shape;
using Engine = FluxOptions::Engine;

struct Arrival {
  const char* name;
  Engine engine;
  bool ions;
  bool two_dimensional;
};

class TabulatedCosine : public ::testing::TestWithParam<Arrival> {};

// In the same places a table of cos^20 finds what the closed form of cos^20 says. A quarter of a
// degree leaves 20 / 8 (1 / 229)^2 of error between the rows, and fewer than 3e-4 on facets.
TEST_P(TabulatedCosine, GivesTheFluxOfThePower) {
  constexpr double power = 20;
  const Shape shape = exact::trench(4, 4, 8, 40);
  Species species{.name = "any", .source = {.table = exact::power_cosine_table(power)}};
  if (GetParam().ions) species.ions = Ions{};
  constexpr int seeds = 6;
  std::vector<FluxField> runs;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    runs.push_back(exact::trace(shape, species,
                                {.engine = GetParam().engine,
                                 .two_dimensional = GetParam().two_dimensional,
                                 .rays = 1 << 16,
                                 .seed = seed}));
  }
  const auto normals = facet_normals(shape.mesh);
  double squares = 0;
  double sum = 0;
  int count = 0;
  for (std::size_t f = 0; f < normals.size(); ++f) {
    RunningStatistics found;
    double stated = 0;
    for (const FluxField& run : runs) {
      found.add(run.arrivals().mean[f]);
      stated += std::pow(run.arrivals().std_error[f] / seeds, 2);
    }
    const auto [a, b, c] = corners(shape.mesh, f);
    if (a.z + b.z + c.z > -1e-6) {
      EXPECT_NEAR(found.mean(), 1, 5 * std::sqrt(stated) + 1e-6);
      continue;
    }
    // The mean over a facet by the three middles of its edges, right for quadratic functions.
    double exact = 0;
    for (const Vec3d r : {0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)})
      exact += exact::direct_trench_flux(r, Vec3d(normals[f]), power) / 3;
    if (exact < 0.02) continue;  // too few arrive for a normal distribution
    const double z = (found.mean() - exact) / (std::sqrt(stated) + 1e-3 * exact);
    EXPECT_LT(std::abs(z), 6) << f;
    squares += z * z;
    sum += z;
    ++count;
  }
  ASSERT_GT(count, 50);
  EXPECT_LT(squares / count, 1 + 5 * std::sqrt(2.0 / count));
  EXPECT_NEAR(sum / count, 0, 5 / std::sqrt(count));
}

INSTANTIATE_TEST_SUITE_P(
    Engines, TabulatedCosine,
    ::testing::Values(Arrival{"forward", Engine::forward, false, false},
                      Arrival{"gather", Engine::gather, false, false},
                      Arrival{"first_arrivals", Engine::gather, true, false},
                      Arrival{"gather_cross_section", Engine::gather, false, true},
                      Arrival{"forward_cross_section", Engine::forward, false, true}),
    [](const auto& info) { return info.param.name; });

/// Energies, and how they are spread: by x even in (-1, 1), with a weight.
struct Plasma {
  EnergyDistribution energy;
  std::function<double(double x)> at;
  std::function<double(double x)> weight;
};

std::vector<Plasma> plasmas() {
  return {{.energy = EnergyDistribution::bimodal(100, 60),
           .at = [](double x) { return 100 + 30 * std::sin(exact::right_angle * x); },
           .weight = [](double) { return 1.0; }},
          {.energy = EnergyDistribution::tabulated(std::array{40.0, 80.0, 120.0},
                                                   std::array{0.0, 7.0, 0.0}),
           .at = [](double x) { return 80 + 40 * x; },
           .weight = [](double x) { return 1 - std::abs(x); }}};
}

class MeanYield : public ::testing::TestWithParam<std::tuple<std::size_t, Engine>> {};

// On an open flat wafer a yield is its mean over energies times that over angles.
TEST_P(MeanYield, OnAFlatWaferIsThatOfTheDistributions) {
  const auto& [index, engine] = GetParam();
  const Plasma plasma = plasmas()[index];
  const auto lobe = [](double theta) { return std::exp(-std::pow(theta / (20 * degree), 2)); };
  const auto angular = [](double theta) {
    return std::cos(theta) * (1 + 9.3 * std::pow(std::sin(theta), 2));
  };
  const YieldLaw law{.name = "y", .amplitude = 2, .threshold = 90, .factor = AngleTable(angular)};
  const Species ions{.name = "ion",
                     .source = {.table = exact::polar_table(lobe)},
                     .ions = Ions{.energy = plasma.energy},
                     .yields = {law}};
  constexpr int steps = 100'000;
  double strength = 0;
  double norm = 0;
  for (int k = 0; k < steps; ++k) {
    const double x = 2 * (k + 0.5) / steps - 1;
    norm += plasma.weight(x);
    strength += plasma.weight(x) * law.strength(plasma.at(x));
  }
  const double expected = strength / norm * exact::polar_mean(lobe, angular);

  const Shape wafer = exact::flat_wafer(20, 4);
  const FluxField flux = exact::trace(wafer, ions, {.engine = engine, .rays = 1 << 17, .seed = 3});
  const exact::Mean mean = exact::mean_of(wafer.mesh, flux.tallies[1], exact::everywhere);
  EXPECT_NEAR(mean.value, expected, 4 * mean.error + 3e-4 * expected);
  EXPECT_LT(mean.error, 1e-2 * expected);
}

INSTANTIATE_TEST_SUITE_P(Energies, MeanYield,
                         ::testing::Combine(::testing::Values(0U, 1U),
                                            ::testing::Values(Engine::forward, Engine::gather)));

}  // namespace
}  // namespace scarp
