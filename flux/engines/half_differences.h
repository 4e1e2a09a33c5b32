#pragma once

#include <array>
#include <span>
#include <vector>

#include "flux/engines/radiosity.h"
#include "flux/engines/view.h"
#include "flux/rays/ray_plan.h"

namespace scarp {

/// The most parts in which a set of an element's rays is looked at.
inline constexpr std::size_t most_parts = 4;

/// In how many parts each set of a block's elements is looked at. Rays that follow each other in a
/// set make a part, and as many of each are aimed at the sky if any are, where there are enough.
std::size_t part_count(const RayPlan& plan, const RayPlan::Block& block);

/// What the rays of elements say apart of one quantity. By rank.
struct Differences {
  /// Half of what the two sets say apart: fair samples of the errors of what they say together.
  std::vector<double> halves{};
  /// What each part of a set says more than the set, those of a set together. Nothing if that is
  /// not known.
  std::vector<std::array<float, set_count * most_parts>> parts{};
  /// Variances of single rays that the parts do not show.
  std::vector<float> of_rays{};
  /// Those that they show; they may be left out.
  std::vector<float> of_rays_in_parts{};
};

struct HalfDifferences {
  Differences flux;         ///< of direct flux plus re-emitted flux seen
  std::vector<double> out;  ///< halves of the part of rays that met no facet
  Differences lost;         ///< of what leaves along these
  /// Variances of single rays in the sum of flux and what leaves, as parts show them.
  std::vector<float> sum_of_rays;
};

/// Shape: problem is its number in the view.
HalfDifferences half_differences(const View& view, std::size_t problem, const RayPlan& plan,
                                 const Radiosity& radiosity);

}  // namespace scarp
