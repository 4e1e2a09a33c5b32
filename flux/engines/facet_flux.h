#pragma once

#include <span>
#include <vector>

#include "flux/engines/facet_values.h"
#include "flux/engines/view.h"
#include "flux/rays/problem.h"
#include "flux/rays/ray_plan.h"

namespace scarp {

/// The flux of facets, and its errors, from those of elements: along the planes of elements, but
/// nowhere below zero, and with what the normals of facets add.
class FacetFlux {
 public:
  /// All but the first two have to outlive this.
  /// number: of the problem among those of the view.
  /// Shape: flux by rank.
  FacetFlux(const FluxProblem& problem, std::size_t number, const RayPlan& plan,
            const FacetValues& values, const View& view, std::span<const double> flux);

  /// What a facet gets.
  double of(std::size_t facet) const;
  /// What all facets get.
  std::vector<float> of_all() const;
  /// Shape: draw_count for each rank, of which the first ones are taken.
  void draws(std::size_t facet, std::span<const float> of_ranks, std::span<double> draws) const;
  /// What makes the flux of a facet another one than with constants on elements.
  struct Changes {
    double by_planes = 0;  ///< of what elements send
    double by_tilts = 0;   ///< of facets from their elements
    /// How far the flux is from its planes, as far as neighbours show that it bends.
    double beyond_planes = 0;
    /// Of planes whose neighbours are all on one side: how far the flux is from them if it bends as
    /// is usual where it has an end.
    double by_one_side = 0;
  };
  /// Shape: by rank, the flux with constants.
  Changes changes(std::size_t facet, std::span<const double> constants) const;

 private:
  double of_element(std::size_t e) const { return flux_[plan_.rank_of(e)]; }
  void find_plane(std::size_t e);
  double by_tilt(std::size_t e, std::size_t facet) const;
  double along_one_side(Vec3d slope, Vec3d away, std::size_t e) const;

  const RayScene& scene_;
  const RayPlan& plan_;
  const FacetValues& values_;
  std::span<const double> flux_;
  std::vector<Vec3d> with_normal_;
  // Of the flux on each element.
  struct Plane {
    Vec3d slope;
    double part = 1;  // of what neighbours say of the slope; less where the flux would be negative
    double bend = 0;
    double square = 0;  // of distances from the middle, mean
  };
  std::vector<Plane> planes_;
};

}  // namespace scarp
