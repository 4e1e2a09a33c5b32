#pragma once

#include <span>

#include "flux/sampling/linear_density.h"

namespace scarp {

/// Directions that are spread evenly around an axis: their density per solid angle, by a table over
/// the angle to the axis, linear in between and 0 outside.
///
/// A table of cos^n is the power cosine of that n.
class PolarDensity {
 public:
  /// None.
  PolarDensity() = default;

  /// Need not be normalised. Units: rad, in [0, pi / 2].
  ///
  /// Throws: InputError as LinearDensity, and for angles out of range.
  PolarDensity(std::span<const double> theta, std::span<const double> density);

  bool empty() const { return density_.empty(); }

  /// By the cosine of the angle; its integral over the half space is 1. Units: 1 / sr.
  double at(double cosine) const;

  /// The cosine of the angle within which a part u in [0, 1] of the directions lies.
  double cosine(double u) const { return 1 - density_.quantile(u); }

 private:
  // Of 1 - cos(theta), which directions of the same density per solid angle fill evenly: what is
  // drawn has exactly the density that at() gives.
  LinearDensity density_;
};

}  // namespace scarp
