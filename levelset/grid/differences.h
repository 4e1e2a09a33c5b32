#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "levelset/grid/scheme.h"
#include "levelset/grid/stencil.h"

namespace scarp {

/// Reads a leaf and as much of its halo as the differences of a scheme need.
template <class Source>
void gather_for(Scheme scheme, const Band& band, std::size_t leaf, const Source& source,
                Block& block) {
  if (scheme == Scheme::weno5) {
    gather<3>(band, leaf, source, block);
  } else {
    gather<2>(band, leaf, source, block);
  }
}

/// The smaller of two numbers of one sign, zero if the signs differ.
SCARP_KERNEL_PART float minmod(float a, float b) {
  const float smaller = std::abs(a) < std::abs(b) ? a : b;
  return a * b > 0 ? smaller : 0.0F;
}

/// The derivative at a node from phi there and at its neighbours: three on the side that it is
/// looked at from, two beyond.
///
/// Source: Jiang and Peng 2000 (WENO5 for Hamilton-Jacobi equations). Written in second
/// differences, so that a plane gives its slope exactly; weights of the three parabolas without a
/// division each.
SCARP_KERNEL_PART float weno5(const std::array<float, 3>& near, float here,
                              const std::array<float, 2>& far) {
  constexpr float least = 1e-6F;
  constexpr float curved = 13.0F / 12.0F;
  const auto square = [](float x) { return x * x; };
  const float a = (near[2] - near[1]) - (near[1] - near[0]);
  const float b = (near[1] - near[0]) - (near[0] - here);
  const float c = (near[0] - here) - (here - far[0]);
  const float d = (here - far[0]) - (far[0] - far[1]);
  const float s1 = curved * square(b - a) + 0.25F * square(3 * b - a) + least;
  const float s2 = curved * square(c - b) + 0.25F * square(b + c) + least;
  const float s3 = curved * square(d - c) + 0.25F * square(3 * c - d) + least;
  const float w1 = 0.1F * square(s2 * s3);
  const float w2 = 0.6F * square(s1 * s3);
  const float w3 = 0.3F * square(s1 * s2);
  const float sixth = w1 * (5 * b - 2 * a) + w2 * (b + 2 * c) + w3 * (4 * c - d);
  return (here - near[0]) + sixth / (6 * ((w1 + w2) + w3));
}

/// Derivatives along one axis as seen from the neighbour before and from the one after.
struct OneSided {
  float backward = 0;
  float forward = 0;
};

/// The size of the one from which information comes that travels towards growing phi (side = 1) or
/// falling phi (-1); zero if it comes from neither.
SCARP_KERNEL_PART float upwind_slope(OneSided slopes, float side) {
  return std::max(std::max(side * slopes.backward, 0.0F), std::max(-side * slopes.forward, 0.0F));
}

SCARP_KERNEL_PART float second_difference(const float* p, std::ptrdiff_t stride) {
  return (p[stride] - p[0]) - (p[0] - p[-stride]);
}

/// Symmetric to the last bit under reversal of the axis.
///
/// Source: Osher and Shu 1991 (ENO2, by minmod of neighbouring second differences).
template <Scheme scheme>
SCARP_KERNEL_PART OneSided one_sided(const float* p, std::ptrdiff_t stride) {
  if constexpr (scheme == Scheme::weno5) {
    const auto seen_from = [&](std::ptrdiff_t to) {
      return weno5({p[to], p[2 * to], p[3 * to]}, p[0], {p[-to], p[-2 * to]});
    };
    return {seen_from(-stride), -seen_from(stride)};
  }
  OneSided slopes{p[0] - p[-stride], p[stride] - p[0]};
  if constexpr (scheme == Scheme::eno2) {
    const float here = slopes.forward - slopes.backward;
    slopes.backward += 0.5F * minmod(here, second_difference(p - stride, stride));
    slopes.forward -= 0.5F * minmod(here, second_difference(p + stride, stride));
  }
  return slopes;
}

/// Squares of the derivative along one axis.
struct AxisSlopes {
  float upwind = 0;    ///< Godunov: for information that travels the way phi grows or falls
  float steepest = 0;  ///< the larger of the two differences to the neighbours
};

/// Which neighbour is lower; if both are alike the next ones decide, so that a tie is one under
/// reversal of the axis too, and then makes no difference.
SCARP_KERNEL_PART bool grows_along(const float* p, std::ptrdiff_t stride) {
  const float near = p[stride] - p[-stride];
  const float next = p[2 * stride] - p[-2 * stride];
  const float far = p[3 * stride] - p[-3 * stride];
  const float middle = next != 0 ? next : far;
  return (near != 0 ? near : middle) > 0;
}

/// side = 1: information travels towards growing phi, side = -1: towards falling phi.
///
/// Symmetric to the last bit under reversal of the axis. Source: Osher and Sethian 1988.
template <Scheme scheme>
SCARP_KERNEL_PART AxisSlopes axis_slopes(const float* p, std::ptrdiff_t stride, float side) {
  const float steepest = std::max(std::abs(p[0] - p[-stride]), std::abs(p[stride] - p[0]));
  float slope = 0;
  if constexpr (scheme == Scheme::weno5) {
    // Only one of the two derivatives can count; the costly one is found for that side alone.
    const bool backward = grows_along(p, stride) == (side > 0);
    const auto pick = [&](std::ptrdiff_t n) {
      const float before = p[-n * stride];
      const float after = p[n * stride];
      return backward ? before : after;
    };
    slope = std::max(side * weno5({pick(1), pick(2), pick(3)}, p[0], {pick(-1), pick(-2)}), 0.0F);
  } else {
    slope = upwind_slope(one_sided<scheme>(p, stride), side);
  }
  return {slope * slope, steepest * steepest};
}

/// Difference of the two from which on a place counts as near an edge (fully at twice this): on a
/// smooth surface it is below 1 / radius of curvature in spacings, and pure ENO2 or WENO5 holds.
inline constexpr float kink_starts = 0.15F;

/// Squares of |grad phi|, by upwind and by the steepest differences.
template <Scheme scheme>
SCARP_KERNEL_PART AxisSlopes slopes(const float* p, float side) {
  const AxisSlopes x = axis_slopes<scheme>(p, Block::x_stride, side);
  const AxisSlopes y = axis_slopes<scheme>(p, Block::y_stride, side);
  const AxisSlopes z = axis_slopes<scheme>(p, 1, side);
  return {(x.upwind + y.upwind) + z.upwind, (x.steepest + y.steepest) + z.steepest};
}

/// |grad phi| of a function that is meant to be a distance: by upwind differences, but near an edge
/// 1, where that lies between what the upwind and the steepest differences say.
///
/// Where normals fan out from an edge, upwind differences are too small by up to 30 % within the
/// first spacings: without this the edge lags behind by half a spacing for good. The first order
/// scheme is left as it is; that of order 5 falls back to order 2 near edges, where it would let
/// what is left of them grow. With edges = 0 there are none: upwind differences are taken as they
/// are.
template <Scheme scheme>
SCARP_KERNEL_PART float distance_slope(const float* p, float side, float edges = 1) {
  if constexpr (scheme == Scheme::first_order) {
    return std::sqrt(slopes<scheme>(p, side).upwind);
  }
  const AxisSlopes eno2 = slopes<Scheme::eno2>(p, side);
  const float upwind = std::sqrt(eno2.upwind);
  const float steepest = std::sqrt(eno2.steepest);
  const float kink =
      edges * std::clamp((steepest - upwind - kink_starts) / kink_starts, 0.0F, 1.0F);
  const float smooth =
      scheme == Scheme::weno5 ? std::sqrt(slopes<Scheme::weno5>(p, side).upwind) : upwind;
  const float sharp = std::max(upwind, std::min(steepest, 1.0F));
  return smooth + kink * (sharp - smooth);
}

}  // namespace scarp
