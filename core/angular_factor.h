#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <variant>
#include <vector>

#include "core/vec3.h"

namespace scarp {

/// |p| F(p / |p|) of an angular factor F, and its derivatives by p: what a front whose normal is
/// along p moves at, and how fast kinks run along it.
struct AngularRate {
  float value = 0;
  Vec3f slope;
};

/// How a surface responds to a parallel beam, by the cosine of the angle between beam and normal; 0
/// for a surface that faces away.
class BeamResponse {
 public:
  /// response(cosine) for cosines in [0, 1] is tabulated, linear in between, to 1e-6 of its largest
  /// curvature. It should be 0 at cosine 0. direction is a unit vector towards the wafer.
  BeamResponse(Vec3d direction, const std::function<double(double)>& response);

  AngularRate rate(Vec3f p) const {
    const float size = std::max(length(p), 1e-6F);
    const Vec3f n = p / size;
    const float cosine = -dot(direction_, n);
    const float place = std::clamp(cosine, 0.0F, 1.0F) * interval_count;
    const int interval = std::min(static_cast<int>(place), interval_count - 1);
    const float below = table_[static_cast<std::size_t>(interval)];
    const float rise = table_[static_cast<std::size_t>(interval) + 1] - below;
    const float response = below + (place - static_cast<float>(interval)) * rise;
    const float steepness = cosine > 0 ? rise * interval_count : 0.0F;
    return {size * response, (response - steepness * cosine) * n - steepness * direction_};
  }

  bool is_vertical() const { return direction_.x == 0 && direction_.y == 0; }

 private:
  static constexpr int interval_count = 512;
  Vec3f direction_;
  std::vector<float> table_;
};

/// The same for a response of linear c + cubic c^3 at the cosine c: without a table, so that
/// loops over normals are vectorised.
class CubicResponse {
 public:
  /// direction is a unit vector towards the wafer.
  CubicResponse(Vec3d direction, float linear, float cubic)
      : direction_(direction), linear_(linear), cubic_(cubic) {}

  AngularRate rate(Vec3f p) const {
    const float size = std::max(length(p), 1e-6F);
    const Vec3f n = p / size;
    const float cosine = std::max(-dot(direction_, n), 0.0F);
    const float square = cosine * cosine;
    const float response = cosine * (linear_ + cubic_ * square);
    const float steepness = cosine > 0 ? linear_ + 3 * cubic_ * square : 0.0F;
    return {size * response, (response - steepness * cosine) * n - steepness * direction_};
  }

  bool is_vertical() const { return direction_.x == 0 && direction_.y == 0; }

 private:
  Vec3f direction_;
  float linear_;
  float cubic_;
};

/// Rates of a cubic crystal: those of the planes {100}, {110}, {111} and {311}, and in between an
/// interpolation that has them exactly.
///
/// Source: Hubbard, thesis (Caltech, 1994), as used by Ertl and Selberherr for KOH.
class CrystalRates {
 public:
  struct Values {
    double r100 = 0;
    double r110 = 0;
    double r111 = 0;
    double r311 = 0;
  };
  /// axes are the directions of the crystal's <100>, <010> and <001> on the wafer: orthogonal unit
  /// vectors.
  CrystalRates(const Values& rates, const std::array<Vec3d, 3>& axes);

  /// Zero for p = 0, whose direction says nothing.
  AngularRate rate(Vec3f p) const {
    const float size = std::max(length(p), 1e-6F);
    const Vec3f along{dot(axes_[0], p) / size, dot(axes_[1], p) / size, dot(axes_[2], p) / size};
    const Vec3f a{std::abs(along.x), std::abs(along.y), std::abs(along.z)};
    const float most = std::max(std::max(a.x, a.y), a.z);
    const float least = std::min(std::min(a.x, a.y), a.z);
    const float middle = std::max(std::min(a.x, a.y), std::min(std::max(a.x, a.y), a.z));
    // Linear in the components over the largest one, in two triangles of directions.
    const bool near_110 = middle + 2 * least < most;
    const Vec3f& factors = near_110 ? near_110_ : near_111_;
    const float scale = most > 0.5F ? 1 / most : 0.0F;
    const float value = scale * (factors.x * most + factors.y * middle + factors.z * least);
    // F does not change along n, so neither do its derivatives need a projection.
    const Vec3f by_order{scale * (factors.x - value), scale * factors.y, scale * factors.z};
    const auto slope_along = [&](float component, float magnitude) {
      const float inner = magnitude == least ? by_order.z : by_order.y;
      const float slope = magnitude == most ? by_order.x : inner;
      // On a plane of symmetry neither sign is right.
      const float positive = component > 0 ? slope : 0.0F;
      return component < 0 ? -slope : positive;
    };
    const Vec3f slope =
        (slope_along(along.x, a.x) * axes_[0] + slope_along(along.y, a.y) * axes_[1]) +
        slope_along(along.z, a.z) * axes_[2];
    return {size * value, (value / size) * p + slope};
  }

  /// Planes are not the same all around the vertical.
  static bool is_vertical() { return false; }

 private:
  std::array<Vec3f, 3> axes_;
  Vec3f near_110_;  ///< factors of the largest, middle and least component
  Vec3f near_111_;
};

/// A factor of a speed that depends on the direction of the surface's outward normal alone.
class AngularFactor {
 public:
  /// Bounds over all directions, within two percent.
  struct Bounds {
    double value = 0;   ///< of |F|
    double slopes = 0;  ///< of the sum over the axes of the derivatives of |p| F by p
  };

  AngularFactor(BeamResponse kind) : kind_(std::move(kind)) { find_bounds(); }
  AngularFactor(CubicResponse kind) : kind_(kind) { find_bounds(); }
  AngularFactor(CrystalRates kind) : kind_(kind) { find_bounds(); }

  /// Calls visitor with the kind of factor, whose rate() is then known to the compiler.
  template <class Visitor>
  void visit(const Visitor& visitor) const {
    std::visit(visitor, kind_);
  }

  AngularRate rate(Vec3f p) const {
    return std::visit([&](const auto& kind) { return kind.rate(p); }, kind_);
  }

  /// F at a unit normal.
  float value(Vec3f n) const { return rate(n).value; }

  /// Whether F has minima at which its slope jumps, as at the planes of a crystal.
  bool has_cusps() const { return std::holds_alternative<CrystalRates>(kind_); }

  /// Whether F depends on the angle to the vertical alone.
  bool is_vertical() const {
    return std::visit([](const auto& kind) { return kind.is_vertical(); }, kind_);
  }

  const Bounds& bounds() const { return bounds_; }

  /// The speed without dependence on the normal that limits the time step of an explicit scheme as
  /// much as the factor does.
  double limiting_speed() const;

 private:
  void find_bounds();

  std::variant<BeamResponse, CubicResponse, CrystalRates> kind_;
  Bounds bounds_;
};

}  // namespace scarp
