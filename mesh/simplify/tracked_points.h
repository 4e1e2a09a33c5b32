#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/simplify/collapse_mesh.h"
#include "mesh/simplify/star.h"

namespace scarp {

/// The facets of a star while its centre lies at r, for finding the one nearest to a place.
class Fan {
 public:
  Fan() = default;
  Fan(const CollapseMesh& mesh, const Star& star, Vec3d r, std::span<const Vec3d> normals) {
    spread(mesh, star, r, normals);
  }

  /// normals: twice the area vectors of the facets of the star. The mesh and the star have to
  /// outlive the fan.
  void spread(const CollapseMesh& mesh, const Star& star, Vec3d r, std::span<const Vec3d> normals);

  struct Nearest {
    std::uint32_t facet = HalfEdges::none;
    double squared_distance = 1e300;
  };

  /// The facet nearest to p among those of the star and those behind its rim. likely: number in the
  /// star of a facet that is asked first, and taken if p lies over it; -1: none.
  Nearest nearest(Vec3d p, int likely = -1) const;

 private:
  friend class TrackedPoints;

  struct Found {
    std::uint32_t point;
    Nearest nearest;
  };

  int sector(Vec3d d) const;
  bool is_over(int i, Vec3d d) const;
  Nearest over(int i, Vec3d d) const;
  Nearest nearest_of(int first, int count, Vec3d d) const;

  const CollapseMesh* mesh_ = nullptr;
  const Star* star_ = nullptr;
  Vec3d r_;
  Vec3d axis_;                                   ///< along the mean normal
  std::array<Vec3d, Star::capacity + 1> spoke_;  ///< from the centre to the ring vertices
  std::array<Vec3d, Star::capacity> normal_;     ///< twice the area vectors
  std::array<double, Star::capacity> square_;    ///< of the normals
  std::array<Vec3d, Star::capacity> to_first_;   ///< d has weight to_first d of ring vertex i,
  std::array<Vec3d, Star::capacity> to_second_;  ///< to_second d of the next, of square in all
  std::vector<Found> found_;                     ///< of the points of the star
  bool has_found_ = false;
};

/// The vertices of the input while their mesh is simplified: each belongs to the facet of the
/// current mesh that is nearest to it, as far as the changes around it can tell. So the distance
/// that all the changes together have made is known at any time, not only that of the last one.
///
/// Cost: 28 bytes per vertex of the input and 16 per facet.
class TrackedPoints {
 public:
  explicit TrackedPoints(const CollapseMesh& mesh);

  /// Of the places that the vertices of a mesh had before its edges were collapsed. merged_into:
  /// for each vertex the one that it went into last, or itself. Each place belongs to the facet
  /// that a walk from there ends at; beyond the bound, which no place is from the mesh, it is
  /// looked for all around.
  TrackedPoints(const CollapseMesh& mesh, LargeVector<Vec3d> places,
                std::span<const std::uint32_t> merged_into, double bound);

  /// By how much the sum of the squared distances grows when a star becomes a fan. The fan has to
  /// belong to the star.
  double growth(const Star& star, Fan& fan) const;

  /// Of the distances of the points of the facets of a star.
  double sum_of_squares(const Star& star) const;

  /// The mean number of points of the facets around a star.
  double per_facet(const Star& star) const;

  /// Gives the points of a star to the facets of its fan. To be called before the topology changes.
  void move(const Star& star, Fan& fan);

  /// Calls visit(place) for each point of a facet.
  template <class Visit>
  void for_each(std::uint32_t f, const Visit& visit) const {
    for (std::uint32_t p = first_[f]; p != HalfEdges::none; p = next_[p]) visit(places_[p]);
  }

  /// The greatest distance of a point to its facet: no vertex of the input is further from the
  /// mesh.
  double largest(const CollapseMesh& mesh) const;

 private:
  void add(std::uint32_t point, const Fan::Nearest& nearest);
  void find(const Star& star, Fan& fan) const;

  LargeVector<Vec3d> places_;         ///< per point, as the places of the mesh
  LargeVector<std::uint32_t> next_;   ///< per point: the next one of the same facet
  std::vector<std::uint32_t> first_;  ///< per facet: its first point
  std::vector<std::uint32_t> count_;  ///< per facet: how many points it has
  std::vector<double> squares_;       ///< per facet: sum of the squared distances of its points
};

}  // namespace scarp
