#pragma once

#include "core/vec3.h"

namespace scarp {

/// A symmetric 3 x 3 matrix.
struct SymmetricMatrix {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;

  void add_outer(double weight, Vec3d n) {
    const Vec3d w = weight * n;
    xx += w.x * n.x;
    xy += w.x * n.y;
    xz += w.x * n.z;
    yy += w.y * n.y;
    yz += w.y * n.z;
    zz += w.z * n.z;
  }
  friend Vec3d operator*(const SymmetricMatrix& m, Vec3d a) {
    return {m.xx * a.x + m.xy * a.y + m.xz * a.z, m.xy * a.x + m.yy * a.y + m.yz * a.z,
            m.xz * a.x + m.yz * a.y + m.zz * a.z};
  }
  void add(double weight, const SymmetricMatrix& m) {
    xx += weight * m.xx;
    xy += weight * m.xy;
    xz += weight * m.xz;
    yy += weight * m.yy;
    yz += weight * m.yz;
    zz += weight * m.zz;
  }
  double trace() const { return xx + yy + zz; }
};

/// The quadratic function r H r - 2 g r + k of a place r.
struct Quadric {
  SymmetricMatrix H;
  Vec3d g;
  double k = 0;

  /// Adds weight (n r - d)^2.
  void add_plane(double weight, Vec3d n, double d) {
    H.add_outer(weight, n);
    g += (weight * d) * n;
    k += weight * d * d;
  }

  /// Adds weight |(r - a) x (b - a)|^2: four times the square of the area of triangle (r, a, b).
  void add_line(double weight, Vec3d a, Vec3d b) {
    const Vec3d e = b - a;
    const double square = weight * dot(e, e);
    H.xx += square;
    H.yy += square;
    H.zz += square;
    H.add_outer(-weight, e);
    const Vec3d pull = square * a - weight * dot(e, a) * e;
    g += pull;
    k += dot(a, pull);
  }

  void add(double weight, const Quadric& q) {
    H.add(weight, q.H);
    g += weight * q.g;
    k += weight * q.k;
  }

  /// The same function in a frame whose origin is at o.
  Quadric moved(Vec3d o) const { return {H, g - H * o, value(o)}; }

  double value(Vec3d r) const { return dot(r, H * r) - 2 * dot(g, r) + k; }
};

/// Where a minimum is looked for: a point, a line, a plane or all of space.
struct Subspace {
  Vec3d origin;
  int dimension = 3;
  Vec3d axis[3]{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};  ///< orthonormal; the first `dimension` count

  /// Keeps only the places where coordinate `i` is that of r; for a subspace along the coordinates.
  void fix(int i, double value);

  /// Keeps only the places with n r = d. A normal that has no part along the subspace is ignored.
  void intersect(Vec3d n, double d);
};

/// The lowest point of q + weight |r - centre|^2 in a subspace. The weight has to be positive.
Vec3d minimum(const Quadric& q, double weight, Vec3d centre, const Subspace& subspace);

/// The same in the plane n r = d, or in all of space if n is zero: quicker.
inline Vec3d minimum_on_plane(const Quadric& q, double weight, Vec3d centre, Vec3d n, double d) {
  // H + weight = L D L^T, without pivoting: the matrix is positive definite. Written out, as the
  // Cholesky decomposition of Eigen takes square roots and has no such one without pivoting: with
  // it all of `lindstrom-turk` takes 7 % longer.
  const double d1 = 1 / (q.H.xx + weight);
  const double l21 = q.H.xy * d1;
  const double l31 = q.H.xz * d1;
  const double rest = q.H.yz - q.H.xz * l21;
  const double d2 = 1 / (q.H.yy + weight - q.H.xy * l21);
  const double l32 = rest * d2;
  const double d3 = 1 / (q.H.zz + weight - q.H.xz * l31 - rest * l32);
  const auto solve = [&](Vec3d a) {
    const double y = a.y - l21 * a.x;
    const double z = (a.z - l31 * a.x - l32 * y) * d3;
    const double y2 = y * d2 - l32 * z;
    return Vec3d{a.x * d1 - l21 * y2 - l31 * z, y2, z};
  };
  const Vec3d free = solve(q.g + weight * centre);
  const Vec3d along = solve(n);
  const double square = dot(n, along);
  return square > 0 ? free - ((dot(n, free) - d) / square) * along : free;
}

}  // namespace scarp
