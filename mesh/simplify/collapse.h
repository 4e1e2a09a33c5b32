#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "mesh/simplify/collapse_mesh.h"
#include "mesh/simplify/error_bound.h"
#include "mesh/simplify/star.h"
#include "mesh/simplify/tracked_points.h"

namespace scarp {

/// What a collapse may not do to the facets around it, whatever the method.
class CollapseChecks {
 public:
  /// max_error bounds the distance to the input; border_error how far a border between materials
  /// may be cut short.
  CollapseChecks(const CollapseMesh& mesh, ErrorLimit max_error, double border_error);

  CollapseChecks(CollapseChecks&&) = default;

  /// Checks that share with these what of the limits is used up, so that blocks of the mesh can be
  /// worked on at the same time (blocks.h). These have to outlive them.
  CollapseChecks sharing();

  /// Gathers the star of h and the facets that it has with the merged vertex at r. False if there
  /// are too many of them, or none.
  bool gather(const CollapseMesh& mesh, std::uint32_t h, Vec3d r);

  /// Whether h may be collapsed to r, to be asked in this order after gather(): no facet flips or
  /// loses its area, and borders stay; then, more expensive, that the bound holds.
  bool keeps_surface(const CollapseMesh& mesh, std::uint32_t h);
  bool keeps_bound(const CollapseMesh& mesh) { return keeps_bound(mesh, star_, place_); }

  // The same for a star that the caller has gathered and checked otherwise: inside a closed rim,
  // away from borders. With what the bound will say of its facets.
  bool keeps_bound(const CollapseMesh& mesh, const Star& star, Vec3d r);
  void accept(const Star& star) { bound_.accept(star); }
  double error(std::uint32_t f) const { return bound_.error(f); }

  /// To be called right before the collapse that was allowed last.
  void accept(const CollapseMesh& mesh, std::uint32_t h);

  /// Makes the star that of a vertex; then whether the vertex may move to r without turning a facet
  /// much against a reference (per facet of the mesh), to be followed by keeps_bound() and
  /// accept_move(). Not for vertices of borders between materials.
  bool gather_vertex(const CollapseMesh& mesh, std::uint32_t v) {
    return star_.gather_vertex(mesh.topology, v);
  }
  bool may_move(const CollapseMesh& mesh, Vec3d r, std::span<const Vec3d> reference) {
    place_at(mesh, r);
    return keeps_facets(mesh) && turns_little(reference) && makes_no_fold(mesh);
  }

  /// Makes the star that of the two facets of the inner edge h after its flip; then whether it may
  /// be flipped, to be followed by keeps_bound_of_flip() and accept_move().
  void gather_flip(const CollapseMesh& mesh, std::uint32_t h);
  bool may_flip(const CollapseMesh& mesh, std::uint32_t h, std::span<const Vec3d> reference) const;
  bool keeps_bound_of_flip(const CollapseMesh& mesh) { return bound_.allows_flip(mesh, star_); }
  void accept_move() { bound_.accept(star_); }

  // Of the change that was asked for last: the facets around, where their centre goes, twice their
  // area vectors then, and what they are for points.
  const Star& star() const { return star_; }
  Vec3d place() const { return place_; }
  std::span<const Vec3d> normals() const { return normals_; }
  Fan& fan(const CollapseMesh& mesh) {
    if (!fan_is_spread_) fan_.spread(mesh, star_, place_, normals_);
    fan_is_spread_ = true;
    return fan_;
  }
  /// Whether the bound has refused anything so far.
  bool bound_was_met() const { return bound_was_met_; }
  void note_bound_was_met() { bound_was_met_ = true; }
  /// No facet around a change may be one of these.
  void keep(std::span<const std::uint32_t> facets) { bound_.keep(facets); }
  /// Raises a bound that has refused something. False if it has not, or may not be raised.
  bool raise_bound();
  double bound() const { return bound_.limit(); }
  double proven_error(const HalfEdges& topology) const;

 private:
  CollapseChecks() = default;

  void place_at(const CollapseMesh& mesh, Vec3d r);
  bool keeps_facets(const CollapseMesh& mesh) const;
  bool is_chamfer(const CollapseMesh& mesh, Vec3d n) const;
  bool turns_little(std::span<const Vec3d> reference) const;
  bool makes_no_fold(const CollapseMesh& mesh) const;
  bool keeps_border(const CollapseMesh& mesh, std::uint32_t h);

  Star star_;
  Vec3d place_;
  std::array<Vec3d, Star::capacity> normals_;
  // The room for it is kept, and it is spread where it is asked for.
  Fan fan_;
  bool fan_is_spread_ = false;
  ErrorBound bound_;
  std::vector<double> own_border_shift_;
  std::span<double> border_shift_;  ///< per vertex, only where there are materials
  double border_error_ = 0;
  double new_border_shift_ = 0;
  bool bound_was_met_ = false;
};

}  // namespace scarp
