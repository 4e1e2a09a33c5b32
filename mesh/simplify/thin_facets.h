#pragma once

#include <cstdint>

namespace scarp {

/// Whether the normal of a thin facet says where it faces.
enum class ThinFacets : std::uint8_t {
  noisy,  ///< as of marching cubes: what is around it says more
  exact   ///< as drawn, however thin
};

}  // namespace scarp
