#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "flux/engines/exchange.h"
#include "flux/rays/problem.h"
#include "flux/rays/shots.h"

namespace scarp {

/// Where a ray ended that met no facet: added to the number of elements.
enum Fate : std::uint32_t { to_sky, to_back, to_below, to_side_limit, fate_count };

/// Of one set of an element's rays.
struct WeightSums {
  double sky = 0;      ///< of rays that reached the sky
  double others = 0;   ///< of all others
  double lacking = 0;  ///< what both lack of the number of rays
};
using SetSums = std::array<WeightSums, set_count>;

/// What the rays saw.
///
/// Shape: row i of the matrix is the element of rank i; ray j of a set is its entry j * set_count +
/// set, and one that left into the solid has no weight. direct[p] holds at rank * set_count + set
/// the sum over rays that reached the sky of their weights times what they see, for problem p;
/// divided by the number of rays it is the direct flux.
struct View {
  /// Rows are scaled such that what elements see of each other and of the sky make up a whole,
  /// unless a set of theirs met nothing but the sky. A ray without weight has its own rank as hit.
  ExchangeMatrix matrix{};
  std::vector<SetSums> sums{};  ///< by rank
  ExchangeRows rows{};          ///< of the matrix
  /// By ray of the matrix: where it met an element, from the middle of that; where one to the sky
  /// started, from the middle of its own. Units: spacings.
  std::vector<Vec3f> places{};
  std::vector<Vec3f> moments{};  ///< by entry of rows.seen: the sum of parts times places
  std::vector<std::vector<float>> direct{};
  /// The same of squares, of both sets, by rank.
  std::vector<std::vector<float>> direct_squares{};
  /// By rank, the sum over rays that reached the sky of their weights times their direction over
  /// the cosine to the normal; of each problem the same times what they see. Divided by the number
  /// of rays these are the vectors by which the sky in view, and the direct flux, change with the
  /// normal.
  std::vector<Vec3f> skyward{};
  std::vector<std::vector<Vec3f>> light{};
  std::uint64_t flights = 0;
};

/// How the flux of a problem changes with the normal, on every element: straight from the source,
/// and because of what is seen in place of the sky, taken as equally bright everywhere.
///
/// Shape: by rank, the flux and the result.
std::vector<Vec3d> change_with_normal(const View& view, std::size_t problem,
                                      std::span<const double> flux);

/// Whether rays leave along the lobe of a problem's source as well.
bool is_looked_for(const FluxProblem& problem);

/// Has the blocks of a plan aim at the sky that hardly see it. Returns the flights this took, one
/// per element.
///
/// From there rays by Lambert's law seldom meet the sky, on which all flux depends, and seldom fly
/// far along what is deep, which is how particles get down.
std::uint64_t aim_at_sky(const FluxProblem& problem, RayPlan& plan);

/// Sends the rays of a plan, except those that an earlier view with smaller sets already holds.
///
/// Shape: all problems share scene and options. Cost: 1/4 to 1/2 us per new ray on one core.
View look(std::span<const FluxProblem> problems, const RayPlan& plan, const View& earlier);

}  // namespace scarp
