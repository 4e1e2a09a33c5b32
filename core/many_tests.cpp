#include "core/many_tests.h"

#include <algorithm>

namespace scarp {

// One counts if the harmonic mean of every set with it is below what is wanted. The worst set has
// all others that are above that themselves.
std::vector<bool> beyond_chance(std::span<const double> chances, double wanted) {
  constexpr double least = 1e-300;
  const double enough = 1 / wanted;
  const auto inverse = [&](double chance) { return 1 / std::max(chance, least); };
  double lacking = 0;
  for (const double chance : chances) lacking += std::max(0.0, enough - inverse(chance));
  std::vector<bool> result;
  for (const double chance : chances)
    result.push_back(chance <= wanted && inverse(chance) - enough >= lacking);
  return result;
}

}  // namespace scarp
