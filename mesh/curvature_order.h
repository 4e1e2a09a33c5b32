#pragma once

#include <cstdint>
#include <vector>

#include "mesh/collapse.h"
#include "mesh/edge_sizes.h"
#include "mesh/placement.h"
#include "mesh/tracked_points.h"

namespace scarp {

/// The order of the method `curvature`: what adds least to the sum of the squared distances between
/// the vertices of the input and the surface goes first, with a little for the shape of the facets.
///
/// The exact sum is asked only of edges that an estimate ranks first: the squared distance between
/// the present surface and the next one, by area, and the shapes as they will be.
///
/// Sizes of edges as in EdgeSizes.
class CurvatureOrder {
 public:
  static constexpr bool by_cost = true;

  /// shape_weight: squared length that a facet of the worst shape (facet_shape.h) weighs for each
  /// of the points that facets here have on average. The points have to outlive the order.
  CurvatureOrder(const CollapseMesh& mesh, TrackedPoints& points, EdgeSizes sizes,
                 double shape_weight);

  bool wanted(const CollapseMesh& mesh, std::uint32_t h, double squared_length) const {
    return sizes_.wanted(mesh, h, squared_length);
  }

  /// placed: by area.
  double key(const CollapseMesh& mesh, std::uint32_t h, const Placed& placed,
             double squared_length) const;
  bool allows(const CollapseMesh& mesh, const CollapseChecks& checks) const {
    return sizes_.allows(mesh, checks);
  }
  const EdgeSizes& sizes() const { return sizes_; }
  double shape_weight() const { return shape_weight_; }
  double exact_key(const CollapseMesh& mesh, const CollapseChecks& checks) const;
  void accept(const CollapseMesh& mesh, const CollapseChecks& checks);
  void merged(std::uint32_t u, std::uint32_t v) { sizes_.merged(u, v); }

 private:
  /// By how much the shapes around h get worse, per point, with the merged vertex at r: what
  /// exact_key() adds, with as many points as that area has on average.
  double shape_estimate(const CollapseMesh& mesh, std::uint32_t h, Vec3d r) const;
  double exact_shapes(const CollapseMesh& mesh, const CollapseChecks& checks) const;
  static double new_shape(const CollapseMesh& mesh, const CollapseChecks& checks, int i);
  void find_shapes(const CollapseMesh& mesh);

  TrackedPoints& points_;
  EdgeSizes sizes_;
  double shape_weight_;
  double points_per_area_;  ///< twice the area
  double points_per_cost_;
  std::vector<float> shapes_;  ///< per facet; empty where they weigh nothing
};

}  // namespace scarp
