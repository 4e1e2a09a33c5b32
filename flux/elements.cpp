#include "flux/elements.h"

namespace scarp {

namespace {

// A facet is cut into at most 2^10 elements.
constexpr int most_cuts = 10;

std::array<Vec3d, 3> as_double(const std::array<Vec3f, 3>& corners) {
  return {Vec3d(corners[0]), Vec3d(corners[1]), Vec3d(corners[2])};
}

// The shares of the corners of a facet at a point of it.
std::array<double, 3> shares(const std::array<Vec3d, 3>& corners, Vec3d n, Vec3d r) {
  const auto& [a, b, c] = corners;
  return {dot(n, cross(b - r, c - r)), dot(n, cross(c - r, a - r)), dot(n, cross(a - r, b - r))};
}

}  // namespace

Elements::Elements(const RayScene& scene, double longest_edge) : scene_(&scene) {
  for (std::uint32_t f = 0; f < scene.facet_count(); ++f) {
    first_.push_back(static_cast<std::uint32_t>(corners_.size()));
    root_.push_back(cut(f, as_double(scene.corners(f)), scene.area(f), longest_edge, 0));
  }
  first_.push_back(static_cast<std::uint32_t>(corners_.size()));
}

// The halves of (p, q, r), cut from p to the middle m of q and r, are (p, q, m) and (p, m, r).
std::uint32_t Elements::cut(std::uint32_t facet, const std::array<Vec3d, 3>& corners, double area,
                            double longest_edge, int depth) {
  int opposite = 0;
  double longest = 0;
  for (int corner = 0; corner < 3; ++corner) {
    const double edge = length(corners[(corner + 2) % 3] - corners[(corner + 1) % 3]);
    if (edge > longest) {
      longest = edge;
      opposite = corner;
    }
  }
  const auto node = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  if (longest <= longest_edge || depth == most_cuts) {
    nodes_[node].next = static_cast<std::uint32_t>(corners_.size());
    corners_.push_back(corners);
    area_.push_back(area);
    facet_.push_back(facet);
    return node;
  }
  const Vec3d p = corners[opposite];
  const Vec3d q = corners[(opposite + 1) % 3];
  const Vec3d r = corners[(opposite + 2) % 3];
  const Vec3d m = 0.5 * (q + r);
  const std::uint32_t next = cut(facet, {p, q, m}, area / 2, longest_edge, depth + 1);
  const std::uint32_t other = cut(facet, {p, m, r}, area / 2, longest_edge, depth + 1);
  nodes_[node] = {.corner = opposite, .next = next, .other = other};
  return node;
}

// A point with shares (p, q, r) has shares (p, q - r, 2 r) in the half (p, q, m) if q >= r, and
// (p, 2 q, r - q) in the other half if not.
std::uint32_t Elements::at(std::uint32_t facet, Vec3d r) const {
  const Node* node = &nodes_[root_[facet]];
  if (node->corner < 0) return node->next;
  auto share = shares(as_double(scene_->corners(facet)), scene_->normal(facet), r);
  while (node->corner >= 0) {
    const double of_p = share[node->corner];
    const double of_q = share[(node->corner + 1) % 3];
    const double of_r = share[(node->corner + 2) % 3];
    if (of_q >= of_r) {
      share = {of_p, of_q - of_r, 2 * of_r};
      node = &nodes_[node->next];
    } else {
      share = {of_p, 2 * of_q, of_r - of_q};
      node = &nodes_[node->other];
    }
  }
  return node->next;
}

}  // namespace scarp
