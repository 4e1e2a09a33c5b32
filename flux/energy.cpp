#include "flux/energy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace scarp {

namespace {

constexpr std::size_t interval_count = 4096;

// Between two of a table of equally likely intervals, linear. Tables are in single precision, in
// which all versions of the C library agree.
double interpolated(std::span<const float> quantiles, double u) {
  const double place = std::clamp(u, 0.0, 1.0) * static_cast<double>(quantiles.size() - 1);
  const std::size_t n = std::min(static_cast<std::size_t>(place), quantiles.size() - 2);
  const double below = quantiles[n];
  return below + (place - static_cast<double>(n)) * (quantiles[n + 1] - below);
}

double normal_part_below(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

double normal_quantile(double u) {
  double low = -9;
  double high = 9;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (normal_part_below(middle) < u ? low : high) = middle;
  }
  return low;
}

// In a table the first and the last interval cut the tails; ends that keep their second moment
// would lie near here.
constexpr double end_of_tails = 1.0 / (16 * interval_count);

double quantile_argument(std::size_t n) {
  return std::clamp(static_cast<double>(n) / interval_count, end_of_tails, 1 - end_of_tails);
}

std::vector<float> standard_normal_table() {
  std::vector<float> table;
  for (std::size_t n = 0; n <= interval_count; ++n)
    table.push_back(static_cast<float>(normal_quantile(quantile_argument(n))));
  return table;
}

}  // namespace

EnergyDistribution EnergyDistribution::gaussian(double mean, double deviation) {
  EnergyDistribution result;
  const double negative = deviation > 0 ? normal_part_below(-mean / deviation) : 0;
  for (std::size_t n = 0; n <= interval_count; ++n) {
    const double u = negative + (1 - negative) * quantile_argument(n);
    result.quantiles_.push_back(
        static_cast<float>(std::max(0.0, mean + deviation * normal_quantile(u))));
  }
  return result;
}

EnergyDistribution EnergyDistribution::bimodal(double mean, double width) {
  EnergyDistribution result;
  for (std::size_t n = 0; n <= interval_count; ++n) {
    const double u = static_cast<double>(n) / interval_count;
    result.quantiles_.push_back(
        static_cast<float>(mean - width / 2 * std::cos(std::numbers::pi * u)));
  }
  return result;
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
  EnergyDistribution result;
  std::size_t k = 1;
  for (std::size_t n = 0; n <= interval_count; ++n) {
    const double wanted = below.back() * static_cast<double>(n) / interval_count;
    while (k + 1 < energy.size() && below[k] < wanted) ++k;
    // The part of an interval of linear density: a quadratic, in the form that bears slope 0.
    const double step = energy[k] - energy[k - 1];
    const double slope = (density[k] - density[k - 1]) / step;
    const double rest = std::max(0.0, wanted - below[k - 1]);
    const double root =
        std::sqrt(std::max(0.0, density[k - 1] * density[k - 1] + 2 * slope * rest));
    const double place = rest > 0 ? 2 * rest / (density[k - 1] + root) : 0;
    result.quantiles_.push_back(static_cast<float>(energy[k - 1] + std::min(place, step)));
  }
  return result;
}

double EnergyDistribution::quantile(double u) const { return interpolated(quantiles_, u); }

double EnergyDistribution::mean() const {
  double sum = 0;
  for (std::size_t n = 0; n < interval_count; ++n)
    sum += (static_cast<double>(quantiles_[n]) + quantiles_[n + 1]) / 2;
  return sum / interval_count;
}

double standard_normal(double u) {
  static const std::vector<float> table = standard_normal_table();
  return interpolated(table, u);
}

}  // namespace scarp
