#include "levelset/surface/crease.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/vector_kernel.h"
#include "levelset/grid/band.h"

namespace scarp {

namespace {

/// Differences of slope between neighbouring intervals from which on phi counts as creased: fully
/// at the second. On a smooth surface they are 1 / radius in spacings, and then both ways of
/// finding a cut are of the same order.
constexpr float crease_starts = 0.05F;
constexpr float crease_is_full = 0.1F;

/// Steeper than this is not a distance.
constexpr float steepest = 1.3F;

/// Edges with normals closer than 35 degrees, or nearly opposite (a wall thinner than a spacing),
/// are left as they are.
constexpr double smooth_cosine = 0.82;
constexpr double least_sine = 0.4;

/// An added vertex keeps this distance, in spacings, from the border of its face, and from cuts.
constexpr double margin = 1e-3;
constexpr double least_distance = 0.02;

/// Pulls a meeting point to its start where the planes do not fix it.
constexpr double pull = 0.02;

/// Reads phi along an axis from a node; within the node's leaf without a look-up.
class Line {
 public:
  Line(const Band& band, std::array<int, 3> node, int axis)
      : band_(band), node_(node), axis_(axis) {
    const std::array<int, 3> stored{band.fold(0, node[0]), band.fold(1, node[1]), node[2]};
    const int leaf = band.find(stored[0] >> 3, stored[1] >> 3, stored[2] >> 3);
    if (leaf >= 0 && stored == node) {
      const int last = axis < 2 ? band.node_count(axis) - 1 : node[2] | (leaf_edge - 1);
      local_ = node[axis] & (leaf_edge - 1);
      count_ = std::min(leaf_edge, last - node[axis] + local_ + 1);
      here_ = band.leaves()[static_cast<std::size_t>(leaf)].phi +
              leaf_offset(node[0], node[1], node[2]);
    }
  }

  float operator()(int step) const {
    if (local_ + step >= 0 && local_ + step < count_) {
      return here_[std::ptrdiff_t{step} * (1 << (6 - 3 * axis_))];
    }
    std::array<int, 3> at = node_;
    at[axis_] += step;
    return band_.node(at[0], at[1], at[2]);
  }

 private:
  const Band& band_;
  const std::array<int, 3> node_;
  int axis_;
  int local_ = 0;
  int count_ = 0;
  const float* here_ = nullptr;
};

/// phi along an edge that is cut, and what lies beyond its two ends, seen from one end or the
/// other.
struct EdgeProfile {
  float here = 0;
  float there = 0;
  float between = 0;  ///< slopes, positive towards the gas
  float beyond_here = 0;
  float beyond_there = 0;
  bool at_here = true;  ///< which end belongs to the face that is cut, if the other does not
  float trust = 0;      ///< in that, from 0 to 1

  float slope() const { return at_here ? beyond_here : beyond_there; }
};

/// phi holds the nodes of EdgeSamples.
SCARP_KERNEL_PART EdgeProfile edge_profile(const std::array<float, EdgeSamples::nodes>& phi) {
  EdgeProfile edge;
  edge.here = phi[2];
  edge.there = phi[3];
  const float side = edge.here < 0 ? 1.0F : -1.0F;
  edge.between = side * (edge.there - edge.here);
  edge.beyond_here = side * (edge.here - phi[1]);
  edge.beyond_there = side * (phi[4] - edge.there);
  edge.at_here = edge.beyond_here >= edge.beyond_there;
  const float slope = edge.at_here ? edge.beyond_here : edge.beyond_there;
  const float kink = slope - edge.between;
  // On a curved surface slopes change beyond the edge as much as on it: no crease then.
  const float from = edge.at_here ? phi[1] : phi[5];
  const float to = edge.at_here ? phi[0] : phi[4];
  const float bend = std::abs(side * (from - to) - slope);
  const float trust = (kink - 2 * bend - crease_starts) / (crease_is_full - crease_starts);
  const bool may_be_creased = slope <= steepest && kink > crease_starts;
  edge.trust = may_be_creased ? std::min(std::max(trust, 0.0F), 1.0F) : 0.0F;
  return edge;
}

EdgeProfile edge_profile(const Band& band, std::array<int, 3> node, int axis) {
  const Line line(band, node, axis);
  std::array<float, EdgeSamples::nodes> phi{};
  for (int n = 0; n < EdgeSamples::nodes; ++n) phi[n] = line(n - EdgeSamples::before);
  return edge_profile(phi);
}

SCARP_KERNEL_PART float cut_part(const EdgeProfile& edge) {
  const float linear = edge.here / (edge.here - edge.there);
  const float end = std::abs(edge.at_here ? edge.here : edge.there) / edge.slope();
  const float prolonged = edge.at_here ? end : 1 - end;
  const float inside = std::min(std::max(prolonged, 0.0F), 1.0F);
  return edge.trust > 0 ? linear + edge.trust * (inside - linear) : linear;
}

/// One of two one-sided differences, or their mean where they agree.
struct Slopes {
  double backward = 0;
  double forward = 0;

  bool agree() const { return std::abs(forward - backward) < crease_starts; }
  double pick(bool use_forward) const {
    return agree() ? 0.5 * (backward + forward) : use_forward ? forward : backward;
  }
};

Slopes slopes_at(const Band& band, std::array<int, 3> node, int axis) {
  const Line phi(band, node, axis);
  const double here = phi(0);
  return {here - phi(-1), phi(1) - here};
}

}  // namespace

float cut_part(const Band& band, std::array<int, 3> node, int axis) {
  return cut_part(edge_profile(band, node, axis));
}

SCARP_VECTOR_KERNEL void cut_parts(const EdgeSamples& edges, int count, float* parts) {
  for (int e = 0; e < count; ++e) {
    std::array<float, EdgeSamples::nodes> phi{};
    for (int n = 0; n < EdgeSamples::nodes; ++n) phi[n] = edges.phi[n][e];
    parts[e] = cut_part(edge_profile(phi));
  }
}

Vec3d cut_normal(const Band& band, std::array<int, 3> node, int axis) {
  const EdgeProfile edge = edge_profile(band, node, axis);
  const float side = edge.here < 0 ? 1.0F : -1.0F;
  // Read at the end that belongs to the face that is cut; at the nearer one if both do.
  const bool creased = edge.trust > 0;
  const bool at_low = creased ? edge.at_here : std::abs(edge.here) <= std::abs(edge.there);
  std::array<int, 3> end = node;
  end[axis] += at_low ? 0 : 1;
  Vec3d along;
  along[axis] = side * (creased ? edge.slope() : edge.between);

  const int b = (axis + 1) % 3;
  const int c = (axis + 2) % 3;
  const Slopes slopes_b = slopes_at(band, end, b);
  const Slopes slopes_c = slopes_at(band, end, c);
  // Of the one-sided differences those are right that make the slope of a distance, 1; where
  // several do, by symmetry, none of them is better than its image.
  Vec3d best;
  double smallest = 1e300;
  for (int choice = 0; choice < 4; ++choice) {
    Vec3d gradient = along;
    gradient[b] = slopes_b.pick((choice & 1) != 0);
    gradient[c] = slopes_c.pick((choice & 2) != 0);
    const double misfit = std::abs(dot(gradient, gradient) - 1);
    if (misfit == smallest) best += gradient;
    if (misfit < smallest) {
      smallest = misfit;
      best = gradient;
    }
  }
  return normalized(best);
}

namespace {

/// A cut of one side of a face, in the plane of the face.
struct FaceCut {
  Eigen::Vector2d point;
  Eigen::Vector2d normal;
};

/// The cut of the edge from `node` along `axis`, as seen in the face.
FaceCut face_cut(const Band& band, std::array<int, 3> node, int axis, std::array<int, 3> origin,
                 std::array<int, 2> axes) {
  const float part = cut_part(band, node, axis);
  const Vec3d normal = cut_normal(band, node, axis);
  FaceCut cut;
  for (int n = 0; n < 2; ++n) {
    cut.point[n] = node[axes[n]] - origin[axes[n]] + (axes[n] == axis ? part : 0.0F);
    cut.normal[n] = normal[axes[n]];
  }
  return cut;
}

std::optional<std::array<float, 2>> tangents_meet(const FaceCut& a, const FaceCut& b) {
  const double lengths = a.normal.norm() * b.normal.norm();
  Eigen::Matrix2d normals;
  normals << a.normal.transpose(), b.normal.transpose();
  const double sine = normals.determinant();
  if (lengths < 0.25 || a.normal.dot(b.normal) > smooth_cosine * lengths ||
      std::abs(sine) < least_sine * lengths) {
    return std::nullopt;
  }
  const Eigen::Vector2d offsets{a.normal.dot(a.point), b.normal.dot(b.point)};
  const Eigen::Vector2d meeting = normals.inverse() * offsets;
  // A corner beyond the face is drawn back to its border, towards the middle of the two cuts.
  const Eigen::Vector2d middle = 0.5 * (a.point + b.point);
  double share = 1;
  for (int n = 0; n < 2; ++n) {
    const double bound = meeting[n] > middle[n] ? 1 - margin : margin;
    const double way = meeting[n] - middle[n];
    if (way != 0) {
      share = std::min(share, std::max((bound - middle[n]) / way, 0.0));
    }
  }
  std::array<float, 2> corner{};
  for (int n = 0; n < 2; ++n) {
    corner[n] = static_cast<float>(middle[n] + share * (meeting[n] - middle[n]));
  }
  for (const FaceCut& cut : {a, b}) {
    if ((Eigen::Vector2d(corner[0], corner[1]) - cut.point).norm() < least_distance) {
      return std::nullopt;
    }
  }
  return corner;
}

/// The corners of a grid face, and phi there.
struct Face {
  std::array<int, 2> axes;
  std::array<std::array<int, 3>, 4> corners;
  std::array<float, 4> phi;

  Face(const Band& band, std::array<int, 3> node, int normal)
      : axes{(normal + 1) % 3, (normal + 2) % 3} {
    for (int n = 0; n < 4; ++n) {
      corners[n] = node;
      corners[n][axes[0]] += n & 1;
      corners[n][axes[1]] += n >> 1;
      phi[n] = band.node(corners[n][0], corners[n][1], corners[n][2]);
    }
  }

  float twist() const { return std::abs((phi[0] - phi[1]) - (phi[2] - phi[3])); }
};

/// band_of(node, axis): whose phi tells of a cut.
template <class BandOf>
std::optional<std::array<float, 2>> corner_of(const Face& face, const BandOf& band_of) {
  std::array<FaceCut, 4> cuts;
  int count = 0;
  const auto look = [&](int from, int to, int along) {
    if ((face.phi[from] < 0) == (face.phi[to] < 0)) return;
    const std::array<int, 3>& node = face.corners[from];
    const int axis = face.axes[along];
    cuts[count++] = face_cut(band_of(node, axis), node, axis, face.corners[0], face.axes);
  };
  look(0, 1, 0);
  look(2, 3, 0);
  look(0, 2, 1);
  look(1, 3, 1);
  return count == 2 ? tangents_meet(cuts[0], cuts[1]) : std::nullopt;
}

}  // namespace

std::optional<std::array<float, 2>> face_corner(const Band& band, std::array<int, 3> node,
                                                int normal) {
  const Face face(band, node, normal);
  if (face.twist() < least_twist) return std::nullopt;
  return corner_of(face, [&](std::array<int, 3>, int) -> const Band& { return band; });
}

std::optional<std::array<float, 2>> face_corner(const Band& band, std::array<int, 3> node,
                                                int normal, const BandOfEdge& band_of_edge) {
  return corner_of(Face(band, node, normal), band_of_edge);
}

Vec3d meeting_point(std::span<const Tangent> planes, Vec3d start) {
  // Normal equations of sum (n . (x - p))^2 + pull (x - start)^2.
  Eigen::Matrix3d matrix = pull * Eigen::Matrix3d::Identity();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Tangent& plane : planes) {
    const Eigen::Vector3d n(plane.normal.x, plane.normal.y, plane.normal.z);
    matrix += n * n.transpose();
    right += dot(plane.normal, plane.point - start) * n;
  }
  const Eigen::Vector3d away = matrix.llt().solve(right);
  return start + Vec3d{away.x(), away.y(), away.z()};
}

}  // namespace scarp
