#include "mesh/quadric.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

namespace scarp {

namespace {

/// A normal shorter than this part of itself along the subspace says nothing.
constexpr double negligible = 1e-6;

Vec3d any_orthogonal(Vec3d n) {
  const Vec3d other = std::abs(n.x) <= std::abs(n.y) && std::abs(n.x) <= std::abs(n.z)
                          ? Vec3d{1, 0, 0}
                      : std::abs(n.y) <= std::abs(n.z) ? Vec3d{0, 1, 0}
                                                       : Vec3d{0, 0, 1};
  return normalized(cross(n, other));
}

}  // namespace

void Subspace::fix(int i, double value) {
  origin[i] = value;
  for (int k = 0; k < dimension; ++k) {
    if (axis[k][i] == 0) continue;
    std::swap(axis[k], axis[dimension - 1]);
    --dimension;
    return;
  }
}

void Subspace::intersect(Vec3d n, double d) {
  if (dimension == 0) return;
  Vec3d part;
  for (int k = 0; k < dimension; ++k) part += dot(n, axis[k]) * axis[k];
  const double square = dot(part, part);
  if (square <= negligible * negligible * dot(n, n)) return;
  origin += ((d - dot(n, origin)) / square) * part;
  const Vec3d unit = normalized(part);
  if (dimension == 3) {
    axis[0] = any_orthogonal(unit);
    axis[1] = cross(unit, axis[0]);
  } else if (dimension == 2) {
    axis[0] = normalized(cross(unit, cross(axis[0], axis[1])));
  }
  --dimension;
}

Vec3d minimum(const Quadric& q, double weight, Vec3d centre, const Subspace& subspace) {
  const int n = subspace.dimension;
  // Half the gradient at the origin, and half the second derivatives, along the axes; what goes
  // along no axis stays where it is.
  const Vec3d gradient = q.H * subspace.origin - q.g + weight * (subspace.origin - centre);
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  Eigen::Matrix3d H = Eigen::Matrix3d::Identity();
  for (int i = 0; i < n; ++i) {
    g[i] = -dot(subspace.axis[i], gradient);
    const Vec3d row = q.H * subspace.axis[i];
    for (int j = 0; j < n; ++j) H(i, j) = dot(row, subspace.axis[j]);
    H(i, i) += weight;
  }
  // The matrix is positive definite.
  const Eigen::Vector3d step = H.llt().solve(g);
  Vec3d r = subspace.origin;
  for (int i = 0; i < n; ++i) r += step[i] * subspace.axis[i];
  return r;
}

}  // namespace scarp
