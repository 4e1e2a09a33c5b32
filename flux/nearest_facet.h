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

  /// The facets of a block that test() may take, one bit each; perhaps some more.
  unsigned candidates(const FacetGrid::Block& block) const;

  std::uint32_t from() const { return from_; }
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

  Corner seen(Vec3f corner) const {
    const Vec3d v = Vec3d(corner) - r_;
    const auto rounded = [](double x) { return static_cast<double>(static_cast<float>(x)); };
    return {rounded(v[axis_x_] - shear_x_ * v[axis_z_]),
            rounded(v[axis_y_] - shear_y_ * v[axis_z_]), dot(v, u_)};
  }

  static void take(Hit& hit, double t, std::uint32_t facet) {
    if (t < hit.t || (t == hit.t && facet < hit.facet)) hit = {t, facet};
  }

  Vec3d r_;
  Vec3d u_;
  std::uint32_t from_ = Ray::no_facet;
  Hit front_;
  Hit back_;
  int axis_x_ = 0;
  int axis_y_ = 1;
  int axis_z_ = 2;  // the longest of u
  double shear_x_ = 0;
  double shear_y_ = 0;

  // The same in single precision, in steps of the grid.
  Vec3f foot_;  // along the three axes of the view
  float slope_x_ = 0;
  float slope_y_ = 0;
  float tolerance_ = 0;
};

inline void NearestFacet::start(const FacetGrid& grid, const Ray& ray, double t_end) {
  r_ = ray.r;
  u_ = ray.u;
  from_ = ray.from;
  front_ = back_ = {.t = t_end};
  const Vec3d size{std::abs(u_.x), std::abs(u_.y), std::abs(u_.z)};
  axis_z_ = size.z >= size.x && size.z >= size.y ? 2 : size.x >= size.y ? 0 : 1;
  axis_x_ = (axis_z_ + 1) % 3;
  axis_y_ = (axis_z_ + 2) % 3;
  shear_x_ = u_[axis_x_] / u_[axis_z_];
  shear_y_ = u_[axis_y_] / u_[axis_z_];
  const Vec3d steps = (1 / grid.step()) * (r_ - grid.lower());
  foot_ = Vec3f(Vec3d{steps[axis_x_], steps[axis_y_], steps[axis_z_]});
  slope_x_ = static_cast<float>(shear_x_);
  slope_y_ = static_cast<float>(shear_y_);
  // A corner is off by half a step, and by half a step of its depth times a slope up to 1; sums of
  // 16 bits lose little in single precision.
  tolerance_ = static_cast<float>(1.05 + grid.padding() / grid.step());
}

inline void NearestFacet::test(const std::array<Vec3f, 3>& corners, Vec3d normal,
                               std::uint32_t facet) {
  const Corner a = seen(corners[0]);
  const Corner b = seen(corners[1]);
  const Corner c = seen(corners[2]);
  const double weight_a = b.x * c.y - b.y * c.x;
  const double weight_b = c.x * a.y - c.y * a.x;
  const double weight_c = a.x * b.y - a.y * b.x;
  const bool is_left = weight_a >= 0 && weight_b >= 0 && weight_c >= 0;
  const bool is_right = weight_a <= 0 && weight_b <= 0 && weight_c <= 0;
  if (is_left == is_right) return;  // outside, or seen edge on
  // On the facet's plane, within its reach where the plane is seen edge on.
  const auto [nearest, farthest] = std::minmax({a.depth, b.depth, c.depth});
  const double on_plane = dot(normal, Vec3d(corners[0]) - r_) / dot(normal, u_);
  const double t = on_plane >= nearest ? (on_plane <= farthest ? on_plane : farthest) : nearest;
  const bool is_front = is_left == (u_[axis_z_] < 0);
  if (is_front && t >= -tiny_distance) take(front_, t, facet);
  if (!is_front && t >= tiny_distance) take(back_, t, facet);
}

// The same flat picture in single precision, with room for rounding.
inline unsigned NearestFacet::candidates(const FacetGrid::Block& block) const {
  const auto& corners_x = block.corners[static_cast<std::size_t>(axis_x_)];
  const auto& corners_y = block.corners[static_cast<std::size_t>(axis_y_)];
  const auto& corners_z = block.corners[static_cast<std::size_t>(axis_z_)];
  std::array<std::int32_t, FacetGrid::block_size> bits;
  for (std::size_t k = 0; k < FacetGrid::block_size; ++k) {
    const float az = corners_z[0][k] - foot_.z;
    const float bz = corners_z[1][k] - foot_.z;
    const float cz = corners_z[2][k] - foot_.z;
    const float ax = corners_x[0][k] - foot_.x - slope_x_ * az;
    const float bx = corners_x[1][k] - foot_.x - slope_x_ * bz;
    const float cx = corners_x[2][k] - foot_.x - slope_x_ * cz;
    const float ay = corners_y[0][k] - foot_.y - slope_y_ * az;
    const float by = corners_y[1][k] - foot_.y - slope_y_ * bz;
    const float cy = corners_y[2][k] - foot_.y - slope_y_ * cz;
    const float a = bx * cy - by * cx;
    const float b = cx * ay - cy * ax;
    const float c = ax * by - ay * bx;
    const float size =
        std::abs(ax) + std::abs(ay) + std::abs(bx) + std::abs(by) + std::abs(cx) + std::abs(cy);
    const float slack = tolerance_ * (size + 2 * tolerance_);
    const float least = a < b ? (a < c ? a : c) : (b < c ? b : c);
    const float most = a < b ? (b < c ? c : b) : (a < c ? c : a);
    bits[k] = ((least >= -slack) | (most <= slack)) != 0 ? 1 << k : 0;
  }
  std::uint64_t pairs = 0;
  for (const std::uint64_t pair : std::bit_cast<std::array<std::uint64_t, 4>>(bits)) pairs |= pair;
  return static_cast<unsigned>(pairs | (pairs >> 32)) & 0xFFU;
}

}  // namespace scarp
