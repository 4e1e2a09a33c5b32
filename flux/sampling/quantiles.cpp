#include "flux/sampling/quantiles.h"

#include <algorithm>

namespace scarp {

Quantiles::Quantiles(std::size_t interval_count, const std::function<double(double u)>& quantile) {
  for (std::size_t n = 0; n <= interval_count; ++n) {
    const double u = static_cast<double>(n) / static_cast<double>(interval_count);
    values_.push_back(static_cast<float>(quantile(u)));
  }
}

double Quantiles::at(double u) const {
  const double place = std::clamp(u, 0.0, 1.0) * static_cast<double>(values_.size() - 1);
  const std::size_t n = std::min(static_cast<std::size_t>(place), values_.size() - 2);
  const double below = values_[n];
  return below + (place - static_cast<double>(n)) * (values_[n + 1] - below);
}

double Quantiles::mean() const {
  double sum = 0;
  for (std::size_t n = 0; n + 1 < values_.size(); ++n)
    sum += (static_cast<double>(values_[n]) + values_[n + 1]) / 2;
  return sum / static_cast<double>(values_.size() - 1);
}

double inverse(const std::function<double(double x)>& part_below, double u, double low,
               double high) {
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (part_below(middle) < u ? low : high) = middle;
  }
  return low;
}

}  // namespace scarp
