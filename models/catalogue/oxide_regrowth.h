#pragma once

#include <utility>
#include <vector>

#include "models/model_description.h"

namespace scarp {

/// Wet etch of nitride between films of oxide, with the silica that is set free: it spreads in the
/// bath and, where the bath is more than saturated, settles on oxide.
///
///     v = -R + [settles] k (c_s / rho_d) max(0, c / c_s - 1),  div grad c = 0 in the bath
///     -D dc/dn = n rho R - [settles] k max(0, c - c_s) at the surface
///
/// What goes into the bath is what the speeds take off the solid, so no silica is lost or counted
/// twice. c / c_s is the only tally.
///
/// Parameters, limits and source are in the description: `scarp models oxide_regrowth`.
class OxideRegrowth final : public SurfaceModel, public Bath {
 public:
  /// How a material takes part. Units: nm/s.
  struct Surface {
    double etch_rate = 0;        ///< R
    double release = 0;          ///< n rho R / c_s
    double settling = 0;         ///< k; 0 where nothing settles
    double growth_per_flux = 0;  ///< c_s / rho_d
  };
  /// Shape: surfaces has one entry per material.
  struct Values {
    Solute solute{};
    std::vector<Surface> surfaces{};
  };
  explicit OxideRegrowth(Values values)
      : SurfaceModel({}, {.bath = this}), values_(std::move(values)) {}

  Solute solute() const override { return values_.solute; }
  std::vector<Exchange> exchange(const SurfacePoints& points) const override;
  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;

 private:
  Values values_;
};

ModelDescription oxide_regrowth_description();

}  // namespace scarp
