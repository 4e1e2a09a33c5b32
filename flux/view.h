#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "flux/exchange.h"
#include "flux/problem.h"
#include "flux/shots.h"

namespace scarp {

/// Where a ray ended that met no facet: added to the number of elements.
enum Fate : std::uint32_t { to_sky, to_back, to_below, to_side_limit, fate_count };

/// What the rays saw.
///
/// Shape: row i of the matrix is the element of rank i; ray j of a set is its entry j * set_count +
/// set. direct[p] holds at rank * set_count + set the sum of the weights of rays that reached the
/// sky, for problem p; divided by the number of rays it is the direct flux.
struct View {
  ExchangeMatrix matrix;
  std::vector<std::vector<float>> direct;
  std::uint64_t flights = 0;
};

/// Whether rays leave along the lobe of a problem's source as well.
bool is_looked_for(const FluxProblem& problem);

/// Sends the rays of a plan, except those that an earlier view with smaller sets already holds.
///
/// Shape: all problems share scene and options. Cost: 1/4 to 1/2 us per new ray on one core.
View look(std::span<const FluxProblem> problems, const RayPlan& plan, const View& earlier);

}  // namespace scarp
