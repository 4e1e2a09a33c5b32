#pragma once

#include <vector>

#include "core/angular_factor.h"
#include "core/vec3.h"

namespace scarp {

/// A plane of a crystal by its unit normal.
struct CrystalPlane {
  Vec3d normal{};
  double rate = 0;
};

/// The planes that are left of a crystal that grows beyond a line on a level surface: those slower
/// than what lies between their neighbours, from the flattest to the upright one, and without the
/// surface itself. They lean by steps of 2 degrees or less, which is enough for what is measured
/// within a few spacings of the line.
///
/// aside and up are orthogonal unit vectors across the line.
/// Source: Wulff 1901 (here for speeds).
std::vector<CrystalPlane> slow_planes(const CrystalRates& crystal, const Vec3d& aside,
                                      const Vec3d& up);

}  // namespace scarp
