#pragma once

#include <bit>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

namespace scarp {

/// Costs by their order of magnitude, eight parts to each factor of two.
class CostHistogram {
 public:
  static constexpr std::uint32_t size = 1U << 11;

  CostHistogram() : counts_(size, 0) {}
  /// cost: not negative.
  static std::uint32_t bin(float cost) { return std::bit_cast<std::uint32_t>(cost) >> 20; }
  void add(std::uint32_t bin) { ++counts_[bin]; }
  void add(const CostHistogram& other) {
    for (std::uint32_t i = 0; i < size; ++i) counts_[i] += other.counts_[i];
  }

  /// The bin with which the cheapest bins hold more than so many; at most the last finite one.
  std::uint32_t bin_beyond(double wanted) const {
    const std::uint32_t last = bin(std::numeric_limits<float>::max());
    std::uint32_t i = 0;
    for (double sum = counts_[0]; sum <= wanted && i < last; sum += counts_[i]) ++i;
    return i;
  }
  double up_to(std::uint32_t bin) const {
    return std::accumulate(counts_.begin(), counts_.begin() + bin + 1, 0.0);
  }
  static float upper_end(std::uint32_t bin) { return std::bit_cast<float>((bin + 1) << 20); }

 private:
  std::vector<std::uint32_t> counts_;
};

}  // namespace scarp
