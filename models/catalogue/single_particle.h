#pragma once

#include <span>
#include <utility>
#include <vector>

#include "models/model_description.h"

namespace scarp {

/// One neutral species with a constant sticking probability: LPCVD, CVD, plain reactive etching.
///
///     v = growth_rate(material) F    or    v = -etch_rate(material) F
///
/// F is what arrives, first and later arrivals together, relative to an open flat wafer. There F =
/// 1 whatever the sticking, because nothing comes back, so the rate is what a blanket wafer shows.
/// Particles leave the source with a density cos^n(theta) per solid angle about the downward
/// normal, among those that cross a plane, or with one of a table; those that do not stick are
/// re-emitted by the cosine law.
///
/// Parameters, limits and source are in its description: `scarp models single_particle`.
class SingleParticle final : public SurfaceModel {
 public:
  /// Shape: speed and sticking have one entry per material. Units: speed in nm/s.
  struct Values {
    std::vector<float> speed;
    std::vector<float> sticking;
    SourceLobe source{};
  };
  explicit SingleParticle(Values values);

  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;

 private:
  Values values_;
};

ModelDescription single_particle_description();

}  // namespace scarp
