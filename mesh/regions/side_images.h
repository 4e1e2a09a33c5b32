#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/region_mesh.h"

namespace scarp {

/// Vertices on opposite periodic sides that are one and the same place of what repeats: each is
/// the image of the other. A vertex at an edge of the domain may have three of them.
class SideImages {
 public:
  SideImages() = default;
  /// There are none across sides that are not periodic, or do not have the same facets.
  explicit SideImages(const RegionMesh& mesh);

  /// How many images there are, with the vertex itself.
  unsigned count(std::uint32_t v) const;
  /// Those are numbered from 0, the vertex itself.
  std::uint32_t image(std::uint32_t v, unsigned n) const;
  /// The image of another vertex on the same side that goes with image n of v.
  std::uint32_t image_along(std::uint32_t v, unsigned n, std::uint32_t other) const {
    return across(other, axes_of(v, n));
  }

  /// The vertex on the side opposite to a side; none where there is no image.
  std::uint32_t opposite(std::uint32_t v, int side) const;

  static constexpr std::uint32_t none = ~std::uint32_t{0};

 private:
  using Axes = std::array<bool, 2>;
  Axes axes_of(std::uint32_t v, unsigned n) const;
  std::uint32_t across(std::uint32_t v, const Axes& axes) const;

  std::array<std::vector<std::uint32_t>, 2> others_;  ///< across x and across y; empty: none
};

}  // namespace scarp
