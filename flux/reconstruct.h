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
  /// Keeps the mesh.
  explicit SmoothCorners(const TriMesh& mesh);

  const TriMesh& mesh() const { return mesh_; }

  /// Calls use(g, area of g) for each facet g that counts at a corner of facet f, itself included.
  template <class Use>
  void for_each(std::uint32_t f, std::size_t corner, const Use& use) const {
    const std::uint32_t v = mesh_.triangles[f][corner];
    for (const std::uint32_t g : around(v))
      if (is_smooth_[v] != 0 || belongs(f, g)) use(g, areas_[g]);
  }

  /// The facets around a vertex.
  std::span<const std::uint32_t> around(std::size_t v) const {
    return std::span(around_).subspan(first_[v], first_[v + 1] - first_[v]);
  }
  /// Whether all facets around a vertex count for each other, and have an area together.
  bool is_smooth(std::size_t v) const { return is_smooth_[v] != 0; }

 private:
  bool belongs(std::uint32_t f, std::uint32_t g) const;
  bool all_belong(std::size_t v) const;

  const TriMesh& mesh_;
  std::vector<std::uint32_t> first_;   // per vertex
  std::vector<std::uint32_t> around_;  // facets, those of a vertex together
  std::vector<double> areas_;
  std::vector<Vec3f> normals_;
  std::vector<char> is_smooth_;  // per vertex
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
