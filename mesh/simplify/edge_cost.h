#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/vec3.h"
#include "mesh/lanes.h"
#include "mesh/simplify/placement.h"

namespace scarp {

// The placement of Lindstrom and Turk (placement.h), in single precision and for many edges at
// once: what passes rank by. In lanes and written out, as an Eigen type holds one matrix and this
// is about the same entry of four.

/// What the squared volume under a facet weighs; n: twice its area vector. Number: float or
/// FloatLanes.
template <class Number>
[[gnu::always_inline]] inline Number weight_of(Measure measure, Vec3<Number> n) {
  if (measure == Measure::volume) return splat<Number>(1);
  return splat<Number>(1) / root(larger(dot(n, n), splat<Number>(1e-30F)));
}

/// Over the facets of a vertex, in its own frame: r H r is the weighted sum of the squared volumes
/// under r, n r the sum of the volumes. The fourth lanes are of no meaning.
struct FloatTerms {
  FloatLanes squares{};   ///< xx, yy, zz of H
  FloatLanes products{};  ///< xy, yz, zx of H
  FloatLanes n{};

  /// Of one facet; n: twice its area vector.
  static FloatTerms of(Measure measure, FloatLanes n) {
    const FloatLanes weighed = weight_of(measure, Vec3f{n[0], n[1], n[2]}) * n;
    return {weighed * n, weighed * __builtin_shufflevector(n, n, 1, 2, 0, 3), n};
  }
  FloatTerms& operator+=(const FloatTerms& other) {
    squares += other.squares;
    products += other.products;
    n += other.n;
    return *this;
  }
  FloatTerms& operator-=(const FloatTerms& other) {
    squares -= other.squares;
    products -= other.products;
    n -= other.n;
    return *this;
  }
};

/// The numbers of FloatTerms, of one vertex or of four.
template <class Number>
struct SplitTerms {
  Vec3<Number> squares;
  Vec3<Number> products;
  Vec3<Number> n;
};

/// Where the merged vertex of an edge goes, from its origin, and what that costs (length^4, by
/// volume length^6).
template <class Number>
struct PlacedMerger {
  Vec3<Number> r;
  Number cost;
};
using FloatPlaced = PlacedMerger<float>;

/// edge: from u to v; a and b: normals of its two facets. Number: float or FloatLanes, with the
/// same bits.
template <Measure measure, class Number>
[[gnu::always_inline]] inline PlacedMerger<Number> place_merged(Vec3<Number> edge,
                                                                const SplitTerms<Number>& u,
                                                                const SplitTerms<Number>& v,
                                                                Vec3<Number> a, Vec3<Number> b) {
  const auto number = [](float value) { return splat<Number>(value); };
  // As in placement.cpp; by volume a fainter pull would drown in rounding.
  const Number faint = number(measure == Measure::volume ? 1e-7F : 3e-6F);
  const Number tie_break = number(1e-10F);
  const Number squared_reach = number(2.25F);
  /// The least pivot, in weights: rounding may make it negative.
  const Number least_pivot = number(0.3F);
  const Number tiny = number(1e-30F);
  const Number one = number(1);

  // In the frame of u. The facets of the edge were counted twice; both ends lie in them, so g, k
  // and d have no part of them.
  const Vec3<Number> weighed_a = weight_of(measure, a) * a;
  const Vec3<Number> weighed_b = weight_of(measure, b) * b;
  const Number xx = u.squares.x + v.squares.x - weighed_a.x * a.x - weighed_b.x * b.x;
  const Number yy = u.squares.y + v.squares.y - weighed_a.y * a.y - weighed_b.y * b.y;
  const Number zz = u.squares.z + v.squares.z - weighed_a.z * a.z - weighed_b.z * b.z;
  const Number xy = u.products.x + v.products.x - weighed_a.x * a.y - weighed_b.x * b.y;
  const Number yz = u.products.y + v.products.y - weighed_a.y * a.z - weighed_b.y * b.z;
  const Number xz = u.products.z + v.products.z - weighed_a.z * a.x - weighed_b.z * b.x;
  const Vec3<Number> g{v.squares.x * edge.x + v.products.x * edge.y + v.products.z * edge.z,
                       v.products.x * edge.x + v.squares.y * edge.y + v.products.y * edge.z,
                       v.products.z * edge.x + v.products.y * edge.y + v.squares.z * edge.z};
  const Number k = dot(edge, g);
  const Vec3<Number> n = u.n + v.n - a - b;
  const Number d = dot(v.n, edge);
  const Number square = dot(edge, edge);
  const Number weight = faint * (xx + yy + zz) + number(1e-20F);
  const Vec3<Number> middle = number(0.5F) * edge;

  // H + weight = L D L^T, without pivoting: the matrix is positive definite.
  const Number d1 = one / (xx + weight);
  const Number l21 = xy * d1;
  const Number l31 = xz * d1;
  const Number rest = yz - xz * l21;
  const Number d2 = one / larger(yy + weight - xy * l21, least_pivot * weight);
  const Number l32 = rest * d2;
  const Number d3 = one / larger(zz + weight - xz * l31 - rest * l32, least_pivot * weight);
  const auto solve = [&](Vec3<Number> p) {
    const Number y = p.y - l21 * p.x;
    const Number z = (p.z - l31 * p.x - l32 * y) * d3;
    const Number y2 = y * d2 - l32 * z;
    return Vec3<Number>{p.x * d1 - l21 * y2 - l31 * z, y2, z};
  };
  // Keeps the volume: n r = d.
  const Vec3<Number> free = solve(g + weight * middle);
  const Vec3<Number> along = solve(n);
  const Number step = (dot(n, free) - d) / larger(dot(n, along), tiny);
  const Vec3<Number> lowest = free - step * along;
  const Vec3<Number> shift = lowest - middle;
  // A minimum far from the middle is not trusted.
  const auto is_near = dot(shift, shift) <= squared_reach * square;
  const Vec3<Number> r{is_near ? lowest.x : middle.x, is_near ? lowest.y : middle.y,
                       is_near ? lowest.z : middle.z};
  const Vec3<Number> h_times_r{xx * r.x + xy * r.y + xz * r.z, xy * r.x + yy * r.y + yz * r.z,
                               xz * r.x + yz * r.y + zz * r.z};
  const Number cost = dot(r, h_times_r) - number(2) * dot(g, r) + k;
  // Rounding may leave a flat cost a little below zero.
  const Number scale = square * square * (measure == Measure::volume ? square : one);
  return {r, larger(cost, number(0)) + tie_break * scale};
}

inline FloatPlaced place_merged(Measure measure, Vec3f edge, const FloatTerms& u,
                                const FloatTerms& v, Vec3f a, Vec3f b) {
  const auto vector = [](const FloatLanes& lanes) { return Vec3f{lanes[0], lanes[1], lanes[2]}; };
  const auto split = [&](const FloatTerms& terms) {
    return SplitTerms<float>{vector(terms.squares), vector(terms.products), vector(terms.n)};
  };
  return measure == Measure::volume
             ? place_merged<Measure::volume>(edge, split(u), split(v), a, b)
             : place_merged<Measure::distance>(edge, split(u), split(v), a, b);
}

/// Edges whose costs are found together.
class EdgeCosts {
 public:
  static constexpr int capacity = 64;

  /// An edge, and the half edge and the ends that it has.
  struct Edge {
    std::uint32_t h;
    std::uint32_t u;
    std::uint32_t v;
  };

  explicit EdgeCosts(Measure measure) : measure_(measure) {}

  bool is_full() const { return count_ == capacity; }
  /// along, a, b: as of place_merged(), the fourth lanes being of no meaning.
  void add(const Edge& edge, FloatLanes along, const FloatTerms& u, const FloatTerms& v,
           FloatLanes a, FloatLanes b) {
    edge_[count_] = edge;
    along_[count_] = along;
    u_[count_] = u;
    v_[count_] = v;
    a_[count_] = a;
    b_[count_] = b;
    ++count_;
  }

  /// Calls visit(edge, cost, squared length) for each, and forgets them.
  template <class Visit>
  void finish(const Visit& visit) {
    for (int i = 0; i < count_; i += float_lanes) {
      const Vec3<FloatLanes> along = transposed(&along_[i]);
      const FloatLanes cost = measure_ == Measure::volume ? costs<Measure::volume>(i, along)
                                                          : costs<Measure::distance>(i, along);
      const FloatLanes square = dot(along, along);
      for (int lane = 0; lane < std::min(float_lanes, count_ - i); ++lane) {
        visit(edge_[i + lane], cost[lane], square[lane]);
      }
    }
    count_ = 0;
  }

 private:
  template <class T>
  using Row = std::array<T, capacity>;

  template <Measure measure>
  FloatLanes costs(int i, const Vec3<FloatLanes>& along) const {
    return place_merged<measure>(along, transposed(&u_[i]), transposed(&v_[i]), transposed(&a_[i]),
                                 transposed(&b_[i]))
        .cost;
  }

  static Vec3<FloatLanes> transposed(const FloatLanes* rows) {
    return transposed(rows[0], rows[1], rows[2], rows[3]);
  }
  static Vec3<FloatLanes> transposed(FloatLanes a, FloatLanes b, FloatLanes c, FloatLanes d) {
    const FloatLanes low = __builtin_shufflevector(a, b, 0, 4, 1, 5);
    const FloatLanes other_low = __builtin_shufflevector(c, d, 0, 4, 1, 5);
    const FloatLanes high = __builtin_shufflevector(a, b, 2, 6, 3, 7);
    const FloatLanes other_high = __builtin_shufflevector(c, d, 2, 6, 3, 7);
    return {__builtin_shufflevector(low, other_low, 0, 1, 4, 5),
            __builtin_shufflevector(low, other_low, 2, 3, 6, 7),
            __builtin_shufflevector(high, other_high, 0, 1, 4, 5)};
  }
  static SplitTerms<FloatLanes> transposed(const FloatTerms* rows) {
    const auto of = [rows](FloatLanes FloatTerms::*part) {
      return transposed(rows[0].*part, rows[1].*part, rows[2].*part, rows[3].*part);
    };
    return {of(&FloatTerms::squares), of(&FloatTerms::products), of(&FloatTerms::n)};
  }

  Measure measure_;
  int count_ = 0;
  Row<Edge> edge_;
  // What lies beyond the last one is not asked for, but worked on.
  Row<FloatLanes> along_{};
  Row<FloatTerms> u_{};
  Row<FloatTerms> v_{};
  Row<FloatLanes> a_{};
  Row<FloatLanes> b_{};
};

}  // namespace scarp
