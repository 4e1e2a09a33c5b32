#pragma once

#include <array>
#include <utility>
#include <vector>

#include "models/model_description.h"

namespace scarp {

/// A crystal whose surface moves at a rate that depends on the plane: wet etching, epitaxy.
///
///     v = amplitude(material) rate(n)
///
/// Parameters, limits and source are in the descriptions: `scarp models koh_etch`, `epitaxy`.
class Crystal final : public SurfaceModel, public AngularResponse {
 public:
  /// Shape: amplitude has one entry per material, negative where it is etched.
  struct Values {
    AngularFactor rate;  ///< > 0, in nm/s
    std::vector<float> amplitude;
  };
  explicit Crystal(Values values)
      : SurfaceModel({}, {.angular = this}), values_(std::move(values)) {}

  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;
  bool is_mirror_symmetric(int axis) const override;
  bool is_isotropic() const override { return false; }
  std::vector<AngularFactor> factors() const override { return {values_.rate}; }
  std::vector<std::vector<float>> amplitudes(const SurfacePoints& points,
                                             std::span<const std::span<const float>> flux,
                                             std::span<const AngularFactor> factors) const override;

 private:
  Values values_;
};

/// Rows that say how the crystal lies on the wafer.
Parameter wafer_plane_parameter();
Parameter crystal_azimuth_parameter();

/// The rate by the normal, with the crystal as those rows have it.
AngularFactor read_crystal(const RecipeTable& step, const CrystalRates::Values& rates);

/// What both models say of the rate in between.
inline constexpr std::string_view between_planes =
    "The rate is that of the four planes, and in between linear in the components of n along the "
    "axes of the crystal over the largest one, in two triangles of directions: {100}, {110}, {311} "
    "and {111}, {110}, {311}.";

}  // namespace scarp
