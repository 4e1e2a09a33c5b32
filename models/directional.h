#pragma once

#include <span>
#include <utility>
#include <vector>

#include "models/parameter.h"
#include "models/surface_model.h"

namespace scarp {

/// Growth or etching by parallel beams, and a part that is the same in all directions.
///
///     v = directional_rate(material) sum_i share_i max(0, -d_i.n) seen_i +
///     isotropic_rate(material)
///
/// d_i is the direction of beam i towards the wafer, seen_i the part of the point from which the
/// source is in sight against d_i, and the shares add up to 1. Etching changes the sign of v. Under
/// one vertical beam a flat bottom moves at exactly the directional rate, walls along the beam do
/// not move and slopes keep their angle.
///
/// directional_growth_rate, directional_etch_rate
///                length/time, >= 0, one value or a table by material: the speed of a surface that
///                faces the beam; exactly one of the two is given
/// isotropic_growth_rate, isotropic_etch_rate
///                the same kind, beside the directional rate of its name; default 0
/// material       what is deposited; when it grows
/// visibility     default true; false leaves out the shadows: seen_i = 1
/// [[step.beam]]  one table per beam; none means one vertical beam
///   tilt         angle to the vertical, at most 89 deg; default 0
///   azimuth      direction in which the beam leans, from x towards y; default 0
///   share        > 0, relative to those of the other beams; default 1
///
/// Limits: Particles stay where they arrive; the rate depends on the angle by the cosine alone. A
/// beam that leans towards a reflective side is refused, because the side would mirror it.
/// Source: Sethian and Adalsteinsson 1997.
class Directional final : public SurfaceModel {
 public:
  struct Beam {
    Vec3d direction{0, 0, -1};  ///< unit vector
    double share = 1;           ///< all of them add up to 1
  };
  /// Shape: speeds have one entry per material. Units: nm/s, etching negative.
  struct Values {
    std::vector<float> directional_speed;
    std::vector<float> isotropic_speed;
    std::vector<Beam> beams{Beam{}};
    bool visibility = true;
  };
  explicit Directional(Values values) : values_(std::move(values)) {}

  /// One per beam; none without visibility.
  std::vector<Species> species() const override;
  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;

 private:
  Values values_;
};

/// The unit vector of a beam. Angles that are multiples of 90 degrees give exact zeros and ones,
/// and opposite azimuths give exactly mirrored vectors. Units: rad.
Vec3d beam_direction(double tilt, double azimuth);

std::span<const Parameter> directional_parameters();
/// Without a model, and with errors noted in the recipe, if the step does not make sense.
StepModel read_directional(const RecipeTable& step, const StepScope& scope);

}  // namespace scarp
