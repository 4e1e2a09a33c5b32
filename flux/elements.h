#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/vec3.h"
#include "flux/ray_scene.h"

namespace scarp {

/// The facets of a scene cut into triangles no longer than a limit, on which flux may be taken as
/// constant: large facets of a simplified mesh span places with quite different flux.
///
/// A facet is cut through the middle of its longest edge until all edges are short enough. Elements
/// of one facet follow each other.
///
/// Units: as in the scene, grid spacings.
class Elements {
 public:
  Elements(const RayScene& scene, double longest_edge);

  std::size_t count() const { return corners_.size(); }
  std::uint32_t facet_of(std::size_t element) const { return facet_[element]; }
  const std::array<Vec3d, 3>& corners(std::size_t element) const { return corners_[element]; }
  double area(std::size_t element) const { return area_[element]; }
  double facet_area(std::size_t facet) const { return scene_->area(facet); }

  /// The elements of facet f are first_of(f) to first_of(f + 1) - 1.
  std::uint32_t first_of(std::size_t facet) const { return first_[facet]; }

  /// The element of a facet in which a point of it lies; points on a cut go to either side.
  std::uint32_t at(std::uint32_t facet, Vec3d r) const;

 private:
  // A cut from a corner to the middle of the opposite edge, or an element that is not cut.
  struct Node {
    int corner = -1;          // -1: an element
    std::uint32_t next = 0;   // the element, or the node of the half that keeps corner + 1
    std::uint32_t other = 0;  // the node of the half that keeps corner + 2
  };

  std::uint32_t cut(std::uint32_t facet, const std::array<Vec3d, 3>& corners, double area,
                    double longest_edge, int depth);

  std::vector<std::array<Vec3d, 3>> corners_;
  std::vector<double> area_;
  std::vector<std::uint32_t> facet_;
  std::vector<std::uint32_t> first_;
  std::vector<std::uint32_t> root_;  // node of each facet
  std::vector<Node> nodes_;
  const RayScene* scene_;
};

}  // namespace scarp
