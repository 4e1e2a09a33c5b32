#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/vec3.h"

namespace scarp {

/// The start of a straight flight: from a facet, or from no facet.
struct Ray {
  static constexpr std::uint32_t no_facet = std::numeric_limits<std::uint32_t>::max();

  Vec3d r;
  Vec3d u;
  std::uint32_t from = no_facet;
};

/// The end of a straight flight; r and u are the place and the direction there, mirrored and
/// wrapped at the sides.
struct Flight {
  enum class End {
    front,       ///< arrived on the gas side of a facet
    back,        ///< arrived on the solid side of a facet: the mesh has a gap
    sky,         ///< left through the source plane
    below,       ///< left below the lowest vertex: the mesh has a gap
    side_limit,  ///< crossed the sides a million times
  };
  static constexpr std::size_t end_count = 5;
  End end = End::sky;
  std::uint32_t facet = Ray::no_facet;
  Vec3d r;
  Vec3d u;
};

}  // namespace scarp
