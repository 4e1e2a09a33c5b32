#pragma once

#include <span>
#include <vector>

#include "flux/radiosity.h"
#include "flux/view.h"

namespace scarp {

/// Half of what the two sets of an element's rays say apart: fair samples of the errors of what
/// they say together. By rank.
struct HalfDifferences {
  std::vector<double> flux;  ///< of direct flux plus re-emitted flux seen
  std::vector<double> out;   ///< of the part of rays that met no facet
  std::vector<double> lost;  ///< of what leaves along these
};

/// Shape: direct is that of a problem in the view.
HalfDifferences half_differences(const View& view, std::span<const float> direct,
                                 const Radiosity& radiosity);

}  // namespace scarp
