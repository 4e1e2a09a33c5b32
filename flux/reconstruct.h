#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/tri_mesh.h"

namespace scarp {

/// The facets that count at the corners of others: those around the same vertex whose normal is
/// within 40 degrees and whose material is the same.
class SmoothCorners {
 public:
  /// A corner of a facet that counts at another corner.
  struct Member {
    std::uint32_t facet = 0;
    std::uint32_t corner = 0;
    double part = 0;  ///< of the area of all facets that count there
  };

  /// Keeps the mesh.
  explicit SmoothCorners(const TriMesh& mesh);

  const TriMesh& mesh() const { return mesh_; }

  /// One set for all corners at a vertex where all facets count for each other, elsewhere one for
  /// each corner.
  std::size_t set_count() const { return first_.size() - 1; }
  /// By facet, those of its three corners.
  const std::array<std::uint32_t, 3>& sets_of(std::size_t facet) const { return sets_[facet]; }
  std::span<const Member> members(std::size_t set) const {
    return std::span(members_).subspan(first_[set], first_[set + 1] - first_[set]);
  }

 private:
  const TriMesh& mesh_;
  std::vector<std::array<std::uint32_t, 3>> sets_;
  std::vector<std::uint32_t> first_;  // per set
  std::vector<Member> members_;
};

/// Values at the three corners of every facet from values on facets: linear on a facet, continuous
/// where the surface is smooth, with a step at edges and at borders of materials.
///
/// A corner takes the mean, weighted by area, over the facets that count there, and what this
/// blurs is put back: the mean over the corners of a facet is its value where the slope is constant
/// or changes steadily. Facets at a domain side average over their side of it. No corner leaves
/// the range of the facets that count there. The integral is kept where every facet around a
/// vertex counts for every other, which holds but for strong curvature. Means of standard errors
/// are about those of the corners.
///
/// Shape: facet_values and result have one entry per facet; corners in the order of the triangle.
/// Cost:  O(n), several times less where corners serve for all values on a mesh.
std::vector<std::array<float, 3>> corner_values(const SmoothCorners& corners,
                                                std::span<const float> facet_values);
inline std::vector<std::array<float, 3>> corner_values(const TriMesh& mesh,
                                                       std::span<const float> facet_values) {
  return corner_values(SmoothCorners(mesh), facet_values);
}

}  // namespace scarp
