#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <span>

namespace scarp {

/// A function of the angle of incidence theta in [0, pi / 2], tabulated.
///
/// Linear in sin(theta / 2), which follows from the cosine by a square root, and which tells angles
/// apart near normal as well as near glancing incidence. Steps are 0.16 to 0.23 degrees wide.
class AngleTable {
 public:
  /// The same at all angles.
  AngleTable(double value = 1) { values_.fill(static_cast<float>(value)); }
  explicit AngleTable(const std::function<double(double theta)>& value);

  /// Linear in theta between rows.
  ///
  /// Throws: InputError unless angles ascend from 0 to 90 deg, each with a finite value.
  static AngleTable tabulated(std::span<const double> theta, std::span<const double> values);

  /// The sum of some tables, each times a weight.
  static AngleTable sum(std::span<const AngleTable> tables, std::span<const double> weights);

  static double half_sine(double cosine) { return std::sqrt(std::max(0.0, (1 - cosine) / 2)); }

  double at(double half_sine) const {
    const double place = std::clamp(half_sine * per_half_sine, 0.0, 1.0 * interval_count);
    const int interval = std::min(static_cast<int>(place), interval_count - 1);
    const double below = values_[static_cast<std::size_t>(interval)];
    const double above = values_[static_cast<std::size_t>(interval) + 1];
    return below + (place - interval) * (above - below);
  }

  double largest() const { return *std::max_element(values_.begin(), values_.end()); }
  double least() const { return *std::min_element(values_.begin(), values_.end()); }

 private:
  static constexpr int interval_count = 512;
  static constexpr double per_half_sine = interval_count * 1.41421356237309505;  // pi / 2 is last
  std::array<float, interval_count + 1> values_;
};

}  // namespace scarp
