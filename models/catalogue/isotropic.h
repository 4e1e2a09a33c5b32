#pragma once

#include <span>
#include <utility>
#include <vector>

#include "models/model_description.h"

namespace scarp {

/// Isotropic growth or etching: every point moves along its normal at a rate of its material.
///
///     v = growth_rate(material)    or    v = -etch_rate(material)
///
/// Parameters, limits and source are in its description: `scarp models isotropic`.
class Isotropic final : public SurfaceModel {
 public:
  /// Shape: speed has one entry per material. Units: nm/s.
  explicit Isotropic(std::vector<float> speed) : SurfaceModel({}), speed_(std::move(speed)) {}

  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;

 private:
  std::vector<float> speed_;
};

ModelDescription isotropic_description();

}  // namespace scarp
