#pragma once

#include <span>
#include <vector>

#include "flux/radiosity.h"
#include "flux/view.h"

namespace scarp {

/// How single rays of an element scatter in what they tell: mean powers of the difference from
/// their mean. By rank.
struct RayScatter {
  std::vector<double> squares;
  std::vector<double> fourths;  ///< fourth powers
};

/// Half of what the two sets of an element's rays say apart: fair samples of the errors of what
/// they say together. By rank.
struct HalfDifferences {
  std::vector<double> flux;  ///< of direct flux plus re-emitted flux seen
  std::vector<double> out;   ///< of the part of rays that met no facet
  std::vector<double> lost;  ///< of what leaves along these
  RayScatter scatter_of_flux;
  RayScatter scatter_of_lost;
};

/// Shape: problem is its number in the view.
HalfDifferences half_differences(const View& view, std::size_t problem, const Radiosity& radiosity);

}  // namespace scarp
