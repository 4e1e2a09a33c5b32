#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/tri_mesh.h"
#include "flux/rays/elements.h"

namespace scarp {

/// Values within elements from one number for each: on a plane through the middle of the element
/// that fits its neighbours best, so that the mean over an element is its own number. On rings, and
/// where an element has no neighbour, constant.
///
/// Neighbours are elements with a common vertex, the same material and normals within 40 degrees
/// there.
class FacetValues {
 public:
  FacetValues(const TriMesh& mesh, const Elements& elements);

  std::size_t facet_count() const { return first_part_.size() - 1; }
  /// The part of a facet's value that may be wrong where its elements have hardly any neighbours
  /// across, as on the floor of a narrow trench: there nothing shows how values change.
  double off_in_strips(std::size_t facet) const;

  /// How far the neighbours of an element lie on one side of it, and which: a vector of length 0,
  /// all around, to 1.
  Vec3d one_side(std::size_t element) const { return Vec3d(one_side_[element]); }

  /// The slope of the plane of an element.
  template <class OfElement>
  Vec3d slope(std::size_t element, const OfElement& of_element) const {
    Vec3d sum;
    const double here = of_element(element);
    for (std::size_t k = first_[element]; k < first_[element + 1]; ++k)
      sum += (of_element(neighbours_[k].element) - here) * Vec3d(neighbours_[k].slope);
    return sum;
  }

  /// What the neighbours of an element have more than its plane over their distance squared: half a
  /// second derivative, mean over them all.
  template <class OfElement>
  double bend(std::size_t element, Vec3d slope, const OfElement& of_element) const {
    double sum = 0;
    const double here = of_element(element);
    const std::size_t count = first_[element + 1] - first_[element];
    for (std::size_t k = first_[element]; k < first_[element + 1]; ++k) {
      const Vec3d d(neighbours_[k].away);
      sum += (of_element(neighbours_[k].element) - here - dot(slope, d)) / dot(d, d);
    }
    return count > 0 ? sum / static_cast<double>(count) : 0;
  }

  /// A facet or a part of it that is in one element.
  struct Part {
    std::uint32_t element = 0;
    float share = 0;  ///< of the area of the facet
    Vec3f offset{};   ///< of its middle from that of the element, times the share
  };
  std::span<const Part> parts_of(std::size_t facet) const {
    return std::span(parts_).subspan(first_part_[facet],
                                     first_part_[facet + 1] - first_part_[facet]);
  }

  /// What a facet part has more than its share of its element's number, is the sum of weight times
  /// number over the calls use(element, weight).
  template <class Use>
  void for_each_beyond(const Part& part, const Use& use) const {
    double sum = 0;
    for (std::size_t k = first_[part.element]; k < first_[part.element + 1]; ++k) {
      const double weight = dot(Vec3d(part.offset), Vec3d(neighbours_[k].slope));
      use(neighbours_[k].element, weight);
      sum += weight;
    }
    use(part.element, -sum);
  }

 private:
  struct Neighbour {
    std::uint32_t element;
    Vec3f slope;  // of the element's plane, for a difference of 1
    Vec3f away;   // its middle from that of the element
  };
  class Neighbours;

  void find_parts(const Elements& elements);
  void find_planes(const TriMesh& mesh, const Elements& elements);

  std::vector<std::size_t> first_part_;  // per facet
  std::vector<Part> parts_;
  std::vector<std::size_t> first_;   // per element
  std::vector<char> is_strip_;       // per element: it has hardly any neighbours across
  std::vector<float> off_in_strip_;  // per facet: part of a value
  std::vector<Vec3f> one_side_;      // per element
  std::vector<Neighbour> neighbours_;
};

}  // namespace scarp
