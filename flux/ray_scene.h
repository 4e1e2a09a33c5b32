#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/frame.h"
#include "core/huge_pages.h"
#include "core/tri_mesh.h"
#include "core/vec3.h"
#include "flux/facet_grid.h"
#include "flux/ray.h"

namespace scarp {

/// A surface between the lateral sides of the domain, prepared for flights.
///
/// The next facet on a flight is decided by a test of our own whose signs are exact: nothing slips
/// between facets with a common edge or vertex, and of two facets at the same distance the lower
/// index wins. A grid of cells finds the candidates, with more room than rounding takes, so that
/// the choice of instructions cannot change a result. The facet a flight starts from is none of its
/// candidates, which takes the place of an offset of the origin. Sides are planes where the flight
/// is mirrored or wrapped; they hold no geometry.
///
/// Units: lengths in grid spacings, relative to the lower corner of the sides and the middle of
/// the mesh's height.
class RayScene {
 public:
  /// spacing: of the grid, > 0.
  /// Throws: InputError for a mesh without triangles, a facet of zero area, a vertex outside the
  /// sides or not finite.
  RayScene(const TriMesh& mesh, const Sides& sides, double spacing);

  /// Sets of a processor's instructions, each with those before.
  enum class Instructions { sse2, avx2, avx512 };

  /// Thread-safe.
  Flight fly(const Ray& ray) const;
  /// The end of each, in a third of the time if there are many; faster if those that start close
  /// together follow each other. To the last bit the same with all instructions; those up to
  /// newest that the machine has are used.
  /// Shape: as many flights as rays.
  void fly(std::span<const Ray> rays, std::span<Flight> flights,
           Instructions newest = Instructions::avx512) const;

  /// Flights that are given and taken in blocks, so that none waits for the last of its block.
  class Traffic {
   public:
    static constexpr std::size_t block_size = 64;
    struct Landing {
      std::uint32_t number = 0;
      Flight flight{};
    };

    /// Fills in the rays number first, first + 1, ... One may be asked for again until it lands.
    virtual void depart(std::uint32_t first, std::span<Ray> rays) = 0;
    /// In any order.
    virtual void land(std::span<const Landing> landings) = 0;

   protected:
    ~Traffic() = default;
  };
  void fly(std::uint32_t count, Traffic& traffic, Instructions newest = Instructions::avx512) const;

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
  double source_area() const { return (has_diagonal_ ? 0.5 : 1) * upper_.x * upper_.y; }
  /// Whether the domain ends at x = y, too; see Sides.
  bool has_diagonal() const { return has_diagonal_; }

 private:
  class Port;
  class Wave;

  void place(const TriMesh& mesh, const Sides& sides, double spacing);
  void fly_with_sse2(Port& port) const;
  void fly_with_avx2(Port& port) const;
  void fly_with_avx512(Port& port) const;
  // Of an axis, or the diagonal.
  static constexpr int diagonal = 2;
  void cross_side(int side, Ray& ray) const;

  LargeVector<FacetGrid::Facet> facets_;
  std::vector<double> areas_;
  std::array<Boundary, 2> boundary_{};
  bool has_diagonal_ = false;
  Vec3d upper_;
  double source_height_ = 0;
  double lowest_ = 0;
  FacetGrid grid_;
};

}  // namespace scarp
