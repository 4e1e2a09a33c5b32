#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "flux/ray_plan.h"
#include "flux/solve.h"

namespace scarp {

/// Draws of the error of all elements together.
inline constexpr std::size_t draw_count = 32;

/// Standard errors of what the rays of each element found, by rank.
///
/// half(rank) is half the difference between an element's two sets, a fair sample of the error of
/// their mean. Its square is averaged over elements nearby, but for those that are left out, which
/// have no error.
std::vector<float> standard_errors(const RayPlan& plan,
                                   const std::function<double(std::size_t rank)>& half,
                                   const std::function<bool(std::size_t rank)>& left_out);

/// A draw flips an element's half difference or not: one bit for each.
/// Source: Wu 1986.
std::uint32_t draw_signs(const FluxOptions& options, std::uint32_t element);

inline double sign(std::uint32_t signs, std::size_t draw) { return (signs >> draw) & 1U ? 1 : -1; }

/// The mean over the elements of a facet, by area, of a quantity given by rank.
template <class Quantity>
double mean_on_facet(const RayPlan& plan, std::size_t facet, const Quantity& quantity) {
  return plan.elements().mean_on_facet(
      facet, [&](std::uint32_t element) { return quantity(plan.rank_of(element)); });
}

}  // namespace scarp
