#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/tri_mesh.h"
#include "flux/elements.h"

namespace scarp {

/// Values on facets from those on elements: where facets are joined, on a plane through the middle
/// of their element that fits its neighbours (by SmoothCorners) best, so that the mean over an
/// element is its own; elsewhere, and on rings, the mean over a facet's elements.
class FacetValues {
 public:
  FacetValues(const TriMesh& mesh, const Elements& elements);

  std::size_t facet_count() const { return first_.size(); }
  /// Part of what a facet has more than its element, of a quantity given by element: the sum of
  /// weight times quantity over these.
  struct Term {
    std::uint32_t element;
    float weight;
  };
  std::span<const Term> beyond_element(std::size_t facet) const {
    return std::span(terms_).subspan(first_[facet], end_[facet] - first_[facet]);
  }

 private:
  std::vector<std::size_t> first_;  // per facet
  std::vector<std::size_t> end_;
  std::vector<Term> terms_;
};

}  // namespace scarp
