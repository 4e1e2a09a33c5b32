#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/frame.h"
#include "flux/sampling/linear_density.h"
#include "flux/sampling/sampling.h"

namespace scarp {

/// Where on the source plane particles start: a density over the domain seen from above, relative
/// to its mean there. Bilinear between the lines of a grid.
///
/// Units: places in parts of the widths of the domain, [0, 1].
class SourceMap {
 public:
  /// Even.
  SourceMap() = default;

  /// Need not be normalised.
  ///
  /// Shape: density[i * y.size() + j] belongs to x[i], y[j]; without y, or with one, it is the same
  ///        along y. Units: x and y as the sides.
  /// Throws: InputError unless lines ascend and reach over the domain, and densities are finite,
  ///         not negative and not zero all over the domain; the message does not name the map.
  SourceMap(std::span<const double> x, std::span<const double> y, std::span<const double> density,
            const Sides& sides);

  bool empty() const { return x_.empty(); }

  /// The density over its mean.
  double at(double x, double y) const;

  /// Places with that density for pairs of uniform numbers, continuous in them but where there is
  /// none of it.
  std::array<double, 2> place(UnitSquare xi) const;

 private:
  double value(std::size_t i, std::size_t j) const { return value_[i * y_.size() + j]; }

  std::vector<double> x_;
  std::vector<double> y_;
  std::vector<double> value_;
  std::vector<double> below_;  // integral over y up to each line
  LinearDensity along_x_;
};

}  // namespace scarp
