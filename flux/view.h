#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "flux/elements.h"
#include "flux/exchange.h"
#include "flux/forward.h"

namespace scarp {

/// Independent sets of rays from every element.
inline constexpr std::size_t set_count = 2;

/// How many rays leave each element, in each of its sets.
///
/// Elements are taken along a space-filling curve, one main direction after the other, so that
/// neighbours on the surface are neighbours in the list; an element's place in it is its rank.
class RayPlan {
 public:
  static constexpr std::uint32_t least_set = 2;

  RayPlan(const RayScene& scene, const Elements& elements);

  /// As many rays per area everywhere, since errors are judged on patches of the same area: powers
  /// of two, which make the best sets, mixed for the right mean. Never fewer on any element than
  /// before, and together at most cap unless the least sets of all elements are more.
  void grow(double rays_per_area, std::uint64_t cap);

  const Elements& elements() const { return *elements_; }
  std::size_t size() const { return rays_.size(); }
  std::uint32_t element_at(std::size_t rank) const { return element_at_[rank]; }
  std::uint32_t rank_of(std::size_t element) const { return rank_of_[element]; }
  std::uint32_t rays(std::size_t rank) const { return rays_[rank]; }
  /// Number of rays in one set of all ranks before this one.
  std::uint64_t first(std::size_t rank) const { return first_[rank]; }
  std::uint64_t total() const { return first_.back() * set_count; }

 private:
  std::vector<std::uint32_t> wanted(double rays_per_area) const;

  const Elements* elements_;
  std::vector<std::uint32_t> element_at_;
  std::vector<std::uint32_t> rank_of_;
  std::vector<std::uint32_t> rays_;
  std::vector<std::uint64_t> first_;
};

/// Where a ray ended that met no facet: added to the number of elements.
enum Fate : std::uint32_t { to_sky, to_back, to_below, to_side_limit, fate_count };

/// What the rays saw.
///
/// Shape: row i of the matrix is the element of rank i; ray j of a set is its entry j * set_count +
/// set. direct[p] holds at rank * set_count + set the sum of the weights of rays that reached the
/// sky, for problem p; divided by the number of rays it is the direct flux.
struct View {
  ExchangeMatrix matrix;
  std::vector<std::vector<float>> direct;
  std::uint64_t flights = 0;
};

/// Sends the rays of a plan, except those that an earlier view with smaller sets already holds.
///
/// Shape: all problems share scene and options. Cost: 1/4 to 1/2 us per new ray on one core.
View look(std::span<const FluxProblem> problems, const RayPlan& plan, const View& earlier);

}  // namespace scarp
