#include "levelset/bath/conduction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/parallel.h"

namespace scarp {
namespace {

/// A block of the lattice with links of 1, and a ground of the given conductance along z = 0.
ConductionNetwork block(std::array<int, 3> count, double ground) {
  ConductionNetwork network;
  const auto number = [&](int i, int j, int k) {
    return static_cast<std::uint32_t>((i * count[1] + j) * count[2] + k);
  };
  for (int i = 0; i < count[0]; ++i) {
    for (int j = 0; j < count[1]; ++j) {
      for (int k = 0; k < count[2]; ++k) {
        std::array<std::uint32_t, 6> neighbour{};
        neighbour.fill(ConductionNetwork::no_node);
        std::array<double, 6> conductance{};
        const std::array<std::array<int, 3>, 6> places{{{i - 1, j, k},
                                                        {i + 1, j, k},
                                                        {i, j - 1, k},
                                                        {i, j + 1, k},
                                                        {i, j, k - 1},
                                                        {i, j, k + 1}}};
        for (std::size_t d = 0; d < 6; ++d) {
          const int along = places[d][d / 2];
          if (along < 0 || along >= count[d / 2]) continue;
          neighbour[d] = number(places[d][0], places[d][1], places[d][2]);
          conductance[d] = 1;
        }
        network.place.push_back({i, j, k});
        network.neighbour.push_back(neighbour);
        network.conductance.push_back(conductance);
        network.ground.push_back(k == 0 ? ground : 0);
      }
    }
  }
  return network;
}

// A unit into each node of the far end of a rod goes through all of it.
TEST(Conduction, OfARodIsLinear) {
  const ConductionNetwork rod = block({2, 3, 40}, 0.5);
  std::vector<double> source(rod.size());
  for (std::size_t n = 0; n < rod.size(); ++n) source[n] = rod.place[n][2] == 39 ? 1 : 0;
  std::vector<double> potential(rod.size());
  solve_conduction(rod, source, potential);
  for (std::size_t n = 0; n < rod.size(); ++n)
    EXPECT_NEAR(potential[n], 2 + rod.place[n][2], 1e-8) << n;
}

// A cosine along x decays along z by the lattice's own dispersion: 2 cosh(q) = 4 - 2 cos(pi m / n).
TEST(Conduction, DecaysAsTheLatticeHasIt) {
  const ConductionNetwork plate = block({32, 1, 64}, 0.5);
  const double angle = 3 * std::numbers::pi / 32;
  const double decay = std::acosh(2 - std::cos(angle));
  std::vector<double> source(plate.size());
  const auto wave = [&](std::size_t n) { return std::cos(angle * (plate.place[n][0] + 0.5)); };
  for (std::size_t n = 0; n < plate.size(); ++n)
    if (plate.place[n][2] == 0) source[n] = (0.5 + std::exp(decay) - 1) * wave(n);
  std::vector<double> potential(plate.size());
  solve_conduction(plate, source, potential);
  for (std::size_t n = 0; n < plate.size(); ++n) {
    if (plate.place[n][2] >= 20) continue;
    EXPECT_NEAR(potential[n], wave(n) * std::exp(-decay * plate.place[n][2]), 1e-5) << n;
  }
}

// What goes in comes out, through links of very different strength.
TEST(Conduction, ConservesWhatFlows) {
  ConductionNetwork network = block({20, 20, 20}, 1e-3);
  for (std::size_t n = 0; n < network.size(); ++n)
    for (std::size_t d = 0; d < 6; ++d)
      if ((network.place[n][0] + network.place[n][1]) % 7 == 0 && d > 3)
        network.conductance[n][d] *= 1e-4;
  std::vector<double> source(network.size());
  for (std::size_t n = 0; n < network.size(); ++n) source[n] = static_cast<double>(n % 11);
  std::vector<double> potential(network.size());
  solve_conduction(network, source, potential);
  double in = 0;
  double out = 0;
  for (std::size_t n = 0; n < network.size(); ++n) {
    in += source[n];
    out += network.ground[n] * potential[n];
  }
  EXPECT_NEAR(out, in, 1e-7 * in);
}

TEST(Conduction, DoesNotDependOnTheNumberOfThreads) {
  const ConductionNetwork network = block({40, 30, 50}, 0.1);
  std::vector<double> source(network.size());
  for (std::size_t n = 0; n < network.size(); ++n) source[n] = static_cast<double>(n % 13);
  const auto solved = [&](int threads) {
    const ThreadLimit limit(threads);
    std::vector<double> potential(network.size());
    solve_conduction(network, source, potential);
    return potential;
  };
  EXPECT_EQ(solved(1), solved(4));
}

}  // namespace
}  // namespace scarp
