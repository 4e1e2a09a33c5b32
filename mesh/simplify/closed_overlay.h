#pragma once

#include <array>
#include <span>

#include "mesh/lanes.h"
#include "mesh/simplify/collapse_mesh.h"
#include "mesh/simplify/star.h"

namespace scarp {

/// The two surfaces inside the closed rim of a star, as height fields over one plane: as the
/// overlay of error_bound.cpp, which knows open stars as well, with two facets or spokes at a time.
///
/// In double precision: its rounding is some 1e-16 of the size of the star.
class ClosedOverlay {
 public:
  static constexpr int capacity = 30;  ///< facets of a star

  /// The surfaces when the edge or vertex of the star goes to r, seen along the unit vector n.
  /// False if they are not height fields that cover the same part of the plane, once.
  bool lay(const CollapseMesh& mesh, const Star& star, Vec3d r, Vec3d n);

  /// For each facet after the collapse: the greatest number of the old facets that it meets, and
  /// the greatest height difference to them. old_error: of the facets of the star, then of the two
  /// that die (0 where none does). After lay().
  void bound(std::span<const double> old_error, std::span<double> proposed) const;

 private:
  static constexpr int padded = capacity + 2 * double_lanes;
  using Row = std::array<double, padded>;

  /// A point seen along the direction of projection, relative to the merged vertex.
  struct Flat {
    double x;
    double y;
    double z;  ///< height
  };

  /// Where a point lies: the facet that it is in, or least outside of, and its height there.
  struct Place {
    double inside = -1e300;  ///< the lowest of the three weights
    double height = 0;
    int facet = 0;
  };

  /// An old edge inside the rim, with the greater number of its two facets.
  struct Edge {
    Flat from;
    Flat along;
    double error;
  };

  /// What the overlay says of the facets that share a spoke.
  struct Spokes {
    Row difference;
    Row error;
  };

  void project(const CollapseMesh& mesh, const Star& star, Vec3d r, Vec3d n);
  bool find_places();
  bool look_at_dying();
  void offer_dying(const Flat& a, const Flat& b, const Flat& c, double area, int facet);
  Flat ring(int i) const { return {x_[i], y_[i], z_[i]}; }
  int old_edges(std::span<const double> old_error, std::span<Edge> edges) const;
  Spokes cross_spokes(std::span<const Edge> edges) const;

  int count_ = 0;
  bool is_vertex_ = false;  ///< whose star it is; else that of an edge
  int at_origin_ = 0;       ///< so many facets are at u, the others at v
  Row x_;                   ///< of the ring, which is repeated at the end
  Row y_;
  Row z_;
  Flat u_;
  Flat v_;
  Place merged_in_old_;
  Place u_in_new_;
  Place v_in_new_;
};

}  // namespace scarp
