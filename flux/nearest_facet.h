#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/vec3.h"
#include "flux/facet_grid.h"
#include "flux/ray.h"

namespace scarp {

/// The facet that one straight flight meets first, on each side, among those that were tested.
///
/// A facet is met if the ray's foot lies in it, seen along the ray. Vertices are sheared to that
/// view, where the ray is the origin, and rounded to single precision: then products of coordinates
/// are exact in double precision and the signs of the edges are those of one flat picture, the same
/// for all facets. So nothing slips through an edge or a vertex.
/// Source: Woop, Benthin and Wald 2013, with the rounding that makes its signs exact.
class NearestFacet {
 public:
  struct Hit {
    double t = 0;
    std::uint32_t facet = Ray::no_facet;
  };

  /// Below this, distances are rounding: 1e-16 times the extent of the largest domain, with room.
  static constexpr double tiny_distance = 1e-9;

  /// t_end: nothing further away counts.
  void start(const FacetGrid& grid, const Ray& ray, double t_end);

  /// Takes a facet if it is met, and nearer than others or as near and of lower index. Any order of
  /// tests has the same end.
  void test(const std::array<Vec3f, 3>& corners, Vec3d normal, std::uint32_t facet);

  /// The facets of a block that test() may take, but for that of the start, one bit each; perhaps
  /// some more.
  unsigned candidates(const FacetGrid::Block& block) const;

  const Hit& front() const { return front_; }
  const Hit& back() const { return back_; }
  double t_nearest() const { return std::min(front_.t, back_.t); }
  /// Where a flight meets a sharp ridge it meets both sides: that counts as the front.
  bool is_at_front() const {
    return front_.facet != Ray::no_facet &&
           (back_.facet == Ray::no_facet || front_.t <= back_.t + ridge_thickness);
  }

  /// In spacings: the two sides of a ridge, seen edge on, may change places by rounding.
  static constexpr double ridge_thickness = 1e-5;

 private:
  struct Corner {
    double x;
    double y;
    double depth;
  };

  // By memory, not by branches: directions cannot be foreseen.
  using Components = std::array<double, 3>;
  static Components components(Vec3d v) { return {v.x, v.y, v.z}; }

  Corner seen(Vec3f corner) const {
    const Vec3d v = Vec3d(corner) - r_;
    const Components of_v = components(v);
    const auto rounded = [](double x) { return static_cast<double>(static_cast<float>(x)); };
    return {rounded(of_v[axis_x_] - shear_x_ * of_v[axis_z_]),
            rounded(of_v[axis_y_] - shear_y_ * of_v[axis_z_]), dot(v, u_)};
  }

  bool goes_down_ = false;  // along axis z of the view
  Vec3d r_;
  Vec3d u_;
  std::uint32_t from_ = Ray::no_facet;
  Hit front_;
  Hit back_;
  std::size_t axis_x_ = 0;
  std::size_t axis_y_ = 1;
  std::size_t axis_z_ = 2;  // the longest of u
  double shear_x_ = 0;
  double shear_y_ = 0;

  // The same in single precision, in steps of the grid.
  Vec3f foot_;  // along the three axes of the view
  float slope_x_ = 0;
  float slope_y_ = 0;
  float tolerance_x_ = 0;
  float tolerance_y_ = 0;
};

inline void NearestFacet::start(const FacetGrid& grid, const Ray& ray, double t_end) {
  r_ = ray.r;
  u_ = ray.u;
  from_ = ray.from;
  front_ = back_ = {.t = t_end};
  const Vec3d size{std::abs(u_.x), std::abs(u_.y), std::abs(u_.z)};
  const std::size_t x_or_y = size.x >= size.y ? 0 : 1;
  const bool is_z = (size.z >= size.x) & (size.z >= size.y);
  axis_z_ = is_z ? 2 : x_or_y;
  constexpr std::array<std::size_t, 5> cyclic{0, 1, 2, 0, 1};
  axis_x_ = cyclic[axis_z_ + 1];
  axis_y_ = cyclic[axis_z_ + 2];
  const Components of_u = components(u_);
  using Pair [[gnu::vector_size(2 * sizeof(double))]] = double;
  const Pair shear = Pair{of_u[axis_x_], of_u[axis_y_]} / of_u[axis_z_];
  shear_x_ = shear[0];
  shear_y_ = shear[1];
  const Components from_lower = components(r_ - grid.lower());
  const Components per_step = components(grid.per_step());
  foot_ =
      Vec3f(Vec3d{per_step[axis_x_] * from_lower[axis_x_], per_step[axis_y_] * from_lower[axis_y_],
                  per_step[axis_z_] * from_lower[axis_z_]});
  goes_down_ = of_u[axis_z_] < 0;
  const double depth = 1 / per_step[axis_z_];
  slope_x_ = static_cast<float>(shear_x_ * per_step[axis_x_] * depth);
  slope_y_ = static_cast<float>(shear_y_ * per_step[axis_y_] * depth);
  // A corner is off by half a step, and by half a step of its depth times the slope. What single
  // precision makes of 16 bits, of their products and of test() itself takes up to .03 more.
  constexpr float half = 0.53F;
  tolerance_x_ = half * (1 + std::abs(slope_x_));
  tolerance_y_ = half * (1 + std::abs(slope_y_));
}

inline void NearestFacet::test(const std::array<Vec3f, 3>& corners, Vec3d normal,
                               std::uint32_t facet) {
  const Corner a = seen(corners[0]);
  const Corner b = seen(corners[1]);
  const Corner c = seen(corners[2]);
  const double weight_a = b.x * c.y - b.y * c.x;
  const double weight_b = c.x * a.y - c.y * a.x;
  const double weight_c = a.x * b.y - a.y * b.x;
  const bool is_left = (weight_a >= 0) & (weight_b >= 0) & (weight_c >= 0);
  const bool is_right = (weight_a <= 0) & (weight_b <= 0) & (weight_c <= 0);
  // On the facet's plane, within its reach where the plane is seen edge on.
  const double nearest = std::min(std::min(a.depth, b.depth), c.depth);
  const double farthest = std::max(std::max(a.depth, b.depth), c.depth);
  const double on_plane = dot(normal, Vec3d(corners[0]) - r_) / dot(normal, u_);
  const double at_most = on_plane <= farthest ? on_plane : farthest;
  const double t = on_plane >= nearest ? at_most : nearest;
  const bool is_front = is_left == goes_down_;
  Hit& hit = is_front ? front_ : back_;
  const bool is_nearer = (t < hit.t) | ((t == hit.t) & (facet < hit.facet));
  // Neither outside nor seen edge on.
  const bool is_met = (is_left != is_right) & (t >= (is_front ? -tiny_distance : tiny_distance));
  if (is_met & is_nearer) hit = {t, facet};
}

// The same flat picture in single precision, with room for rounding: vertices are placed once, and
// facets pick theirs.
inline unsigned NearestFacet::candidates(const FacetGrid::Block& block) const {
  constexpr std::size_t lanes = FacetGrid::block_size;
  using Floats [[gnu::vector_size(lanes * sizeof(float))]] = float;
  using Bits [[gnu::vector_size(lanes * sizeof(std::uint32_t))]] = std::uint32_t;
  using Steps [[gnu::vector_size(lanes * sizeof(std::uint16_t))]] = std::uint16_t;
  // Of the number of a vertex the lowest three bits count.
  const auto pick = [](const Floats& of_vertices, const Bits& vertices, Floats& picked) {
#ifdef __clang__  // has no such function
    for (std::size_t lane = 0; lane < lanes; ++lane)
      picked[lane] = of_vertices[vertices[lane] % lanes];
#else
    picked = __builtin_shuffle(of_vertices, vertices);
#endif
  };
  const auto steps_x = std::bit_cast<Steps>(block.vertices[axis_x_]);
  const auto steps_y = std::bit_cast<Steps>(block.vertices[axis_y_]);
  const auto steps_z = std::bit_cast<Steps>(block.vertices[axis_z_]);
  const Floats depth = __builtin_convertvector(steps_z, Floats) - foot_.z;
  const Floats vertex_x = __builtin_convertvector(steps_x, Floats) - foot_.x - slope_x_ * depth;
  const Floats vertex_y = __builtin_convertvector(steps_y, Floats) - foot_.y - slope_y_ * depth;
  // What the tolerances make of a product with any other corner.
  const Floats unsure = tolerance_y_ * (vertex_x < 0 ? -vertex_x : vertex_x) +
                        tolerance_x_ * (vertex_y < 0 ? -vertex_y : vertex_y) +
                        tolerance_x_ * tolerance_y_;
  std::array<Floats, 3> x;
  std::array<Floats, 3> y;
  std::array<Floats, 3> slack;
  auto vertices = __builtin_bit_cast(Bits, block.corners);
  for (std::size_t corner = 0; corner < 3; ++corner, vertices >>= 8) {
    pick(vertex_x, vertices, x[corner]);
    pick(vertex_y, vertices, y[corner]);
    pick(unsure, vertices, slack[corner]);
  }
  const Floats a = x[1] * y[2] - y[1] * x[2];
  const Floats b = x[2] * y[0] - y[2] * x[0];
  const Floats c = x[0] * y[1] - y[0] * x[1];
  const Floats slack_a = slack[1] + slack[2];
  const Floats slack_b = slack[2] + slack[0];
  const Floats slack_c = slack[0] + slack[1];
  const auto is_left = (a >= -slack_a) & (b >= -slack_b) & (c >= -slack_c);
  const auto is_right = (a <= slack_a) & (b <= slack_b) & (c <= slack_c);
  const auto facets = __builtin_bit_cast(Bits, block.facets);
  const auto is_other = (facets != from_) & (facets != Ray::no_facet);
  constexpr Bits each{1, 2, 4, 8, 16, 32, 64, 128};
  const Bits found = __builtin_bit_cast(Bits, (is_left | is_right) & is_other) & each;
  std::uint64_t pairs = 0;
  for (const std::uint64_t pair : std::bit_cast<std::array<std::uint64_t, 4>>(found)) pairs |= pair;
  return static_cast<unsigned>(pairs | (pairs >> 32)) & 0xFFU;
}

}  // namespace scarp
