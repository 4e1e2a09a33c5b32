#include "flux/half_differences.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"

namespace scarp {

namespace {

// Elements in a row along the curve that share their error estimate.
constexpr std::size_t error_window = 16;

}  // namespace

// A single difference says little about its element. Elements nearby have the same variance but for
// their numbers of rays n, with which the variance of scrambled sets falls about as n^-1.5.
std::vector<float> standard_errors(const RayPlan& plan,
                                   const std::function<double(std::size_t rank)>& half,
                                   const std::function<bool(std::size_t rank)>& left_out) {
  const auto relative = [&](std::size_t rank) {
    const double n = plan.rays(rank);
    return n * std::sqrt(n);
  };
  std::vector<float> sigma(plan.size());
  for (std::size_t begin = 0; begin < sigma.size(); begin += error_window) {
    const std::size_t end = std::min(begin + error_window, sigma.size());
    double sum = 0;
    int count = 0;
    for (std::size_t i = begin; i < end; ++i) {
      if (left_out(i)) continue;
      const double difference = half(i);
      sum += difference * difference * relative(i);
      ++count;
    }
    for (std::size_t i = begin; i < end; ++i)
      if (!left_out(i)) sigma[i] = static_cast<float>(std::sqrt(sum / count / relative(i)));
  }
  return sigma;
}

std::uint32_t draw_signs(const FluxOptions& options, std::uint32_t element) {
  static_assert(draw_count == 32);
  return RandomStream(
             {options.seed, options.time_step, 0xFFFFFFFFU, (std::uint64_t{1} << 32) + element})
      .bits();
}

}  // namespace scarp
