#include "flux/sampling/portable_math.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "core/vector_kernel.h"

namespace scarp {

namespace {

constexpr int mantissa_bits = 52;
constexpr int bias = 1023;

// Of m 2^exponent, with m in [1/2, 1): ln(m) = 2 atanh((m - 1) / (m + 1)); |s| <= 0.172 for m in
// [sqrt(1/2), sqrt(2)], so ten terms leave 1e-17.
inline double log_of(double m, double exponent) {
  const bool is_small = m < std::numbers::sqrt2 / 2;
  m = is_small ? 2 * m : m;
  exponent = is_small ? exponent - 1 : exponent;
  const double s = (m - 1) / (m + 1);
  const double s2 = s * s;
  double sum = 0;
  for (int k = 19; k >= 1; k -= 2) sum = sum * s2 + 1.0 / k;
  return exponent * std::numbers::ln2 + 2 * s * sum;
}

// Added to a whole number below 2^51 it leaves it in the last bits, two's complement.
constexpr double whole_in_last_bits = 0x1.8p52;

inline double log_of_normal(double x) {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  constexpr std::uint64_t mantissa = (std::uint64_t{1} << mantissa_bits) - 1;
  const double m =
      std::bit_cast<double>((bits & mantissa) | std::uint64_t{bias - 1} << mantissa_bits);
  const auto biased = std::bit_cast<double>(bits >> mantissa_bits |
                                            std::bit_cast<std::uint64_t>(whole_in_last_bits)) -
                      whole_in_last_bits;
  return log_of(m, biased - (bias - 1));
}

inline double power_of_two(double whole) {
  const auto bits = std::bit_cast<std::uint64_t>(whole + whole_in_last_bits);
  return std::bit_cast<double>((bits + bias) << mantissa_bits);
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

// Even and odd terms side by side: neither waits for the other. For |x| <= 800.
inline double exp_of(double x) {
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
  const double half = std::floor(exponent / 2);
  return (even + rest * odd) * power_of_two(half) * power_of_two(exponent - half);
}

inline double power_of(double logarithm, double y) {
  const double exponent = y * logarithm;
  const double power = exp_of(std::clamp(exponent, -800.0, 800.0));
  return exponent < -700 ? 0 : power;
}

}  // namespace

double portable_log(double x) {
  int exponent = 0;
  const double m = std::frexp(x, &exponent);  // exact
  return log_of(m, exponent);
}

double portable_exp(double x) {
  if (std::isnan(x)) return x;
  // Beyond 800 it is zero or infinite.
  return exp_of(std::clamp(x, -800.0, 800.0));
}

double portable_power(double x, double y) { return x <= 0 ? 0 : power_of(portable_log(x), y); }

SCARP_WIDE_KERNEL void portable_powers(std::span<double> x, double y) {
  for (double& each : x) {
    const double power = power_of(log_of_normal(each), y);
    each = each <= 0 ? 0 : power;
  }
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
