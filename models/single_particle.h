#pragma once

#include <span>
#include <utility>
#include <vector>

#include "models/parameter.h"
#include "models/surface_model.h"

namespace scarp {

/// One neutral species with a constant sticking probability: LPCVD, CVD, plain reactive etching.
///
///     v = growth_rate(material) F    or    v = -etch_rate(material) F
///
/// F is what arrives, first and later arrivals together, relative to an open flat wafer. There F =
/// 1 whatever the sticking, because nothing comes back, so the rate is what a blanket wafer shows.
/// Particles leave the source with a density cos^n(theta) per solid angle about the downward
/// normal, among those that cross a plane; those that do not stick are re-emitted by the cosine
/// law.
///
/// growth_rate   length/time, >= 0, one value or a table by material
/// etch_rate     the same; exactly one of the two is given
/// material      what is deposited; with growth_rate
/// sticking      in [0, 1], one value or a table by material; default 1
///               LPCVD oxide from TEOS 0.03-0.1, oxide from silane 0.3-0.8, CVD tungsten
///               0.001-0.1, PVD about 1
/// source_power  n, >= 0; default 1, a gas in equilibrium; above for a directed source
///
/// Limits: Molecules meet walls and not each other (mean free path above ten widths). Sticking does
/// not depend on flux, angle or temperature.
/// Source: Rey, McVittie and Saraswat 1990 for one sticking probability; kinetic theory for n = 1.
class SingleParticle final : public SurfaceModel {
 public:
  /// Shape: speed and sticking have one entry per material. Units: speed in nm/s.
  struct Values {
    std::vector<float> speed;
    std::vector<float> sticking;
    double source_power = 1;
  };
  explicit SingleParticle(Values values) : values_(std::move(values)) {}

  std::vector<Species> species() const override;
  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;

 private:
  Values values_;
};

std::span<const Parameter> single_particle_parameters();
/// Without a model, and with errors noted in the recipe, if the step does not make sense.
StepModel read_single_particle(const RecipeTable& step, const StepScope& scope);

}  // namespace scarp
