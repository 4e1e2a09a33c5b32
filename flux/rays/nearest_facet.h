#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/vec3.h"
#include "flux/rays/ray.h"

namespace scarp {

/// A facet as it is traced. One line of memory.
struct alignas(64) SceneFacet {
  std::array<Vec3f, 3> corners;
  Vec3d normal;  ///< of length 1
};

/// How a ray sees facets: along the longest axis of its direction, z of the view, and sheared so
/// that the ray is the origin.
struct RayView {
  /// The two axes across the view, side by side.
  using Pair [[gnu::vector_size(2 * sizeof(double))]] = double;

  explicit RayView(const Ray& ray);

  std::array<std::size_t, 3> axes;  ///< x, y and z of the view
  Pair foot;
  double foot_depth;
  Pair shear;
  bool goes_down;  ///< along z of the view
};

/// The facet that one straight flight meets first, on each side, among those that were tested.
///
/// A facet is met if the ray's foot lies in it, seen along the ray. Vertices are sheared to that
/// view, where the ray is the origin, and rounded to single precision: then products of coordinates
/// are exact in double precision and the signs of the edges are those of one flat picture, the same
/// for all facets. So nothing slips through an edge or a vertex.
///
/// At the distance where it is met the ray is in the facet's box, widened by a room for rounding.
/// So a search that passes boxes in any order, and leaves out those that begin beyond the nearest
/// facet so far, finds the same facet in each order: also slivers, whose planes do not tell where.
/// Source: Woop, Benthin and Wald 2013, with the rounding that makes its signs exact.
class NearestFacet {
 public:
  struct Hit {
    double t = 0;
    std::uint32_t facet = Ray::no_facet;
  };

  /// Below this, distances are rounding: 1e-16 times the extent of the largest domain, with room.
  static constexpr double tiny_distance = 1e-9;

  /// What rounding takes of the room, relative to the domain's width, length and height added up:
  /// a coordinate of the view by half a unit of single precision, of a number up to twice as large;
  /// across two axes, and once more for the distance along the ray.
  static constexpr double least_room = 6 * 0x1p-24;

  /// t_end: nothing further away counts. room: at least least_room times the size of the domain.
  NearestFacet(const Ray& ray, double t_end, double room);

  /// Takes a facet if it is met, is not that of the start, and is nearer than others or as near and
  /// of lower index; tells whether it did. Any order of tests has the same end.
  bool test(const SceneFacet& facet, std::uint32_t index);

  const RayView& view() const { return view_; }
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
  using Pair = RayView::Pair;
  using FloatPair [[gnu::vector_size(2 * sizeof(float))]] = float;

  Pair seen(const Vec3f& corner) const {
    const Pair across = Pair{corner.*axis_x_, corner.*axis_y_} - view_.foot;
    const double along = corner.*axis_z_ - view_.foot_depth;
    const Pair sheared = across - view_.shear * Pair{along, along};
    return __builtin_convertvector(__builtin_convertvector(sheared, FloatPair), Pair);
  }

  // On the facet's plane, within its reach where the plane is seen edge on. If rounding of a sliver
  // puts that away from the facet, at its point in the view.
  double distance(const SceneFacet& facet, Vec3d weights) const {
    const auto depth = [&](const Vec3f& corner) { return dot(Vec3d(corner) - r_, u_); };
    const double a = depth(facet.corners[0]);
    const double b = depth(facet.corners[1]);
    const double c = depth(facet.corners[2]);
    const double nearest = std::min(std::min(a, b), c);
    const double farthest = std::max(std::max(a, b), c);
    const double on_plane = dot(facet.normal, Vec3d(facet.corners[0]) - r_) / dot(facet.normal, u_);
    const double at_most = on_plane <= farthest ? on_plane : farthest;
    const double t = on_plane >= nearest ? at_most : nearest;
    if (is_near_box(facet, r_ + t * u_)) return t;
    return dot(weights, Vec3d{a, b, c}) / (weights.x + weights.y + weights.z);
  }

  bool is_near_box(const SceneFacet& facet, Vec3d r) const {
    const auto& [a, b, c] = facet.corners;
    const auto is_within = [this](double x, float x_a, float x_b, float x_c) {
      return x >= std::min(std::min(x_a, x_b), x_c) - room_ &&
             x <= std::max(std::max(x_a, x_b), x_c) + room_;
    };
    return is_within(r.x, a.x, b.x, c.x) && is_within(r.y, a.y, b.y, c.y) &&
           is_within(r.z, a.z, b.z, c.z);
  }

  Vec3d r_;
  Vec3d u_;
  RayView view_;
  // Members of memory, not branches: directions cannot be foreseen.
  using Axis = float Vec3f::*;
  static constexpr std::array<Axis, 3> all_axes{&Vec3f::x, &Vec3f::y, &Vec3f::z};
  Axis axis_x_;
  Axis axis_y_;
  Axis axis_z_;
  std::uint32_t from_;
  double room_;
  Hit front_;
  Hit back_;
};

// Without branches, see above.
inline RayView::RayView(const Ray& ray) {
  static constexpr std::array<std::array<std::size_t, 3>, 3> by_longest{
      {{1, 2, 0}, {2, 0, 1}, {0, 1, 2}}};
  const Vec3d size{std::abs(ray.u.x), std::abs(ray.u.y), std::abs(ray.u.z)};
  const std::size_t is_z = (size.z >= size.x ? 1U : 0U) & (size.z >= size.y ? 1U : 0U);
  const std::size_t is_y = (size.y > size.x ? 1U : 0U) & (1 - is_z);
  axes = by_longest[2 * is_z + is_y];
  const auto [x, y, z] = axes;
  const std::array<double, 3> r{ray.r.x, ray.r.y, ray.r.z};
  const std::array<double, 3> u{ray.u.x, ray.u.y, ray.u.z};
  foot = Pair{r[x], r[y]};
  foot_depth = r[z];
  shear = Pair{u[x], u[y]} / Pair{u[z], u[z]};
  goes_down = u[z] < 0;
}

inline NearestFacet::NearestFacet(const Ray& ray, double t_end, double room)
    : r_{ray.r.x, ray.r.y, ray.r.z},
      u_{ray.u.x, ray.u.y, ray.u.z},
      view_(ray),
      axis_x_(all_axes[view_.axes[0]]),
      axis_y_(all_axes[view_.axes[1]]),
      axis_z_(all_axes[view_.axes[2]]),
      from_(ray.from),
      room_(room),
      front_{.t = t_end},
      back_{.t = t_end} {}

inline bool NearestFacet::test(const SceneFacet& facet, std::uint32_t index) {
  if (index == from_) return false;
  const Pair a = seen(facet.corners[0]);
  const Pair b = seen(facet.corners[1]);
  const Pair c = seen(facet.corners[2]);
  const double weight_a = b[0] * c[1] - b[1] * c[0];
  const double weight_b = c[0] * a[1] - c[1] * a[0];
  const double weight_c = a[0] * b[1] - a[1] * b[0];
  const bool is_left = std::min(std::min(weight_a, weight_b), weight_c) >= 0;
  const bool is_right = std::max(std::max(weight_a, weight_b), weight_c) <= 0;
  // Outside, or seen edge on.
  if (is_left == is_right) return false;
  const double t = distance(facet, {weight_a, weight_b, weight_c});
  const bool is_front = is_left == view_.goes_down;
  Hit& hit = is_front ? front_ : back_;
  const bool is_nearer = (t < hit.t) | ((t == hit.t) & (index < hit.facet));
  const bool is_met = (t >= (is_front ? -tiny_distance : tiny_distance)) & is_nearer;
  if (is_met) hit = {t, index};
  return is_met;
}

}  // namespace scarp
