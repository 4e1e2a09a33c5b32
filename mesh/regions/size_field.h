#pragma once

#include <array>
#include <span>

#include "core/tri_mesh.h"
#include "core/triangle_tree.h"

namespace scarp {

/// How large the facets of a region mesh should be at each place.
///
/// It is one spacing where there is detail: where the surface of a layer bends, and where two of
/// them are nearer to each other than a spacing, as next to lines where three materials meet. From
/// there it grows with the distance, up to the size of facets on flat surfaces.
///
/// Units: nm.
class SizeField {
 public:
  /// By how much it grows with the distance from detail.
  static constexpr double growth = 0.5;

  SizeField() = default;
  SizeField(std::span<const TriMesh> surfaces, double spacing, double size);

  double largest() const { return size_; }
  /// No size is larger from now on.
  void limit(double largest) { size_ = largest; }
  double at(const Vec3d& r) const;
  /// The least at its corners.
  double of_facet(const std::array<Vec3d, 3>& corners) const;

 private:
  double spacing_ = 0;
  double size_ = 0;
  TriangleTree details_;
};

/// Of a facet, in parts of its target size; nothing is told apart from more than enough.
///
/// @param enough is returned for facets with more, whose target is not looked for
double relative_altitude(const std::array<Vec3d, 3>& corners, const SizeField& targets,
                         double enough);

}  // namespace scarp
