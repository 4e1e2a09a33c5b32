#pragma once

#include <span>
#include <utility>
#include <vector>

#include "models/parameter.h"
#include "models/surface_model.h"

namespace scarp {

/// Isotropic growth or etching: every point moves along its normal at a rate of its material.
///
///     v = growth_rate(material)    or    v = -etch_rate(material)
///
/// growth_rate  length/time, >= 0, one value or a table by material
/// etch_rate    the same; exactly one of the two is given
/// material     what is deposited; with growth_rate
///
/// Limits: No particles, so no shadow and no dependence on the aspect ratio: wet etching, or a gas
/// that reacts so seldom that it is everywhere the same. A mask is a material of rate 0. Growth
/// coats masks as well, unless its table says 0 for them. Voids that are closed off do not move.
/// Exact: the surface is offset by rate times time.
/// Source: Sethian and Adalsteinsson 1997.
class Isotropic final : public SurfaceModel {
 public:
  /// Shape: speed has one entry per material. Units: nm/s.
  explicit Isotropic(std::vector<float> speed) : speed_(std::move(speed)) {}

  std::vector<Species> species() const override { return {}; }
  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;

 private:
  std::vector<float> speed_;
};

std::span<const Parameter> isotropic_parameters();
/// Without a model, and with errors noted in the recipe, if the step does not make sense.
StepModel read_isotropic(const RecipeTable& step, const StepScope& scope);

}  // namespace scarp
