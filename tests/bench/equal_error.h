#pragma once

// Brings two ways to run a recipe to the same error, so that their times can be compared.

#include <cmath>
#include <numeric>
#include <span>

namespace scarp::bench {

/// A mean over seeds and its standard error, 0 of a single value.
struct MeanValue {
  double mean = 0;
  double std_error = 0;
};

inline MeanValue mean_of(std::span<const double> values) {
  const auto count = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / count;
  if (values.size() == 1) return {.mean = mean};
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return {.mean = mean, .std_error = std::sqrt(squares / (count * (count - 1)))};
}

enum class Worse { neither, first, second };

/// Which of two errors is greater by more than two standard errors of their difference.
inline Worse worse_of(const MeanValue& first, const MeanValue& second) {
  const double difference = first.mean - second.mean;
  if (std::abs(difference) <= 2 * std::hypot(first.std_error, second.std_error))
    return Worse::neither;
  return difference > 0 ? Worse::first : Worse::second;
}

/// Measures the worse one again with half its target, at most three times in all, until neither is
/// worse. Returns whether the errors are equal in the end.
///
/// Measured has an `error` (MeanValue) and a `target`; measure(measured, target) replaces one.
template <class Measured, class Measure>
bool bring_to_equal_error(Measured& first, Measured& second, const Measure& measure) {
  constexpr int most_halvings = 3;
  for (int halving = 0; halving < most_halvings; ++halving) {
    const Worse worse = worse_of(first.error, second.error);
    if (worse == Worse::neither) return true;
    Measured& refined = worse == Worse::first ? first : second;
    measure(refined, refined.target / 2);
  }
  return worse_of(first.error, second.error) == Worse::neither;
}

}  // namespace scarp::bench
