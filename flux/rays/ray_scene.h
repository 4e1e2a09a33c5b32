#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/system/huge_pages.h"
#include "core/tri_mesh.h"
#include "core/vec3.h"
#include "flux/rays/embree_tree.h"
#include "flux/rays/ray.h"

namespace scarp {

/// A surface between the lateral sides of the domain, prepared for flights.
///
/// Embree's tree proposes the facets on a flight (see EmbreeTree), and a test of our own whose
/// signs are exact decides which is next: nothing slips between facets with a common edge or
/// vertex, and of two facets at the same distance the lower index wins. The facet a flight starts
/// from is none of its candidates, which takes the place of an offset of the origin. Sides are
/// planes where the flight is mirrored or wrapped; they hold no geometry.
///
/// Units: lengths in grid spacings, relative to the lower corner of the sides and the middle of
/// the mesh's height.
class RayScene {
 public:
  /// spacing: of the grid, > 0. embree: its configuration.
  /// Throws: InputError for a mesh without triangles or with more than 32 bits count, a facet of
  /// zero area, a vertex outside the sides or not finite; NumericalError where Embree fails.
  RayScene(const TriMesh& mesh, const Sides& sides, double spacing,
           const std::string& embree = embree_configuration());

  /// Thread-safe.
  Flight fly(const Ray& ray) const;
  /// The end of each; faster if those that start close together follow each other.
  /// Shape: as many flights as rays.
  void fly(std::span<const Ray> rays, std::span<Flight> flights) const;

  /// Asks the memory for what is known of a facet.
  void prefetch(std::size_t facet) const { __builtin_prefetch(&facets_[facet]); }

  std::size_t facet_count() const { return facets_.size(); }
  const std::array<Vec3f, 3>& corners(std::size_t facet) const { return facets_[facet].corners; }
  Vec3d normal(std::size_t facet) const { return facets_[facet].normal; }
  double area(std::size_t facet) const { return areas_[facet]; }

  /// The domain seen from above, from (0, 0) to here.
  Vec3d upper() const { return upper_; }
  /// The source plane: one spacing above the highest vertex.
  double source_height() const { return source_height_; }
  double lowest() const { return lowest_; }
  /// From where a flight leaves at the upper side along an axis, if it enters at the lower one.
  bool is_periodic(int axis) const {
    return boundary_[static_cast<std::size_t>(axis)] == Boundary::periodic;
  }
  double source_area() const { return (has_diagonal_ ? 0.5 : 1) * upper_.x * upper_.y; }
  /// Whether the domain ends at x = y, too; see Sides.
  bool has_diagonal() const { return has_diagonal_; }

 private:
  struct Part;

  void place(const TriMesh& mesh, const Sides& sides, double spacing);
  Part part_from(const Ray& ray) const;
  Flight follow(Ray ray) const;
  // Of an axis, or the diagonal.
  static constexpr int diagonal = 2;
  void cross_side(int side, Ray& ray) const;

  LargeVector<SceneFacet> facets_;
  std::vector<double> areas_;
  std::array<Boundary, 2> boundary_{};
  bool has_diagonal_ = false;
  Vec3d upper_;
  double source_height_ = 0;
  double lowest_ = 0;
  std::optional<EmbreeTree> tree_;
};

}  // namespace scarp
