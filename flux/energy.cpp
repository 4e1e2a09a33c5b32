#include "flux/energy.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "flux/sampling/linear_density.h"

namespace scarp {

namespace {

constexpr std::size_t interval_count = 4096;

double normal_part_below(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

double normal_quantile(double u) { return inverse(normal_part_below, u, -9, 9); }

// In a table the first and the last interval cut the tails; ends that keep their second moment
// would lie near here.
constexpr double end_of_tails = 1.0 / (16 * interval_count);

double without_tails(double u) { return std::clamp(u, end_of_tails, 1 - end_of_tails); }

}  // namespace

EnergyDistribution EnergyDistribution::gaussian(double mean, double deviation) {
  const double negative = deviation > 0 ? normal_part_below(-mean / deviation) : 0;
  const auto quantile = [=](double u) {
    const double part = negative + (1 - negative) * without_tails(u);
    return std::max(0.0, mean + deviation * normal_quantile(part));
  };
  return EnergyDistribution({interval_count, quantile});
}

EnergyDistribution EnergyDistribution::bimodal(double mean, double width) {
  const auto quantile = [=](double u) { return mean - width / 2 * std::cos(std::numbers::pi * u); };
  return EnergyDistribution({interval_count, quantile});
}

EnergyDistribution EnergyDistribution::tabulated(std::span<const double> energy,
                                                 std::span<const double> density) {
  const LinearDensity table(energy, density);
  if (energy.front() < 0) throw InputError("the energies of a distribution have to ascend from 0");
  const auto quantile = [&](double u) { return table.quantile(u); };
  return EnergyDistribution({interval_count, quantile});
}

double standard_normal(double u) {
  static const Quantiles table(interval_count,
                               [](double part) { return normal_quantile(without_tails(part)); });
  return table.at(u);
}

}  // namespace scarp
