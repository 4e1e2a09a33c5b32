#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/frame.h"
#include "core/tri_mesh.h"
#include "levelset/grid/layers.h"

namespace scarp {

class Band;

/// Planes that mirror a wafer onto itself: across x and y in its middle, and, where both do and the
/// quarter is square, x = y.
struct MirrorPlanes {
  std::array<bool, 2> across{};
  bool diagonal = false;
};

/// The frame of the part beyond planes in the middle of a wafer.
///
/// Shape: the sides across which planes lie are reflective, their numbers of cells even, and the
///        frame is none of a part already.
Frame part_of(const Frame& whole, const MirrorPlanes& planes);

/// The frame of the wafer of which this may be a part.
Frame whole_of(const Frame& part);

/// Whether the wafer is its own mirror image across its middle, to the last bit.
///
/// Shape: an even number of cells along the axis, between reflective sides.
bool is_mirror_symmetric(const Layers& layers, int axis);

/// The same across x = y, of a square wafer.
bool is_diagonally_symmetric(const Layers& layers);

/// The part of the layers beyond planes of symmetry; see part_of(). Nodes beyond the diagonal stay.
Layers part_of(const Layers& whole, const MirrorPlanes& planes);

/// The wafer of which layers hold a part: every bit as it would have been without.
Layers with_images(const Layers& part);

/// All of a wafer of which layers may hold a part.
class WholeLayers {
 public:
  /// part has to outlive this.
  explicit WholeLayers(const Layers& part);

  const Layers& get() const { return built_ ? *built_ : *part_; }

 private:
  const Layers* part_;
  std::optional<Layers> built_;
};

/// Gives nodes with y > x what their mirror images across x = y have.
///
/// Shape: 512 values per leaf.
void mirror_across_diagonal(const Band& band,
                            const std::function<float*(std::size_t leaf)>& values);
void mirror_across_diagonal(const Band& band, std::span<float> values);

/// A mesh with its mirror images, joined where they meet.
///
/// Shape: frame.facet_images() times the facets; those of each image in the order of the mesh.
TriMesh with_images(const TriMesh& part, const Frame& frame);

/// What belongs to the facets of such a mesh.
std::vector<float> with_images(std::span<const float> values, const Frame& frame);

}  // namespace scarp
