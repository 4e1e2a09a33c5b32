#include "flux/source_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "core/running_statistics.h"
#include "tests/flux/ion_traces.h"

namespace scarp {
namespace {

using exact::Shape;
using testing::HasSubstr;
using testing::ThrowsMessage;
using Engine = FluxOptions::Engine;

const Sides square{.lower = {-10, -10}, .upper = {10, 10}};

TEST(SourceMap, IsBilinearOverItsMean) {
  // 1 + x / 20 + y / 10 + x y / 200, on lines that reach beyond the domain.
  const std::array x{-30.0, 0.0, 40.0};
  const std::array y{-10.0, 20.0};
  std::vector<double> density;
  const auto exact = [](double at_x, double at_y) {
    return 3 + at_x / 20 + at_y / 10 + at_x * at_y / 200;
  };
  for (const double at_x : x)
    for (const double at_y : y) density.push_back(exact(at_x, at_y));
  const SourceMap map(x, y, density, square);
  for (const double at_x : {-10.0, -3.0, 0.0, 7.0, 10.0})
    for (const double at_y : {-10.0, 1.0, 10.0})
      EXPECT_NEAR(map.at((at_x + 10) / 20, (at_y + 10) / 20), exact(at_x, at_y) / 3, 1e-12);
}

TEST(SourceMap, GivesPlacesOfItsDensity) {
  const std::array x{-10.0, -4.0, 3.0, 10.0};
  const std::array y{-10.0, 2.0, 10.0};
  const std::array density{0.0, 1.0, 0.0, 2.0, 1.0, 5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0};
  const SourceMap map(x, y, density, square);
  // Means over places against integrals over the map.
  const auto functions = {+[](double a, double) { return a; }, +[](double, double b) { return b; },
                          +[](double a, double b) { return a * b; },
                          +[](double a, double b) { return a * a * b * b; },
                          +[](double a, double b) { return std::cos(9 * a) * std::sin(7 * b); }};
  RandomStream random({.seed = 1});
  for (const auto& function : functions) {
    RunningStatistics drawn;
    for (int k = 0; k < 100'000; ++k) {
      const double xi1 = random.uniform();
      const auto [a, b] = map.place({xi1, random.uniform()});
      drawn.add(function(a, b));
    }
    double integral = 0;
    double norm = 0;
    constexpr int steps = 500;
    for (int i = 0; i < steps; ++i) {
      for (int j = 0; j < steps; ++j) {
        const double a = (i + 0.5) / steps;
        const double b = (j + 0.5) / steps;
        norm += map.at(a, b);
        integral += map.at(a, b) * function(a, b);
      }
    }
    EXPECT_NEAR(norm / (steps * steps), 1, 1e-4);
    EXPECT_NEAR(drawn.mean(), integral / norm, 4.5 * drawn.std_error());
  }
}

TEST(SourceMap, MayVaryAlongXOnly) {
  const SourceMap map(std::array{-10.0, 10.0}, {}, std::array{0.0, 1.0}, square);
  EXPECT_DOUBLE_EQ(map.at(0.25, 0.9), 0.5);
  EXPECT_DOUBLE_EQ(map.place({0.25, 0.7})[0], 0.5);
  EXPECT_DOUBLE_EQ(map.place({0.25, 0.7})[1], 0.7);
}

TEST(SourceMap, RefusesWhatIsNone) {
  const auto make = [](const std::vector<double>& x, const std::vector<double>& y,
                       const std::vector<double>& density) {
    return [=] { SourceMap(x, y, density, square); };
  };
  EXPECT_NO_THROW(make({-10, 10}, {-10, 10}, {1, 1, 1, 1})());
  EXPECT_THAT(make({-9, 10}, {}, {1, 1}),
              ThrowsMessage<InputError>(HasSubstr("along x from -10 nm to 10 nm")));
  EXPECT_THAT(make({-10}, {}, {1}), ThrowsMessage<InputError>(HasSubstr("along x")));
  EXPECT_THAT(make({-10, 10}, {-10, 9}, {1, 1, 1, 1}),
              ThrowsMessage<InputError>(HasSubstr("along y from -10 nm to 10 nm")));
  EXPECT_THAT(make({10, -10}, {}, {1, 1}), ThrowsMessage<InputError>(HasSubstr("ascend")));
  EXPECT_THAT(make({-10, 10}, {}, {1, -1}), ThrowsMessage<InputError>(HasSubstr("negative")));
  EXPECT_THAT(make({-10, 10}, {}, {0, 0}), ThrowsMessage<InputError>(HasSubstr("zero everywhere")));
  // Nothing within the domain.
  EXPECT_THAT(make({-20, -10, 10, 20}, {}, {1, 0, 0, 1}),
              ThrowsMessage<InputError>(HasSubstr("zero everywhere")));
}

struct Wafer {
  const char* name;
  Engine engine;
  Boundary boundary;
  bool ions = false;
  bool two_dimensional = false;
};

class MappedSource : public ::testing::TestWithParam<Wafer> {};

// Seen from a flat wafer at a distance h a Lambert source spreads by h^2 / (2 (h^2 + d^2)^(3/2)), d
// away along x. Sides fold or wrap it.
TEST_P(MappedSource, OnAFlatWaferIsSpreadByTheDistanceToTheSource) {
  const Wafer& c = GetParam();
  constexpr double width = 20;
  Shape wafer = exact::flat_wafer(width, 10);
  wafer.sides.boundary = {c.boundary, c.boundary};
  Species species{.name = "any"};
  species.source.map = SourceMap(std::array{0.0, width}, {}, std::array{0.5, 1.5}, wafer.sides);
  if (c.ions) species.ions = Ions{};
  FluxOptions options{.engine = c.engine, .two_dimensional = c.two_dimensional, .rays = 1 << 18};
  options.sides.boundary = wafer.sides.boundary;
  const FluxField flux = exact::trace(wafer, species, options);

  const auto density = [&](double x) {
    const double cell = std::floor(x / width);
    double inside = x - cell * width;
    const bool mirrored = c.boundary == Boundary::reflective && std::fmod(std::abs(cell), 2) == 1;
    if (mirrored) inside = width - inside;
    return 0.5 + inside / width;
  };
  // d = tan(phi): the kernel is cos(phi) / 2 there.
  const auto expected = [&](double x) {
    constexpr int steps = 4000;
    double sum = 0;
    for (int k = 0; k < steps; ++k) {
      const double phi = std::numbers::pi * ((k + 0.5) / steps - 0.5);
      sum += std::cos(phi) / 2 * density(x + std::tan(phi)) * std::numbers::pi / steps;
    }
    return sum;
  };
  double squares = 0;
  int count = 0;
  double absorbed = 0;
  for (std::size_t f = 0; f < wafer.mesh.triangles.size(); ++f) {
    const auto [a, b, d] = corners(wafer.mesh, f);
    double exact = 0;
    for (const Vec3d r : {0.5 * (a + b), 0.5 * (b + d), 0.5 * (d + a)}) exact += expected(r.x) / 3;
    const double mean = flux.arrivals().mean[f];
    // Facets bend with the kernel: 2 across they are off by less than this beside a side.
    const double z = (mean - exact) / (flux.arrivals().std_error[f] + 2e-3);
    EXPECT_LT(std::abs(z), 5) << f << " " << mean << " " << exact;
    squares += z * z;
    ++count;
    absorbed += mean / static_cast<double>(wafer.mesh.triangles.size());
  }
  EXPECT_LT(squares / count, 1 + 5 * std::sqrt(2.0 / count));
  // The mean is that of an even source.
  EXPECT_NEAR(flux.audit.absorbed / flux.audit.emitted, 1, 4 * flux.audit.balance_std_error + 1e-6);
  EXPECT_NEAR(absorbed, 1, 4 * flux.audit.balance_std_error + 2e-6);
}

INSTANTIATE_TEST_SUITE_P(
    Engines, MappedSource,
    ::testing::Values(Wafer{"forward", Engine::forward, Boundary::reflective},
                      Wafer{"forward_periodic", Engine::forward, Boundary::periodic},
                      Wafer{"gather", Engine::gather, Boundary::reflective},
                      Wafer{"gather_periodic", Engine::gather, Boundary::periodic},
                      Wafer{"first_arrivals", Engine::gather, Boundary::reflective, true},
                      Wafer{"cross_section", Engine::gather, Boundary::reflective, false, true},
                      Wafer{"forward_cross_section", Engine::forward, Boundary::periodic, false,
                            true}),
    [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace scarp
