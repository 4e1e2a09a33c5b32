#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/tri_mesh.h"
#include "core/vec3.h"

namespace scarp {

/// The start of a straight flight: from a facet, or from no facet.
struct Ray {
  static constexpr std::uint32_t no_facet = std::numeric_limits<std::uint32_t>::max();

  Vec3d r;
  Vec3d u;
  std::uint32_t from = no_facet;
};

/// The end of a straight flight; r and u are the place and the direction there, mirrored and
/// wrapped at the sides.
struct Flight {
  enum class End {
    front,       ///< arrived on the gas side of a facet
    back,        ///< arrived on the solid side of a facet: the mesh has a gap
    sky,         ///< left through the source plane
    below,       ///< left below the lowest vertex: the mesh has a gap
    side_limit,  ///< crossed the sides a million times
  };
  End end = End::sky;
  std::uint32_t facet = Ray::no_facet;
  Vec3d r;
  Vec3d u;
};

/// A surface between the lateral sides of the domain, prepared for flights.
///
/// The next facet on a flight is decided by a test of our own whose signs are exact: nothing slips
/// between facets with a common edge or vertex, and of two facets at the same distance the lower
/// index wins. Embree only finds the candidates, in boxes padded by more than
/// its rounding, so its choice of instructions cannot change a result. The facet a flight starts
/// from is left out of its candidates, which takes the place of an offset of the origin. Sides are
/// planes where the flight is mirrored or wrapped; they hold no geometry.
///
/// Units: lengths in grid spacings, relative to the lower corner of the sides and the middle of
/// the mesh's height.
class RayScene {
 public:
  struct Options {
    double spacing = 0;  ///< of the grid, > 0
    std::string embree;  ///< configuration of Embree's device, for example "isa=sse2"
  };

  /// Throws: InputError for a mesh without triangles, a facet of zero area, a vertex outside the
  /// sides or not finite.
  RayScene(const TriMesh& mesh, const Sides& sides, const Options& options);
  ~RayScene();
  RayScene(RayScene&&) noexcept;
  RayScene& operator=(RayScene&&) noexcept;

  /// Thread-safe.
  Flight fly(const Ray& ray) const;

  std::size_t facet_count() const { return facets_.size(); }
  const std::array<Vec3f, 3>& corners(std::size_t facet) const { return facets_[facet]; }
  Vec3d normal(std::size_t facet) const { return normals_[facet]; }
  double area(std::size_t facet) const { return areas_[facet]; }

  /// The domain seen from above, from (0, 0) to here.
  Vec3d upper() const { return upper_; }
  /// The source plane: one spacing above the highest vertex.
  double source_height() const { return source_height_; }
  double lowest() const { return lowest_; }
  double source_area() const { return upper_.x * upper_.y; }

 private:
  struct Device;
  struct Nearest;

  void place(const TriMesh& mesh, const Sides& sides, double spacing);
  void cross_side(int axis, Ray& ray) const;
  void find_nearest(Nearest& nearest) const;

  std::vector<std::array<Vec3f, 3>> facets_;
  std::vector<Vec3d> normals_;
  std::vector<double> areas_;
  std::array<Boundary, 2> boundary_{};
  Vec3d upper_;
  double source_height_ = 0;
  double lowest_ = 0;
  float padding_ = 0;
  std::unique_ptr<Device> device_;
};

}  // namespace scarp
