#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/vec3.h"
#include "mesh/placement.h"

namespace scarp {

// The placement of Lindstrom and Turk (placement.h), in single precision and for many edges at
// once: what passes rank by. In flat arrays and written out, as an Eigen type holds one matrix and
// this is about the same entry of many.

/// What the squared volume under a facet weighs; n: twice its area vector.
[[gnu::always_inline]] inline float weight_of(Measure measure, Vec3f n) {
  return measure == Measure::volume ? 1 : 1 / std::sqrt(std::max(dot(n, n), 1e-30F));
}

/// Over the facets of a vertex, in its own frame: r H r is the weighted sum of the squared volumes
/// under r, n r the sum of the volumes.
struct FloatTerms {
  float xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  float nx = 0, ny = 0, nz = 0;

  /// Adds weight times the terms of a facet with that normal (twice the area vector): 1 or -1.
  void add(Measure measure, float weight, Vec3f n) {
    const float of_square = weight * weight_of(measure, n);
    xx += of_square * n.x * n.x;
    xy += of_square * n.x * n.y;
    xz += of_square * n.x * n.z;
    yy += of_square * n.y * n.y;
    yz += of_square * n.y * n.z;
    zz += of_square * n.z * n.z;
    nx += weight * n.x;
    ny += weight * n.y;
    nz += weight * n.z;
  }
  void add(const FloatTerms& other) {
    xx += other.xx;
    xy += other.xy;
    xz += other.xz;
    yy += other.yy;
    yz += other.yz;
    zz += other.zz;
    nx += other.nx;
    ny += other.ny;
    nz += other.nz;
  }
};

/// Where the merged vertex of an edge goes, from its origin, and what that costs (length^4, by
/// volume length^6).
struct FloatPlaced {
  Vec3f r;
  float cost;
};

/// edge: from u to v; a and b: normals of its two facets. Always inline: in the loop of EdgeCosts
/// it is done for four edges at once.
template <Measure measure>
[[gnu::always_inline]] inline FloatPlaced place_merged(Vec3f edge, const FloatTerms& u,
                                                       const FloatTerms& v, Vec3f a, Vec3f b) {
  // As in placement.cpp; by volume a fainter pull would drown in rounding.
  constexpr float faint = measure == Measure::volume ? 1e-7F : 3e-6F;
  constexpr float tie_break = 1e-10F;
  constexpr float squared_reach = 2.25F;
  /// The least pivot, in weights: rounding may make it negative.
  constexpr float least_pivot = 0.3F;
  constexpr float tiny = 1e-30F;

  // In the frame of u. The facets of the edge were counted twice; both ends lie in them, so g, k
  // and d have no part of them.
  const float weight_a = weight_of(measure, a);
  const float weight_b = weight_of(measure, b);
  const float xx = u.xx + v.xx - weight_a * a.x * a.x - weight_b * b.x * b.x;
  const float xy = u.xy + v.xy - weight_a * a.x * a.y - weight_b * b.x * b.y;
  const float xz = u.xz + v.xz - weight_a * a.x * a.z - weight_b * b.x * b.z;
  const float yy = u.yy + v.yy - weight_a * a.y * a.y - weight_b * b.y * b.y;
  const float yz = u.yz + v.yz - weight_a * a.y * a.z - weight_b * b.y * b.z;
  const float zz = u.zz + v.zz - weight_a * a.z * a.z - weight_b * b.z * b.z;
  const Vec3f g{v.xx * edge.x + v.xy * edge.y + v.xz * edge.z,
                v.xy * edge.x + v.yy * edge.y + v.yz * edge.z,
                v.xz * edge.x + v.yz * edge.y + v.zz * edge.z};
  const float k = dot(edge, g);
  const Vec3f n{u.nx + v.nx - a.x - b.x, u.ny + v.ny - a.y - b.y, u.nz + v.nz - a.z - b.z};
  const float d = v.nx * edge.x + v.ny * edge.y + v.nz * edge.z;
  const float square = dot(edge, edge);
  const float weight = faint * (xx + yy + zz) + 1e-20F;
  const Vec3f middle = 0.5F * edge;

  // H + weight = L D L^T, without pivoting: the matrix is positive definite.
  const float d1 = 1 / (xx + weight);
  const float l21 = xy * d1;
  const float l31 = xz * d1;
  const float rest = yz - xz * l21;
  const float d2 = 1 / std::max(yy + weight - xy * l21, least_pivot * weight);
  const float l32 = rest * d2;
  const float d3 = 1 / std::max(zz + weight - xz * l31 - rest * l32, least_pivot * weight);
  const auto solve = [&](Vec3f p) {
    const float y = p.y - l21 * p.x;
    const float z = (p.z - l31 * p.x - l32 * y) * d3;
    const float y2 = y * d2 - l32 * z;
    return Vec3f{p.x * d1 - l21 * y2 - l31 * z, y2, z};
  };
  // Keeps the volume: n r = d.
  const Vec3f free = solve(g + weight * middle);
  const Vec3f along = solve(n);
  const float step = (dot(n, free) - d) / std::max(dot(n, along), tiny);
  const Vec3f lowest = free - step * along;
  const Vec3f shift = lowest - middle;
  // A minimum far from the middle is not trusted.
  const bool is_far = !(dot(shift, shift) <= squared_reach * square);
  const Vec3f r{is_far ? middle.x : lowest.x, is_far ? middle.y : lowest.y,
                is_far ? middle.z : lowest.z};
  const Vec3f Hr{xx * r.x + xy * r.y + xz * r.z, xy * r.x + yy * r.y + yz * r.z,
                 xz * r.x + yz * r.y + zz * r.z};
  const float cost = dot(r, Hr) - 2 * dot(g, r) + k;
  // Rounding may leave a flat cost a little below zero.
  const float scale = square * square * (measure == Measure::volume ? square : 1);
  return {r, std::max(cost, 0.0F) + tie_break * scale};
}

inline FloatPlaced place_merged(Measure measure, Vec3f edge, const FloatTerms& u,
                                const FloatTerms& v, Vec3f a, Vec3f b) {
  return measure == Measure::volume ? place_merged<Measure::volume>(edge, u, v, a, b)
                                    : place_merged<Measure::distance>(edge, u, v, a, b);
}

/// Edges whose costs are found together.
class EdgeCosts {
 public:
  static constexpr int capacity = 64;

  explicit EdgeCosts(Measure measure) : measure_(measure) {}

  bool is_full() const { return count_ == capacity; }
  void add(std::uint32_t h, Vec3f edge, const FloatTerms& u, const FloatTerms& v, Vec3f a,
           Vec3f b) {
    h_[count_] = h;
    edge_.put(count_, edge);
    u_.put(count_, u);
    v_.put(count_, v);
    a_.put(count_, a);
    b_.put(count_, b);
    ++count_;
  }

  /// Calls visit(h, cost, squared length) for each, and forgets them.
  template <class Visit>
  void finish(const Visit& visit) {
    std::array<float, capacity> cost;
    if (measure_ == Measure::volume) {
      find<Measure::volume>(cost);
    } else {
      find<Measure::distance>(cost);
    }
    for (int i = 0; i < count_; ++i) {
      const Vec3f edge = edge_.at(i);
      visit(h_[i], cost[i], dot(edge, edge));
    }
    count_ = 0;
  }

 private:
  using Row = std::array<float, capacity>;

  template <Measure measure>
  void find(Row& cost) const {
    for (int i = 0; i < capacity; ++i) {
      cost[i] = place_merged<measure>(edge_.at(i), u_.at(i), v_.at(i), a_.at(i), b_.at(i)).cost;
    }
  }

  struct Vectors {
    Row x{}, y{}, z{};

    void put(int i, Vec3f a) {
      x[i] = a.x;
      y[i] = a.y;
      z[i] = a.z;
    }
    Vec3f at(int i) const { return {x[i], y[i], z[i]}; }
  };
  struct Terms {
    Row xx{}, xy{}, xz{}, yy{}, yz{}, zz{};
    Vectors n;

    void put(int i, const FloatTerms& t) {
      xx[i] = t.xx;
      xy[i] = t.xy;
      xz[i] = t.xz;
      yy[i] = t.yy;
      yz[i] = t.yz;
      zz[i] = t.zz;
      n.put(i, {t.nx, t.ny, t.nz});
    }
    FloatTerms at(int i) const {
      return {xx[i], xy[i], xz[i], yy[i], yz[i], zz[i], n.x[i], n.y[i], n.z[i]};
    }
  };

  Measure measure_;
  int count_ = 0;
  std::array<std::uint32_t, capacity> h_;
  Vectors edge_;
  Terms u_;
  Terms v_;
  Vectors a_;
  Vectors b_;
};

}  // namespace scarp
