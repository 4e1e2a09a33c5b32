#pragma once

#include <cstddef>
#include <cstdint>
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

  std::size_t facet_count() const { return element_of_.size(); }
  /// What a facet has more than its element, of a quantity given by element, is the sum of weight
  /// times quantity over the calls use(element, weight).
  template <class Use>
  void for_each_beyond(std::size_t facet, const Use& use) const {
    const std::uint32_t element = element_of_[facet];
    if (element == is_by_itself) return;
    const Vec3f from_middle = from_middle_[facet];
    double sum = 0;
    for (std::size_t k = first_[element]; k < first_[element + 1]; ++k) {
      const double weight = dot(Vec3d(from_middle), Vec3d(neighbours_[k].slope));
      use(neighbours_[k].element, weight);
      sum += weight;
    }
    use(element, -sum);
  }

 private:
  static constexpr std::uint32_t is_by_itself = ~std::uint32_t{0};

  struct Neighbour {
    std::uint32_t element;
    Vec3f slope;  // of the element's plane, for a difference of 1
  };
  class SlopeFit;

  std::vector<std::uint32_t> element_of_;  // per facet: that it is joined to
  std::vector<Vec3f> from_middle_;         // per facet: its middle from that of its element
  std::vector<std::size_t> first_;         // per element
  std::vector<Neighbour> neighbours_;
};

}  // namespace scarp
