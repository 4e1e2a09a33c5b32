#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "flux/species.h"
#include "models/ion_parameters.h"
#include "models/parameter.h"

namespace scarp {

/// Laws of yields by tally, of which materials share those that are the same.
class SharedYields {
 public:
  /// The tally that counts the law; a law that is there already keeps its name. shape: the same
  /// number for the same factor by angle, whatever it is.
  std::size_t tally_of(const YieldLaw& law, double shape);

  /// In the order of their tallies, which begin with 1.
  const std::vector<YieldLaw>& laws() const { return laws_; }

 private:
  std::vector<YieldLaw> laws_;
  std::vector<double> shapes_;
};

/// Shapes of factors that have no number B; that is never below -1.
inline constexpr double enhanced_shape = -2;
inline constexpr double cosine_shape = -3;

/// The ions of a plasma: a species for each [[step.ion]] table, all with the same yields.
class PlasmaIons {
 public:
  PlasmaIons() = default;

  /// Reads the tables and adds the species, which are named "ion", or "ion_1" and so on; so are
  /// their yields where there are several.
  ///
  /// flux: the row of the flux on an open flat wafer. species: those before, with no yields.
  /// Throws: InputError, which names the key.
  PlasmaIons(const RecipeTable& step, const StepScope& scope, const Parameter& flux,
             std::span<const YieldLaw> yields, std::vector<Species>& species);

  /// What arrives (tally 0) or yields (the tallies after it) at a point, times the flux on an open
  /// flat wafer, of all ions together. Units: 1e15 cm^-2 s^-1.
  ///
  /// flux: as of SurfaceModel::speeds().
  double rate(std::span<const std::span<const float>> flux, std::size_t tally,
              std::size_t point) const;

 private:
  std::vector<double> flux_;  // on an open flat wafer
  std::size_t first_tally_ = 0;
  std::size_t tallies_ = 1;  // of each
};

}  // namespace scarp
