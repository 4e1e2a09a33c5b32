#include "mesh/curvature_order.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "mesh/facet_shape.h"

namespace scarp {

namespace {

/// Estimates are taken a little too low: one that is too low is corrected, one that is too high
/// comes too late.
constexpr double optimism = 0.5;

/// How many times its size an edge may be long at no cost. Merging edges of one size makes edges of
/// up to two.
constexpr double free_stretch = 2;

}  // namespace

CurvatureOrder::CurvatureOrder(const CollapseMesh& mesh, TrackedPoints& points, Sizes sizes,
                               double shape_weight, Rank rank)
    : points_(points), sizes_(std::move(sizes)), shape_weight_(shape_weight), rank_(rank) {
  double twice_area = 0;
  for (const Vec3d n : mesh.normals) twice_area += length(n);
  // The height of the next surface over a facet falls from h at one corner to 0 at the others; its
  // mean square is h^2 / 6. The cost has h^2 times twice the area.
  points_per_cost_ = twice_area > 0 ? optimism * mesh.live_vertices / (6 * twice_area) : 0;
}

bool CurvatureOrder::wanted(const CollapseMesh& mesh, std::uint32_t h,
                            double squared_length) const {
  const double longest = limit(mesh.topology.origin(h), mesh.topology.target(h));
  return squared_length < longest * longest;
}

double CurvatureOrder::limit(std::uint32_t u, std::uint32_t v) const {
  if (sizes_.limit.empty()) return sizes_.l_max;
  return std::min({sizes_.l_max, double{sizes_.limit[u]}, double{sizes_.limit[v]}});
}

bool CurvatureOrder::allows(const CollapseMesh& mesh, const CollapseChecks& checks) const {
  const Star& star = checks.star();
  for (int i = 0; i <= star.count; ++i) {
    const std::uint32_t w = star.ring[i];
    const double longest = 2 * std::min(limit(star.u, w), limit(star.v, w));
    const Vec3d edge = mesh.r[w] - checks.place();
    const bool at_target = star.at_target[i < star.count ? i : i - 1];
    const Vec3d old_edge = mesh.r[w] - mesh.r[at_target ? star.v : star.u];
    const double square = dot(edge, edge);
    if (square > longest * longest && square > dot(old_edge, old_edge)) return false;
  }
  return true;
}

bool CurvatureOrder::allows_flip(const CollapseMesh& mesh, const Star& star) const {
  const double longest = 2 * limit(star.u, star.ring[1]);
  const Vec3d edge = mesh.r[star.ring[1]] - mesh.r[star.u];
  const Vec3d old_edge = mesh.r[star.ring[2]] - mesh.r[star.ring[0]];
  return dot(edge, edge) <= std::max(longest * longest, dot(old_edge, old_edge));
}

double CurvatureOrder::stretch(std::uint32_t u, std::uint32_t v, double squared_length) const {
  const double size = free_stretch * std::min(sizes_.field[u], sizes_.field[v]);
  return squared_length > size * size ? squared_length / (size * size) : 1;
}

double CurvatureOrder::key(const CollapseMesh& mesh, std::uint32_t h, double cost,
                           double squared_length) const {
  return points_per_cost_ * cost *
         stretch(mesh.topology.origin(h), mesh.topology.target(h), squared_length);
}

double CurvatureOrder::exact_key(const CollapseMesh& mesh, const CollapseChecks& checks) const {
  const Star& star = checks.star();
  double key = points_.growth(star, checks.fan(mesh));
  key += shape_weight_ * points_.per_facet(star) *
         shape_growth(mesh, star, checks.place(), checks.normals());
  if (!(key > 0)) return key;
  const Vec3d edge = mesh.r[star.v] - mesh.r[star.u];
  return key * stretch(star.u, star.v, dot(edge, edge));
}

void CurvatureOrder::accept(const CollapseMesh& mesh, const CollapseChecks& checks) {
  points_.move(checks.star(), checks.fan(mesh));
}

void CurvatureOrder::merged(std::uint32_t u, std::uint32_t v) {
  sizes_.field[u] = std::min(sizes_.field[u], sizes_.field[v]);
  if (!sizes_.limit.empty()) sizes_.limit[u] = std::min(sizes_.limit[u], sizes_.limit[v]);
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
