#include "flux/sampling/linear_density.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace scarp {

LinearDensity::LinearDensity(std::span<const double> arguments, std::span<const double> densities) {
  if (arguments.size() != densities.size() || arguments.size() < 2)
    throw InputError("a distribution needs at least two arguments, each with a density");
  for (std::size_t k = 0; k < arguments.size(); ++k) {
    if (!(densities[k] >= 0) || !std::isfinite(densities[k]))
      throw InputError("the density of a distribution is negative or not finite");
    if (!std::isfinite(arguments[k]) || (k > 0 && !(arguments[k] > arguments[k - 1])))
      throw InputError("the arguments of a distribution have to ascend");
  }
  // Zeros at the ends say nothing but for the last one on each side.
  std::size_t first = 0;
  std::size_t last = densities.size() - 1;
  while (first < last && densities[first] == 0 && densities[first + 1] == 0) ++first;
  while (last > first && densities[last] == 0 && densities[last - 1] == 0) --last;
  if (first == last) throw InputError("a distribution is zero everywhere");

  x_.assign(arguments.begin() + static_cast<std::ptrdiff_t>(first),
            arguments.begin() + static_cast<std::ptrdiff_t>(last) + 1);
  density_.assign(densities.begin() + static_cast<std::ptrdiff_t>(first),
                  densities.begin() + static_cast<std::ptrdiff_t>(last) + 1);
  below_.assign(1, 0);
  for (std::size_t k = 1; k < x_.size(); ++k)
    below_.push_back(below_.back() + (x_[k] - x_[k - 1]) * (density_[k] + density_[k - 1]) / 2);
  const double whole = below_.back();
  if (!(whole > 0) || !std::isfinite(whole))
    throw InputError("the integral of a distribution is not a positive number");
  for (double& density : density_) density /= whole;
  for (double& part : below_) part /= whole;
}

double LinearDensity::at(double x) const {
  if (!(x >= x_.front() && x <= x_.back())) return 0;
  const auto above = std::upper_bound(x_.begin() + 1, x_.end() - 1, x);
  const auto k = static_cast<std::size_t>(above - x_.begin());
  const double place = (x - x_[k - 1]) / (x_[k] - x_[k - 1]);
  return density_[k - 1] + place * (density_[k] - density_[k - 1]);
}

double LinearDensity::quantile(double u) const {
  const auto above = std::lower_bound(below_.begin() + 1, below_.end() - 1, u);
  const auto k = static_cast<std::size_t>(above - below_.begin());
  return x_[k - 1] + reach({.width = x_[k] - x_[k - 1],
                            .low = density_[k - 1],
                            .high = density_[k],
                            .part = u - below_[k - 1]});
}

// A quadratic, in the form that bears slope 0.
double reach(const LinearPart& interval) {
  if (!(interval.part > 0)) return 0;
  const double slope = (interval.high - interval.low) / interval.width;
  const double square = interval.low * interval.low + 2 * slope * interval.part;
  const double root = std::sqrt(std::max(0.0, square));
  return std::min(2 * interval.part / (interval.low + root), interval.width);
}

}  // namespace scarp
