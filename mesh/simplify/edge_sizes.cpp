#include "mesh/simplify/edge_sizes.h"

#include <cmath>
#include <utility>

namespace scarp {

bool EdgeSizes::allows(const CollapseMesh& mesh, const CollapseChecks& checks) const {
  if (!limit_new_edges()) return true;
  const Star& star = checks.star();
  for (int i = 0; i <= star.count; ++i) {
    const std::uint32_t w = star.ring[i];
    const double longest = 2 * std::min(limit_between(star.u, w), limit_between(star.v, w));
    const Vec3d edge = mesh.r[w] - checks.place();
    const bool at_target = star.at_target[i < star.count ? i : i - 1];
    const Vec3d old_edge = mesh.r[w] - mesh.r[at_target ? star.v : star.u];
    const double square = dot(edge, edge);
    if (square > longest * longest && square > dot(old_edge, old_edge)) return false;
  }
  return true;
}

bool EdgeSizes::allows_flip(const CollapseMesh& mesh, const Star& star) const {
  const double longest = 2 * limit_between(star.u, star.ring[1]);
  const Vec3d edge = mesh.r[star.ring[1]] - mesh.r[star.u];
  const Vec3d old_edge = mesh.r[star.ring[2]] - mesh.r[star.ring[0]];
  return dot(edge, edge) <= std::max(longest * longest, dot(old_edge, old_edge));
}

std::vector<float> graded_sizes(const HalfEdges& topology, const std::vector<bool>& is_feature,
                                double l0, double step_length, double ring) {
  constexpr float unreached = std::numeric_limits<float>::infinity();
  std::vector<float> sizes(topology.vertex_count(), unreached);
  std::vector<std::uint32_t> front;
  for (std::uint32_t v = 0; v < sizes.size(); ++v) {
    if (!is_feature[v] || topology.outgoing(v) == HalfEdges::none) continue;
    sizes[v] = static_cast<float>(l0);
    front.push_back(v);
  }
  for (int count = 1; !front.empty(); ++count) {
    // dl/ds = step_length / l at the distance s.
    const double size = std::sqrt(l0 * l0 + 2 * step_length * count * ring);
    std::vector<std::uint32_t> next;
    for (const std::uint32_t v : front) {
      topology.for_each_neighbour(v, [&](std::uint32_t w) {
        if (sizes[w] != unreached) return;
        sizes[w] = static_cast<float>(size);
        next.push_back(w);
      });
    }
    front = std::move(next);
  }
  return sizes;
}

}  // namespace scarp
