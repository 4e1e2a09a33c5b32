#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "models/formula.h"
#include "models/model_description.h"

namespace scarp {

/// Any number of neutral species and of ions, and a rate of each material that is a formula of what
/// arrives.
///
///     v = rate(material; fluxes of neutrals and ions, yields)
///
/// A neutral's name in a formula is its arrivals relative to an open flat wafer, so is an ion's;
/// the name of a yield is the mean of its law over the ions that arrive, times their arrivals.
///
/// Parameters, limits and source are in its description: `scarp models multi_particle`.
class MultiParticle final : public SurfaceModel {
 public:
  /// Shape: rates have one entry per material, none for materials that are not reached. Values of a
  /// formula are in the order of the tallies: species in theirs, of ions the yields behind.
  struct Values {
    std::vector<Species> species;
    std::vector<std::optional<RateFormula>> rate;
  };
  explicit MultiParticle(Values values)
      : SurfaceModel(values.species), values_(std::move(values)) {}

  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;
  std::string formula(MaterialId material) const override;

 private:
  Values values_;
};

ModelDescription multi_particle_description();

}  // namespace scarp
