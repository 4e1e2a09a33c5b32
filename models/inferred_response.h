#pragma once

#include "models/angular_tallies.h"
#include "models/surface_model.h"

namespace scarp {

/// How the speeds of a model depend on the normal, as far as its species and what it says of them
/// tell: of every narrow lobe from which particles come some slopes, between which the speed is
/// that of the model if the surface leaned so (models/lobe_response.h); and what every yield that
/// is largest at a slant brings from an open source.
class InferredResponse final : public AngularResponse {
 public:
  /// The model has to outlive it; only its species are asked for here.
  explicit InferredResponse(const SurfaceModel& model);

  std::vector<AngularFactor> factors() const override;
  std::vector<std::vector<float>> amplitudes(const SurfacePoints& points,
                                             std::span<const std::span<const float>> flux,
                                             std::span<const AngularFactor> factors) const override;
  bool is_mirror_symmetric(int axis) const override;

 private:
  const SurfaceModel& model_;
  AngularTallies angular_;
};

}  // namespace scarp
