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

double three_standard_errors(int degrees_of_freedom) {
  if (degrees_of_freedom < 1) return std::numeric_limits<double>::infinity();
  const double wanted = std::erf(3 / std::numbers::sqrt2);
  double low = 3;
  double high = 1000;
  while (high - low > 1e-9) {
    const double middle = 0.5 * (low + high);
    (student_probability(middle, degrees_of_freedom) < wanted ? low : high) = middle;
  }
  return low;
}

}  // namespace scarp
