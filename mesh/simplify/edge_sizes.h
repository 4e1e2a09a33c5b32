#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "mesh/half_edges.h"
#include "mesh/simplify/collapse.h"

namespace scarp {

/// How long edges should be and may be, per vertex of a mesh that is simplified.
///
/// The size field is soft and makes the mesh coarser with the distance from where the surface
/// bends: an edge of more than twice its size costs more, by the square. Merging edges of one size
/// makes edges of up to two. The limits are hard: what is as long as its limit is not collapsed,
/// and no edge gets longer than twice its limit, or than one that it replaces.
struct EdgeSizes {
  std::vector<float> field;                                ///< soft, per vertex, or empty
  std::vector<float> limit;                                ///< hard, per vertex, or empty
  double l_max = std::numeric_limits<double>::infinity();  ///< hard
  bool only_old = false;  ///< the limits say what is collapsed, not how long edges may get

  bool has_limits() const {
    return !limit.empty() || l_max < std::numeric_limits<double>::infinity();
  }
  bool limit_new_edges() const { return has_limits() && !only_old; }
  double limit_between(std::uint32_t u, std::uint32_t v) const {
    if (limit.empty()) return l_max;
    return std::min({l_max, double{limit[u]}, double{limit[v]}});
  }

  /// Whether the collapse that the checks were asked for last keeps to the limits.
  bool allows(const CollapseMesh& mesh, const CollapseChecks& checks) const;
  /// The same for the flip of an edge, whose two facets the star is then.
  bool allows_flip(const CollapseMesh& mesh, const Star& star) const;

  /// What the cost of an edge is multiplied by.
  double stretch(std::uint32_t u, std::uint32_t v, double squared_length) const {
    if (field.empty()) return 1;
    const double size = 2 * std::min(field[u], field[v]);
    return squared_length > size * size ? squared_length / (size * size) : 1;
  }

  void merged(std::uint32_t u, std::uint32_t v) {
    if (!field.empty()) field[u] = std::min(field[u], field[v]);
    if (!limit.empty()) limit[u] = std::min(limit[u], limit[v]);
  }
};

/// A size for each vertex: l0 at features, and the growth of it from ring to ring as in the regions
/// of the published method (regions.h), in the limit of many rings: a size l grows by step_length
/// over a length l.
///
/// Distances from the features are counted in rings of the mesh, `ring` apart.
std::vector<float> graded_sizes(const HalfEdges& topology, const std::vector<bool>& is_feature,
                                double l0, double step_length, double ring);

}  // namespace scarp
