// A billion flights over random surfaces, none of which slips through.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/random.h"
#include "flux/solve.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

const Grid grid{.cells = {48, 40, 56}};

// Waves of any direction, so that walls overhang and voids are closed: as marching cubes give it,
// with slivers.
TriMesh spongy_surface(std::uint64_t seed) {
  constexpr int waves = 8;
  RandomStream random({.seed = seed});
  struct Wave {
    Vec3d k;
    double phase;
  };
  std::array<Wave, waves> all;
  for (Wave& wave : all) {
    const auto number = [&] { return 0.7 * (2 * random.uniform() - 1); };
    const double x = number();
    const double y = number();
    wave = {{x, y, number()}, 2 * std::numbers::pi * random.uniform()};
  }
  return polygonised(grid, [&](Vec3d r) {
    double sum = 0;
    for (const Wave& wave : all) sum += std::sin(dot(wave.k, r) + wave.phase);
    return r.z - 28.3 + 3.5 * sum;
  });
}

TEST(SlowLoss, IsNothingOverABillionFlights) {
  constexpr std::uint64_t enough = 1'000'000'000;
  std::uint64_t segments = 0;
  for (std::uint64_t seed = 1; segments < enough; ++seed) {
    const TriMesh mesh = spongy_surface(seed);
    const Species species{.name = "gas", .sticking = {seed % 2 == 0 ? 0.1F : 0.02F}};
    const FluxField flux = solve_flux(mesh, {&species, 1},
                                      {.engine = FluxOptions::Engine::forward,
                                       .sides = grid.sides(),
                                       .spacing = 1,
                                       .rays = 1 << 22,
                                       .seed = seed})
                               .front();
    segments += flux.segments;
    ASSERT_EQ(flux.audit.lost(), 0) << "seed " << seed;
    ASSERT_EQ(flux.audit.absorbed + flux.audit.escaped - flux.audit.roulette, flux.audit.emitted);
  }
}

}  // namespace
}  // namespace scarp
