#pragma once

#include <span>
#include <utility>
#include <vector>

#include "models/model_description.h"

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
/// Parameters, limits and source are in its description: `scarp models directional`.
class Directional final : public SurfaceModel, public AngularResponse {
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
  /// Species are one per beam; none without visibility.
  explicit Directional(Values values);

  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;
  bool is_mirror_symmetric(int axis) const override;
  bool is_isotropic() const override;
  /// One per beam, its cosine.
  std::vector<AngularFactor> factors() const override;
  std::vector<std::vector<float>> amplitudes(const SurfacePoints& points,
                                             std::span<const std::span<const float>> flux,
                                             std::span<const AngularFactor> factors) const override;

 private:
  Values values_;
};

ModelDescription directional_description();

}  // namespace scarp
