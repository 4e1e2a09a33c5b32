#include "levelset/bath/conduction.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 8192;
constexpr double wanted_change = 1e-12;  // of a potential, by what is left at its node
constexpr int most_iterations = 500;
constexpr int sweep_count = 2;
constexpr double damping = 0.8;  // of Jacobi sweeps: below 1 they leave nothing that alternates

using Values = std::vector<double>;

/// A network, what leaves each node per potential, and where it goes on the next coarser one.
struct Level {
  ConductionNetwork network;
  Values diagonal;
  std::vector<std::uint32_t> parent;
};

Values diagonal_of(const ConductionNetwork& network) {
  Values diagonal = network.ground;
  for (std::size_t n = 0; n < diagonal.size(); ++n)
    for (const double g : network.conductance[n]) diagonal[n] += g;
  return diagonal;
}

// Blocks of 2 x 2 x 2 nodes become one; numbers them in the order of their first nodes.
std::vector<std::uint32_t> parents_of(const ConductionNetwork& fine, ConductionNetwork& coarse) {
  std::array<std::size_t, 3> extent{};
  for (const auto& place : fine.place)
    for (std::size_t a = 0; a < 3; ++a)
      extent[a] = std::max(extent[a], static_cast<std::size_t>(place[a] / 2) + 1);
  std::vector<std::uint32_t> number(extent[0] * extent[1] * extent[2], ConductionNetwork::no_node);
  std::vector<std::uint32_t> parent;
  parent.reserve(fine.size());
  for (const auto& [i, j, k] : fine.place) {
    const auto block = (static_cast<std::size_t>(i / 2) * extent[1] + j / 2) * extent[2] + k / 2;
    if (number[block] == ConductionNetwork::no_node) {
      number[block] = static_cast<std::uint32_t>(coarse.size());
      coarse.place.push_back({i / 2, j / 2, k / 2});
    }
    parent.push_back(number[block]);
  }
  return parent;
}

// Links between two blocks add up, over twice the length: half of their sum.
ConductionNetwork coarser(const ConductionNetwork& fine, std::vector<std::uint32_t>& parent) {
  ConductionNetwork coarse;
  parent = parents_of(fine, coarse);
  std::array<std::uint32_t, 6> none{};
  none.fill(ConductionNetwork::no_node);
  coarse.neighbour.assign(coarse.size(), none);
  coarse.conductance.assign(coarse.size(), {});
  coarse.ground.assign(coarse.size(), 0);
  for (std::size_t n = 0; n < fine.size(); ++n) {
    const std::uint32_t block = parent[n];
    coarse.ground[block] += fine.ground[n];
    for (std::size_t d = 0; d < 6; ++d) {
      const std::uint32_t other = fine.neighbour[n][d];
      if (other == ConductionNetwork::no_node || parent[other] == block) continue;
      coarse.neighbour[block][d] = parent[other];
      coarse.conductance[block][d] += 0.5 * fine.conductance[n][d];
    }
  }
  return coarse;
}

std::vector<Level> levels_of(const ConductionNetwork& network) {
  std::vector<Level> levels;
  levels.push_back({network, diagonal_of(network), {}});
  while (levels.back().network.size() > 1) {
    Level& fine = levels.back();
    ConductionNetwork coarse = coarser(fine.network, fine.parent);
    Values diagonal = diagonal_of(coarse);
    levels.push_back({std::move(coarse), std::move(diagonal), {}});
  }
  return levels;
}

void for_each_node(std::size_t count, const auto& body) {
  parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) body(n);
  });
}

// What flows in from the neighbours.
double inflow(const ConductionNetwork& network, const Values& potential, std::size_t n) {
  double sum = 0;
  for (std::size_t d = 0; d < 6; ++d) {
    const std::uint32_t other = network.neighbour[n][d];
    if (other != ConductionNetwork::no_node) sum += network.conductance[n][d] * potential[other];
  }
  return sum;
}

Values residual_of(const Level& level, const Values& source, const Values& potential) {
  Values residual(source.size());
  for_each_node(source.size(), [&](std::size_t n) {
    residual[n] =
        source[n] + inflow(level.network, potential, n) - level.diagonal[n] * potential[n];
  });
  return residual;
}

double product(const Values& a, const Values& b) {
  return parallel_reduce(
      a.size(), grain, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t n = begin; n < end; ++n) sum += a[n] * b[n];
        return sum;
      },
      [](double sum, double part) { return sum + part; });
}

double largest(std::size_t count, const auto& value) {
  return parallel_reduce(
      count, grain, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double most = 0;
        for (std::size_t n = begin; n < end; ++n) most = std::max(most, std::abs(value(n)));
        return most;
      },
      [](double a, double b) { return std::max(a, b); });
}

void smooth(const Level& level, const Values& source, Values& potential) {
  for (int sweep = 0; sweep < sweep_count; ++sweep) {
    const Values residual = residual_of(level, source, potential);
    for_each_node(source.size(), [&](std::size_t n) {
      potential[n] += damping * residual[n] / level.diagonal[n];
    });
  }
}

// The same sweeps before as after what the coarser level adds: conjugate gradients want symmetry.
Values cycle(std::span<const Level> levels, const Values& source) {
  const Level& level = levels.front();
  Values potential(source.size());
  if (levels.size() == 1) {
    potential[0] = source[0] / level.diagonal[0];
    return potential;
  }
  smooth(level, source, potential);
  const Values residual = residual_of(level, source, potential);
  Values gathered(levels[1].network.size());
  for (std::size_t n = 0; n < residual.size(); ++n) gathered[level.parent[n]] += residual[n];
  const Values correction = cycle(levels.subspan(1), gathered);
  for_each_node(source.size(), [&](std::size_t n) { potential[n] += correction[level.parent[n]]; });
  smooth(level, source, potential);
  return potential;
}

}  // namespace

void solve_conduction(const ConductionNetwork& network, const std::vector<double>& source,
                      std::vector<double>& potential) {
  const std::vector<Level> levels = levels_of(network);
  const Level& finest = levels.front();
  const Values none(source.size());
  const auto is_done = [&](const Values& residual) {
    const double change =
        largest(residual.size(), [&](std::size_t n) { return residual[n] / finest.diagonal[n]; });
    return change <=
           wanted_change * largest(potential.size(), [&](std::size_t n) { return potential[n]; });
  };
  Values residual = residual_of(finest, source, potential);
  Values direction;
  double before = 0;
  for (int iteration = 0; !is_done(residual); ++iteration) {
    if (iteration == most_iterations)
      throw NumericalError(
          "the diffusion in the bath could not be solved; use a coarser domain.spacing or a "
          "thinner boundary_layer, or report it with the recipe");
    const Values prepared = cycle(levels, residual);
    const double now = product(residual, prepared);
    if (iteration == 0) {
      direction = prepared;
    } else {
      const double kept = now / before;
      for_each_node(direction.size(),
                    [&](std::size_t n) { direction[n] = prepared[n] + kept * direction[n]; });
    }
    before = now;
    const Values against = residual_of(finest, none, direction);  // minus what the direction draws
    const double length = -now / product(direction, against);
    for_each_node(direction.size(), [&](std::size_t n) {
      potential[n] += length * direction[n];
      residual[n] += length * against[n];
    });
  }
}

}  // namespace scarp
