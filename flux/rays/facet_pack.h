#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "core/vec3.h"
#include "flux/rays/nearest_facet.h"

namespace scarp {

/// Up to four facets side by side. One look in single precision tells which of them a ray may meet.
///
/// No facet is left out that the exact test of NearestFacet meets. For a ray that starts in the
/// domain, a corner's place in the view is within the room of the exact one: rounding of foot,
/// shear, product and differences takes three units of single precision of the domain's size
/// across and five along the view, that of the exact picture another one, and the room is six or
/// more. If the ray meets the facet, all corners of the picture are within the facet's extent, and
/// the room, of the origin. A product of two of their coordinates is then within 2 room
/// (extent + room) + room^2 of the exact one. The difference of two, rounded, is within
/// 5 room (extent + 2 room) of what decides on which side of an edge the ray passes. The slack is
/// more.
struct alignas(64) FacetPack {
  static constexpr std::size_t most = 4;
  using Floats [[gnu::vector_size(most * sizeof(float))]] = float;
  using Indices [[gnu::vector_size(most * sizeof(std::uint32_t))]] = std::uint32_t;

  /// indices: of 1 to 4 facets. room: see NearestFacet.
  FacetPack(std::span<const SceneFacet> all, std::span<const std::uint32_t> indices, double room);

  std::array<std::array<Floats, 3>, 3> corners;  ///< by axis and number
  Floats slack;                                  ///< of the signs of edges
  Indices facets{};
};

/// How a ray looks at packs.
class PackView {
 public:
  using Mask [[gnu::vector_size(sizeof(FacetPack::Floats))]] = std::int32_t;

  /// from: the facet of the start, which is not met.
  PackView(const RayView& view, std::uint32_t from);

  /// Not 0 for facets that may be met.
  Mask may_meet(const FacetPack& pack) const;

 private:
  using Floats = FacetPack::Floats;

  static Floats all(double x) { return Floats{} + static_cast<float>(x); }

  std::array<std::size_t, 3> axes_;
  Floats foot_x_;
  Floats foot_y_;
  Floats foot_depth_;
  Floats shear_x_;
  Floats shear_y_;
  FacetPack::Indices from_;
};

// Places that are left hold the first facet again, and nothing meets it there.
inline FacetPack::FacetPack(std::span<const SceneFacet> all, std::span<const std::uint32_t> indices,
                            double room) {
  for (std::size_t k = 0; k < most; ++k) {
    const std::uint32_t f = indices[k < indices.size() ? k : 0];
    double extent = 0;
    for (int axis = 0; axis < 3; ++axis) {
      std::array<float, 3> x;
      for (std::size_t n = 0; n < 3; ++n) {
        x[n] = all[f].corners[n][axis];
        corners[static_cast<std::size_t>(axis)][n][k] = x[n];
      }
      const auto [low, high] = std::minmax({x[0], x[1], x[2]});
      extent += static_cast<double>(high) - low;
    }
    slack[k] = k < indices.size() ? static_cast<float>(6 * room * (extent + 2 * room))
                                  : std::numeric_limits<float>::lowest();
    facets[k] = f;
  }
}

inline PackView::PackView(const RayView& view, std::uint32_t from)
    : axes_(view.axes),
      foot_x_(all(view.foot[0])),
      foot_y_(all(view.foot[1])),
      foot_depth_(all(view.foot_depth)),
      shear_x_(all(view.shear[0])),
      shear_y_(all(view.shear[1])),
      from_(FacetPack::Indices{} + from) {}

inline PackView::Mask PackView::may_meet(const FacetPack& pack) const {
  const std::array<Floats, 3>& across_x = pack.corners[axes_[0]];
  const std::array<Floats, 3>& across_y = pack.corners[axes_[1]];
  const std::array<Floats, 3>& depth = pack.corners[axes_[2]];
  std::array<Floats, 3> x;
  std::array<Floats, 3> y;
  for (std::size_t n = 0; n < 3; ++n) {
    const Floats along = depth[n] - foot_depth_;
    x[n] = (across_x[n] - foot_x_) - shear_x_ * along;
    y[n] = (across_y[n] - foot_y_) - shear_y_ * along;
  }
  const Floats a = x[1] * y[2] - y[1] * x[2];
  const Floats b = x[2] * y[0] - y[2] * x[0];
  const Floats c = x[0] * y[1] - y[0] * x[1];
  const Floats least_of_two = a < b ? a : b;
  const Floats most_of_two = a > b ? a : b;
  const Floats least = least_of_two < c ? least_of_two : c;
  const Floats most = most_of_two > c ? most_of_two : c;
  return ((least + pack.slack >= 0) | (most - pack.slack <= 0)) & (pack.facets != from_);
}

}  // namespace scarp
