#include "flux/portable_math.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace scarp {

// ln(m) = 2 atanh((m - 1) / (m + 1)); |s| <= 0.172 for m in [sqrt(1/2), sqrt(2)], so nine terms
// leave 1e-16.
double portable_log(double x) {
  int exponent = 0;
  double m = std::frexp(x, &exponent);  // exact
  if (m < std::numbers::sqrt2 / 2) {
    m *= 2;
    --exponent;
  }
  const double s = (m - 1) / (m + 1);
  const double s2 = s * s;
  double sum = 0;
  for (int k = 19; k >= 1; k -= 2) sum = sum * s2 + 1.0 / k;
  return exponent * std::numbers::ln2 + 2 * s * sum;
}

namespace {

double power_of_two(int exponent) {
  constexpr int bias = 1023;
  constexpr int mantissa_bits = 52;
  return std::bit_cast<double>(static_cast<std::uint64_t>(exponent + bias) << mantissa_bits);
}

constexpr std::array<double, 16> inverse_factorials = [] {
  std::array<double, 16> inverse{};
  double factorial = 1;
  for (std::size_t k = 0; k < inverse.size(); ++k) {
    inverse[k] = 1 / factorial;  // factorials are exact
    factorial *= static_cast<double>(k + 1);
  }
  return inverse;
}();

}  // namespace

// Even and odd terms side by side: neither waits for the other.
double portable_exp(double x) {
  if (std::isnan(x)) return x;
  // Beyond 800 it is zero or infinite.
  x = std::clamp(x, -800.0, 800.0);
  const double exponent = std::floor(x / std::numbers::ln2 + 0.5);
  const double rest = x - exponent * std::numbers::ln2;  // |rest| <= ln(2) / 2
  const double square = rest * rest;
  double even = 0;
  double odd = 0;
  for (std::size_t k = inverse_factorials.size(); k > 0; k -= 2) {
    odd = inverse_factorials[k - 1] + odd * square;
    even = inverse_factorials[k - 2] + even * square;
  }
  // In two parts, of which only the last may leave the range of numbers.
  const int half = static_cast<int>(exponent) / 2;
  return (even + rest * odd) * power_of_two(half) * power_of_two(static_cast<int>(exponent) - half);
}

double portable_power(double x, double y) {
  if (x <= 0) return 0;
  const double exponent = y * portable_log(x);
  return exponent < -700 ? 0 : portable_exp(exponent);
}

SineCosine portable_sine_cosine(double angle, double quarters) {
  const auto [s, c] = portable_sine_cosine(angle);
  switch (static_cast<int>(quarters - 4 * std::floor(quarters / 4))) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

}  // namespace scarp
