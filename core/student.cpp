#include "core/student.h"

#include <cmath>
#include <limits>
#include <numbers>

namespace scarp {

double student_probability(double t, int degrees_of_freedom) {
  const double theta = std::atan(t / std::sqrt(static_cast<double>(degrees_of_freedom)));
  const double cosine = std::cos(theta);
  const double sine = std::sin(theta);
  const bool is_odd = degrees_of_freedom % 2 != 0;
  // The sums of the source run over every second power of the cosine.
  double term = is_odd ? cosine : 1;
  double sum = 0;
  for (int n = is_odd ? 2 : 1; n <= degrees_of_freedom - 1; n += 2) {
    sum += term;
    term *= cosine * cosine * n / (n + 1);
  }
  return is_odd ? 2 / std::numbers::pi * (theta + sine * sum) : sine * sum;
}

double three_standard_errors_chance() { return std::erfc(3 / std::numbers::sqrt2); }

double standard_errors(double chance, int degrees_of_freedom) {
  if (degrees_of_freedom < 1) return std::numeric_limits<double>::infinity();
  const auto is_enough = [&](double t) {
    return student_probability(t, degrees_of_freedom) >= 1 - chance;
  };
  double high = 1;
  while (!is_enough(high)) high *= 2;
  double low = 0;
  while (high - low > 1e-9 * high) {
    const double middle = 0.5 * (low + high);
    (is_enough(middle) ? high : low) = middle;
  }
  return high;
}

double three_standard_errors(int degrees_of_freedom) {
  return standard_errors(three_standard_errors_chance(), degrees_of_freedom);
}

}  // namespace scarp
