#pragma once

#include <cmath>
#include <cstdint>

namespace scarp {

/// Mean and variance of values that come one after another, without keeping them.
///
/// Parts that were gathered apart can be merged; the bits depend on the order of the parts.
/// Source: Welford 1962; Chan, Golub, LeVeque 1983 (merge).
class RunningStatistics {
 public:
  void add(double value) {
    ++count_;
    const double step = value - mean_;
    mean_ += step / static_cast<double>(count_);
    squares_ += step * (value - mean_);
  }

  void merge(const RunningStatistics& other) {
    if (other.count_ == 0) return;
    const auto n = static_cast<double>(count_);
    const auto m = static_cast<double>(other.count_);
    const double step = other.mean_ - mean_;
    count_ += other.count_;
    mean_ += step * (m / (n + m));
    squares_ += other.squares_ + step * step * (n * m / (n + m));
  }

  std::uint64_t count() const { return count_; }
  double mean() const { return mean_; }

  /// Of the population the values were drawn from (divided by count - 1); 0 for fewer than two.
  double variance() const { return count_ < 2 ? 0 : squares_ / static_cast<double>(count_ - 1); }

  /// Standard error of the mean.
  double std_error() const {
    return count_ < 2 ? 0 : std::sqrt(variance() / static_cast<double>(count_));
  }

 private:
  std::uint64_t count_ = 0;
  double mean_ = 0;
  double squares_ = 0;  ///< sum of squared distances from the mean
};

}  // namespace scarp
