#pragma once

#include <utility>
#include <vector>

#include "models/model_description.h"

namespace scarp {

/// Wet etching of a crystal at a rate that depends on the plane.
///
///     v = -rate(n)
///
/// Parameters, limits and source are in its description: `scarp models koh_etch`.
class KohEtch final : public SurfaceModel {
 public:
  /// Shape: is_etched has one entry per material.
  struct Values {
    AngularFactor rate;  ///< > 0, in nm/s
    std::vector<bool> is_etched;
  };
  explicit KohEtch(Values values) : values_(std::move(values)) {}

  std::vector<Species> species() const override { return {}; }
  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;
  bool is_mirror_symmetric(int axis) const override;
  std::vector<AngularFactor> angular_factors() const override { return {values_.rate}; }
  std::vector<std::vector<float>> amplitudes(
      const SurfacePoints& points, std::span<const std::span<const float>> flux) const override;

 private:
  Values values_;
};

ModelDescription koh_etch_description();

}  // namespace scarp
