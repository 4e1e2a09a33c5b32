#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "apps/simulator/simulator.h"

namespace scarp {

/// The same recipe with at most so many rays for a flux.
Recipe with_few_rays(Recipe recipe, std::uint64_t count);

/// Whether a grid of a spacing so many times larger fits into the domain.
bool divides(int factor, const Frame& frame);

/// The same recipe on such a grid.
Recipe coarser(Recipe recipe, int factor);

/// The area of the facets of a survey over that of the domain.
double area_of(const Survey& survey, const Frame& frame);

/// A run ahead of the real one, at a coarser spacing and with few rays: it shows roughly which
/// geometry the later steps of a recipe meet.
class CoarseRun {
 public:
  /// What a time step takes, in flights of a ray or so.
  static double work(const Survey& survey);

  /// The spacing is the least multiple of the recipe's that divides the extent and makes of this
  /// work, which the time steps would be at the recipe's own spacing, little enough.
  CoarseRun(const Recipe& recipe, const State& start, double work);

  /// Goes on until a step begins, or was skipped; false if that is too much work.
  bool reach(std::size_t step);

  /// See area_of(), at the beginning of each step so far.
  std::span<const double> areas() const { return areas_; }

  /// The wafer as it is now, on the recipe's own grid.
  State state() const;

 private:
  Frame frame_;  ///< of the recipe
  Recipe coarse_;
  State state_;
  double work_left_;
  std::vector<double> areas_;
};

}  // namespace scarp
