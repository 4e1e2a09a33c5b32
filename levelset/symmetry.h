#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "core/frame.h"
#include "core/tri_mesh.h"
#include "levelset/layers.h"

namespace scarp {

/// The frame of the half, or quarter, beyond planes across x and y in the middle of a wafer.
///
/// Shape: planes[axis] is the one across that axis; its sides are reflective, its number of cells
///        is even and it is none of a half already.
Frame half_of(const Frame& whole, std::array<bool, 2> planes);

/// The frame of the wafer of which this may be the half.
Frame whole_of(const Frame& part);

/// Whether the wafer is its own mirror image across its middle, to the last bit.
///
/// Shape: an even number of cells along the axis, between reflective sides.
bool is_mirror_symmetric(const Layers& layers, int axis);

/// The part of the layers beyond planes of symmetry; see half_of().
Layers half_of(const Layers& whole, std::array<bool, 2> planes);

/// The wafer of which layers hold the half: every bit as it would have been without.
Layers with_images(const Layers& part);

/// All of a wafer of which layers may hold the half.
class WholeLayers {
 public:
  /// part has to outlive this.
  explicit WholeLayers(const Layers& part);

  const Layers& get() const { return built_ ? *built_ : *part_; }

 private:
  const Layers* part_;
  std::optional<Layers> built_;
};

/// A mesh with its mirror images, joined where they meet.
///
/// Shape: frame.images() times the facets; those of each image in the order of the mesh.
TriMesh with_images(const TriMesh& part, const Frame& frame);

/// What belongs to the facets of such a mesh.
std::vector<float> with_images(std::span<const float> values, const Frame& frame);

}  // namespace scarp
