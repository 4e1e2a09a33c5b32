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

/// Whether an error is greater than another one by more than two standard errors of the difference.
inline bool is_worse(const MeanValue& error, const MeanValue& than) {
  return error.mean - than.mean > 2 * std::hypot(error.std_error, than.std_error);
}

/// Measures the worse one again with half its target, at most three times, until it is not worse.
/// Returns whether it came to that.
///
/// A halving may go too far, which would flatter the other one: what has then a smaller error is
/// replaced by what lies between its last two measurements at the error of the other one.
///
/// Measured has an `error` (MeanValue) and a `target`; measure(measured, target) replaces one;
/// between(before, after, weight) is found by its argument, with the weight of the latter.
template <class Measured, class Measure>
bool bring_to_equal_error(Measured& first, Measured& second, const Measure& measure) {
  constexpr int most_halvings = 3;
  const bool first_is_worse = is_worse(first.error, second.error);
  if (!first_is_worse && !is_worse(second.error, first.error)) return true;
  Measured& refined = first_is_worse ? first : second;
  const MeanValue other = (first_is_worse ? second : first).error;
  for (int halving = 0; halving < most_halvings; ++halving) {
    const Measured before = refined;
    measure(refined, before.target / 2);
    if (is_worse(refined.error, other)) continue;
    if (refined.error.mean < other.mean) {
      refined = between(before, refined,
                        std::log(before.error.mean / other.mean) /
                            std::log(before.error.mean / refined.error.mean));
    }
    return true;
  }
  return false;
}

}  // namespace scarp::bench
