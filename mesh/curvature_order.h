#pragma once

#include <cstdint>
#include <vector>

#include "mesh/collapse.h"
#include "mesh/placement.h"
#include "mesh/tracked_points.h"

namespace scarp {

/// The order of the method `curvature`: what adds least to the sum of the squared distances between
/// the vertices of the input and the surface goes first, with a little for the shape of the facets.
///
/// The exact sum is asked only of edges that an estimate ranks first: the squared distance between
/// the present surface and the next one, by area, and the shapes as they will be. Where only the
/// bound stops it, all that the bound allows is collapsed sooner or later, and the estimate alone
/// ranks as well.
///
/// A size field makes the mesh coarser with the distance from where the surface bends. It is soft:
/// an edge of more than twice its size costs more, by the square. The size limits are hard.
class CurvatureOrder {
 public:
  static constexpr bool by_cost = true;

  struct Sizes {
    std::vector<float> field;  ///< soft, per vertex of the mesh
    std::vector<float> limit;  ///< hard, per vertex of the mesh, or empty
    double l_max;              ///< hard
  };

  enum class Rank { estimated, exact };

  /// shape_weight: squared length that a facet of the worst shape (facet_shape.h) weighs for each
  /// of the points that facets here have on average. The points have to outlive the order.
  CurvatureOrder(const CollapseMesh& mesh, TrackedPoints& points, Sizes sizes, double shape_weight,
                 Rank rank = Rank::exact);

  bool wanted(const CollapseMesh& mesh, std::uint32_t h, double squared_length) const;

  /// placed: by area.
  double key(const CollapseMesh& mesh, std::uint32_t h, const Placed& placed,
             double squared_length) const;
  /// Whether no edge gets longer than twice its limit, or than one that it replaces.
  bool allows(const CollapseMesh& mesh, const CollapseChecks& checks) const;
  /// The same for the flip of an edge, whose two facets the star is then.
  bool allows_flip(const CollapseMesh& mesh, const Star& star) const;
  double shape_weight() const { return shape_weight_; }
  bool ranks_exactly() const { return rank_ == Rank::exact; }
  double exact_key(const CollapseMesh& mesh, const CollapseChecks& checks) const;
  void accept(const CollapseMesh& mesh, const CollapseChecks& checks);
  void merged(std::uint32_t u, std::uint32_t v);

 private:
  double limit(std::uint32_t u, std::uint32_t v) const;
  /// By how much the shapes around h get worse, per point, with the merged vertex at r: what
  /// exact_key() adds, with as many points as that area has on average.
  double shape_estimate(const CollapseMesh& mesh, std::uint32_t h, Vec3d r) const;
  double exact_shapes(const CollapseMesh& mesh, const CollapseChecks& checks) const;
  static double new_shape(const CollapseMesh& mesh, const CollapseChecks& checks, int i);
  void find_shapes(const CollapseMesh& mesh);
  double stretch(std::uint32_t u, std::uint32_t v, double squared_length) const;

  TrackedPoints& points_;
  Sizes sizes_;
  double shape_weight_;
  double points_per_area_;  ///< twice the area
  double points_per_cost_;
  Rank rank_;
  std::vector<float> shapes_;  ///< per facet; empty where they weigh nothing
};

/// A size for each vertex: l0 at features, and the growth of it from ring to ring as in the regions
/// of the published method (regions.h), in the limit of many rings: a size l grows by step_length
/// over a length l.
///
/// Distances from the features are counted in rings of the mesh, `ring` apart.
std::vector<float> graded_sizes(const HalfEdges& topology, const std::vector<bool>& is_feature,
                                double l0, double step_length, double ring);

}  // namespace scarp
