#pragma once

#include <span>
#include <utility>

#include "flux/sampling/quantiles.h"

namespace scarp {

/// How the energies of ions at the source are distributed, by quantiles.
///
/// Units: eV.
class EnergyDistribution {
 public:
  /// Normal, cut off below 0.
  static EnergyDistribution gaussian(double mean, double deviation);

  /// Two peaks, of ions that cross a sheath within a part of the radio-frequency period: the
  /// density is 1 / (pi sqrt(1 - x^2)) in x = 2 (E - mean) / width.
  /// Source: Benoit-Cattin and Bernard 1968.
  static EnergyDistribution bimodal(double mean, double width);

  /// Linear between the points of a table; need not be normalised.
  ///
  /// Throws: InputError as LinearDensity, and for negative energies.
  static EnergyDistribution tabulated(std::span<const double> energy,
                                      std::span<const double> density);

  /// The energy that a part u in [0, 1) of the ions does not reach.
  double quantile(double u) const { return quantiles_.at(u); }
  double largest() const { return quantiles_.largest(); }
  double mean() const { return quantiles_.mean(); }
  /// Of a function of the energy.
  template <class Function>
  double mean(const Function& function) const {
    return quantiles_.mean(function);
  }

 private:
  explicit EnergyDistribution(Quantiles quantiles) : quantiles_(std::move(quantiles)) {}

  Quantiles quantiles_;
};

/// A number with mean 0 and variance 1, normally distributed for uniform u in [0, 1); its tails end
/// at 4.2.
double standard_normal(double u);

}  // namespace scarp
