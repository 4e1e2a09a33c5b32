#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "core/vec3.h"
#include "core/vector_kernel.h"

namespace scarp {

/// |p| F(p / |p|) of an angular factor F, and its derivatives by p: what a front whose normal is
/// along p moves at, and how fast kinks run along it.
struct AngularRate {
  float value = 0;
  Vec3f slope;
};

/// A factor that depends on the cosine of the angle between the normal and one against an axis
/// alone, and its derivative by the cosine. Several about one axis add up.
struct AxialRate {
  float value = 0;
  float rise = 0;  ///< 0 at cosine 0, where the surface begins to face away
};

/// The cosine at a unit normal, 0 for one that faces away. axis is a unit vector towards the wafer.
SCARP_KERNEL_PART float axial_cosine(Vec3f axis, Vec3f n) { return std::max(-dot(axis, n), 0.0F); }

/// At p = size n.
SCARP_KERNEL_PART AngularRate rate_about(Vec3f axis, float size, Vec3f n, AxialRate of_cosine) {
  const auto [value, rise] = of_cosine;
  return {size * value, (value - rise * axial_cosine(axis, n)) * n - rise * axis};
}

/// How a surface responds to a parallel beam, by the cosine of the angle between beam and normal; 0
/// for a surface that faces away.
class BeamResponse {
 public:
  /// response(cosine) for cosines in [0, 1] is tabulated, linear in between, to 1e-6 of its largest
  /// curvature. It should be 0 at cosine 0. direction is a unit vector towards the wafer.
  BeamResponse(Vec3d direction, const std::function<double(double)>& response);

  SCARP_KERNEL_PART AxialRate at(float cosine) const {
    const float place = std::min(cosine, 1.0F) * interval_count;
    const int interval = std::min(static_cast<int>(place), interval_count - 1);
    const float below = table_[static_cast<std::size_t>(interval)];
    const float rise = table_[static_cast<std::size_t>(interval) + 1] - below;
    return {below + (place - static_cast<float>(interval)) * rise,
            select(cosine > 0, rise * interval_count, 0.0F)};
  }

  Vec3f axis() const { return direction_; }

 private:
  static constexpr int interval_count = 512;
  Vec3f direction_;
  std::vector<float> table_;
};

/// The same for a response that is the cosine: without a table, so that loops over normals are
/// vectorised.
class CosineResponse {
 public:
  /// direction is a unit vector towards the wafer.
  explicit CosineResponse(Vec3d direction) : direction_(direction) {}

  SCARP_KERNEL_PART static AxialRate at(float cosine) {
    return {cosine, select(cosine > 0, 1.0F, 0.0F)};
  }

  Vec3f axis() const { return direction_; }

 private:
  Vec3f direction_;
};

/// The same for a response c h(c) at the cosine c, where h is 1 at one cosine and falls linearly to
/// 0 at two others. Several of them, each with its amplitude, are a response that is known at a few
/// slopes.
class SlopeResponse {
 public:
  /// below < at < above: h stays 1 down from at if below is less than 0, and up from it if above is
  /// more than 1. direction is a unit vector towards the wafer.
  SlopeResponse(Vec3d direction, float below, float at, float above)
      : direction_(direction),
        below_(below),
        at_(at),
        above_(above),
        rise_(below < 0 ? 0.0F : 1 / (at - below)),
        fall_(above > 1 ? 0.0F : 1 / (above - at)) {}

  SCARP_KERNEL_PART AxialRate at(float cosine) const {
    const float way = cosine - at_;
    const float hat = select(way < 0, 1 + rise_ * way, 1 - fall_ * way);
    const float inside = select(hat > 0, 1.0F, 0.0F);
    const float part = inside * hat;
    const float turn = inside * select(way < 0, rise_, -fall_);
    return {cosine * part, select(cosine > 0, part + cosine * turn, 0.0F)};
  }

  Vec3f axis() const { return direction_; }
  /// Cosines to the axis between which it bends little.
  std::vector<float> places() const;

  /// Whether it is 0 at all cosines between two.
  bool is_zero_between(float least, float most) const {
    return (rise_ > 0 && most < below_) || (fall_ > 0 && least > above_) || most == 0;
  }

 private:
  Vec3f direction_;
  float below_;
  float at_;
  float above_;
  float rise_;
  float fall_;
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

  /// Components of p along an axis of the wafer, the others as they are, at which two components
  /// along the axes of the crystal have one size, or one is 0: cusps of the rates lie there.
  static constexpr std::size_t most_creases = 9;
  struct Creases {
    std::array<float, most_creases> at{};
    std::size_t count = 0;
  };
  Creases creases(Vec3f p, int axis) const;

  /// Zero for p = 0, whose direction says nothing.
  SCARP_KERNEL_PART AngularRate rate(Vec3f p) const {
    const float size = std::max(length(p), 1e-6F);
    const Vec3f along{dot(axes_[0], p) / size, dot(axes_[1], p) / size, dot(axes_[2], p) / size};
    const Vec3f a{std::abs(along.x), std::abs(along.y), std::abs(along.z)};
    const float most = larger(larger(a.x, a.y), a.z);
    const float least = smaller(smaller(a.x, a.y), a.z);
    const float middle = larger(smaller(a.x, a.y), smaller(larger(a.x, a.y), a.z));
    // Linear in the components over the largest one, in two triangles of directions.
    const bool near_110 = middle + 2 * least < most;
    const Vec3f factors{select(near_110, near_110_.x, near_111_.x),
                        select(near_110, near_110_.y, near_111_.y),
                        select(near_110, near_110_.z, near_111_.z)};
    const float scale = select(most > 0.5F, 1 / most, 0.0F);
    const float value = scale * (factors.x * most + factors.y * middle + factors.z * least);
    // F does not change along n, so neither do its derivatives need a projection.
    const Vec3f by_order{scale * (factors.x - value), scale * factors.y, scale * factors.z};
    const auto slope_along = [&](float component, float magnitude) {
      const float inner = select(magnitude == least, by_order.z, by_order.y);
      const float slope = select(magnitude == most, by_order.x, inner);
      // On a plane of symmetry neither sign is right.
      return select(component < 0, -slope, select(component > 0, slope, 0.0F));
    };
    const Vec3f slope =
        (slope_along(along.x, a.x) * axes_[0] + slope_along(along.y, a.y) * axes_[1]) +
        slope_along(along.z, a.z) * axes_[2];
    return {size * value, (value / size) * p + slope};
  }

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

  AngularFactor(BeamResponse kind) : axis_(kind.axis()), kind_(std::move(kind)) { find_bounds(); }
  AngularFactor(CosineResponse kind) : axis_(kind.axis()), kind_(kind) { find_bounds(); }
  AngularFactor(SlopeResponse kind) : axis_(kind.axis()), kind_(kind) { find_bounds(); }
  AngularFactor(CrystalRates kind) : kind_(kind) { find_bounds(); }

  /// Calls visitor with the kind of factor, whose at() or rate() is then known to the compiler.
  template <class Visitor>
  auto visit(const Visitor& visitor) const {
    return std::visit(visitor, kind_);
  }

  AngularRate rate(Vec3f p) const {
    return visit([&](const auto& kind) { return rate_of(kind, p); });
  }

  /// F at a unit normal.
  float value(Vec3f n) const { return rate(n).value; }

  /// Whether F has minima at which its slope jumps, as at the planes of a crystal.
  bool has_cusps() const { return crystal() != nullptr; }

  /// The direction on whose angle to the normal alone F depends, if there is one.
  const std::optional<Vec3f>& axis() const { return axis_; }

  /// The rates of a crystal, if it is one.
  const CrystalRates* crystal() const { return std::get_if<CrystalRates>(&kind_); }

  /// The response between slopes, if it is one.
  const SlopeResponse* between_slopes() const { return std::get_if<SlopeResponse>(&kind_); }

  /// Whether it is the cosine, so that V |grad phi| is linear on all sides that face the axis.
  bool is_cosine() const { return std::holds_alternative<CosineResponse>(kind_); }

  /// Whether F depends on the angle to the vertical alone.
  bool is_vertical() const { return axis_ && axis_->x == 0 && axis_->y == 0; }

  const Bounds& bounds() const { return bounds_; }

 private:
  template <class Kind>
  AngularRate rate_of(const Kind& kind, Vec3f p) const {
    if constexpr (requires { kind.rate(p); }) {
      return kind.rate(p);
    } else {
      const float size = std::max(length(p), 1e-6F);
      const Vec3f n = p / size;
      return rate_about(*axis_, size, n, kind.at(axial_cosine(*axis_, n)));
    }
  }
  void find_bounds();

  std::optional<Vec3f> axis_{};
  std::variant<BeamResponse, CosineResponse, SlopeResponse, CrystalRates> kind_;
  Bounds bounds_;
};

/// The speed without dependence on the normal that limits the time step of an explicit scheme as
/// much as a sum of angular factors does: what those between slopes do together, where they have
/// one axis, for the steepest of their sum.
class LimitingSpeed {
 public:
  explicit LimitingSpeed(std::span<const AngularFactor> factors);

  /// Of a part that does not depend on the normal, and the amplitude of every factor: amplitude(k).
  template <class Amplitude>
  float operator()(float isotropic, const Amplitude& amplitude) const {
    float sum = std::abs(isotropic);
    for (const Group& group : groups_) {
      if (group.factors.empty()) {
        sum += group.limit * std::abs(amplitude(group.first));
        continue;
      }
      Row value{};
      Row across{};
      Row along{};
      bool any = false;
      for (std::size_t k = 0; k < group.factors.size(); ++k) {
        const float size = amplitude(group.first + k);
        if (size == 0) continue;
        any = true;
        const Sampled& of = group.factors[k];
        for (std::size_t n = 0; n < group.count; ++n) value[n] += size * of.value[n];
        for (std::size_t n = 0; n < group.count; ++n) across[n] += size * of.across[n];
        for (std::size_t n = 0; n < group.count; ++n) along[n] += size * of.along[n];
      }
      if (!any) continue;
      float most = 0;
      for (std::size_t n = 0; n < group.count; ++n)
        most = std::max({most, std::abs(value[n]), std::abs(across[n]) + std::abs(along[n])});
      sum += most;
    }
    return sum;
  }

 private:
  static constexpr std::size_t most_places = 64;
  using Row = std::array<float, most_places>;
  /// At cosines to the axis. The derivatives of |p| F by p, across and along the axis, are in such
  /// units that the sum of their magnitudes is a speed.
  struct Sampled {
    Row value{};
    Row across{};
    Row along{};
  };
  /// Factors between slopes that follow each other and have the same axis; or another one.
  struct Group {
    std::size_t first = 0;
    std::size_t count = 0;  ///< of cosines
    float limit = 0;        ///< of another one
    std::vector<Sampled> factors{};
  };

  static Sampled sampled(const AngularFactor& factor, Vec3f axis, std::span<const float> cosines);

  std::vector<Group> groups_;
};

}  // namespace scarp
