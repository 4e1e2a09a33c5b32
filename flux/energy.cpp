#include "flux/energy.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/error.h"

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
  if (energy.size() != density.size() || energy.size() < 2)
    throw InputError("an energy distribution needs at least two energies, each with a density");
  std::vector<double> below{0};
  for (std::size_t k = 0; k < energy.size(); ++k) {
    if (!(density[k] >= 0)) throw InputError("the density of an energy distribution is negative");
    if (!(energy[k] >= 0) || (k > 0 && !(energy[k] > energy[k - 1])))
      throw InputError("the energies of a distribution have to ascend from 0 or above");
    if (k > 0) {
      const double step = energy[k] - energy[k - 1];
      below.push_back(below.back() + step * (density[k] + density[k - 1]) / 2);
    }
  }
  if (!(below.back() > 0)) throw InputError("an energy distribution is zero everywhere");
  std::size_t k = 1;
  while (!(below[k] > 0)) ++k;
  const auto quantile = [&](double u) {
    const double wanted = below.back() * u;
    while (k + 1 < energy.size() && below[k] < wanted) ++k;
    // The part of an interval of linear density: a quadratic, in the form that bears slope 0.
    const double step = energy[k] - energy[k - 1];
    const double slope = (density[k] - density[k - 1]) / step;
    const double rest = wanted - below[k - 1];
    const double root =
        std::sqrt(std::max(0.0, density[k - 1] * density[k - 1] + 2 * slope * rest));
    const double place = rest > 0 ? 2 * rest / (density[k - 1] + root) : 0;
    return energy[k - 1] + place;
  };
  return EnergyDistribution({interval_count, quantile});
}

double standard_normal(double u) {
  static const Quantiles table(interval_count,
                               [](double part) { return normal_quantile(without_tails(part)); });
  return table.at(u);
}

}  // namespace scarp
