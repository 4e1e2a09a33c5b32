#include "flux/sampling/angle_table.h"

#include <numbers>

#include "core/error.h"

namespace scarp {

// Rounded to single precision, in which all versions of the C library agree.
AngleTable::AngleTable(const std::function<double(double theta)>& value) {
  for (int n = 0; n <= interval_count; ++n) {
    const double theta = 2 * std::asin(std::min(n / per_half_sine, std::sqrt(0.5)));
    values_[static_cast<std::size_t>(n)] = static_cast<float>(value(theta));
  }
}

AngleTable AngleTable::tabulated(std::span<const double> theta, std::span<const double> values) {
  constexpr double right_angle = std::numbers::pi / 2;
  constexpr double rounding = 1e-12;
  if (theta.size() != values.size() || theta.size() < 2 || theta.front() != 0 ||
      std::abs(theta.back() - right_angle) > rounding) {
    throw InputError("its angles have to go from 0 to 90 deg");
  }
  for (std::size_t k = 0; k < theta.size(); ++k) {
    if (!std::isfinite(values[k])) throw InputError("a value is not finite");
    if (k > 0 && !(theta[k] > theta[k - 1])) throw InputError("its angles have to ascend");
  }
  return AngleTable([&](double at) {
    const auto above = std::upper_bound(theta.begin() + 1, theta.end() - 1, at);
    const auto k = static_cast<std::size_t>(above - theta.begin());
    const double part = std::min((at - theta[k - 1]) / (theta[k] - theta[k - 1]), 1.0);
    return values[k - 1] + part * (values[k] - values[k - 1]);
  });
}

AngleTable AngleTable::sum(std::span<const AngleTable> tables, std::span<const double> weights) {
  AngleTable result(0);
  for (std::size_t n = 0; n < result.values_.size(); ++n) {
    double value = 0;
    for (std::size_t k = 0; k < tables.size(); ++k)
      value += weights[k] * static_cast<double>(tables[k].values_[n]);
    result.values_[n] = static_cast<float>(value);
  }
  return result;
}

}  // namespace scarp
