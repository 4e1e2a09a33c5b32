#include "core/many_tests.h"

#include <algorithm>

namespace scarp {

// One counts if the weighted harmonic mean of every set with it is below what is wanted. The worst
// set has all others that are above that themselves.
std::vector<bool> beyond_chance(std::span<const LookedAt> all, double wanted) {
  constexpr double least = 1e-300;
  const auto surplus = [&](const LookedAt& each) {
    return each.weight * (1 / std::max(each.chance, least) - 1 / wanted);
  };
  double lacking = 0;
  for (const LookedAt& each : all) lacking += std::max(0.0, -surplus(each));
  std::vector<bool> result;
  for (const LookedAt& each : all)
    result.push_back(each.chance <= wanted && surplus(each) >= lacking);
  return result;
}

}  // namespace scarp
