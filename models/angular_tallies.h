#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "flux/species.h"
#include "models/lobe_response.h"

namespace scarp {

/// A yield that is largest at a slant: where speeds are in proportion to it, it has a factor of its
/// own, also of a wide source.
struct PeakedYield {
  Species ions;
  std::size_t yield = 0;  ///< of the ions'
  std::size_t tally = 0;  ///< where it is counted
};

/// The tallies of species by how they depend on the normal of the surface.
struct AngularTallies {
  std::vector<Lobe> lobes;
  std::vector<PeakedYield> peaked;
};

/// Looks at a thousand directions of each narrow source and at 91 angles of each yield.
AngularTallies angular_tallies(std::span<const Species> all);

}  // namespace scarp
