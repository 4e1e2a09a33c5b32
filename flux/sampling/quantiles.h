#pragma once

#include <cstddef>
#include <functional>
#include <vector>

namespace scarp {

/// The quantiles of a distribution of one variable, tabulated at equally likely intervals.
///
/// In single precision, in which all versions of the C library agree; linear between entries.
class Quantiles {
 public:
  /// quantile(u) is the value that a part u of the distribution does not reach; asked for u = 0,
  /// 1 / interval_count, ..., 1, in this order.
  Quantiles(std::size_t interval_count, const std::function<double(double u)>& quantile);

  /// For u in [0, 1]; values outside are as at the ends.
  double at(double u) const;
  double largest() const { return values_.back(); }
  double mean() const;
  /// Of a function of the variable, taken at four places in each interval.
  template <class Function>
  double mean(const Function& function) const {
    constexpr int parts = 4;
    double sum = 0;
    for (std::size_t n = 0; n + 1 < values_.size(); ++n) {
      const double low = values_[n];
      const double rise = values_[n + 1] - low;
      for (int k = 0; k < parts; ++k) sum += function(low + (k + 0.5) / parts * rise);
    }
    return sum / (parts * static_cast<double>(values_.size() - 1));
  }

 private:
  std::vector<float> values_;
};

/// The place between low and high below which a part u lies, when part_below ascends from 0 to 1.
double inverse(const std::function<double(double x)>& part_below, double u, double low,
               double high);

}  // namespace scarp
