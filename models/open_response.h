#pragma once

#include <vector>

#include "core/angular_factor.h"
#include "flux/species.h"

namespace scarp {

/// What ions bring straight from a source that is all in sight: their arrivals times a yield, by
/// the normal of the surface, relative to the flux of the source. A mean over directions of the
/// lobe, and over the energies.
class OpenResponse {
 public:
  OpenResponse(const Species& ions, const YieldLaw& law);

  double at(Vec3d normal) const;
  /// Of a flat wafer.
  double flat() const { return at({0, 0, 1}); }

  /// As a factor of a speed. Around the axis of the source it is taken as the same, which it is for
  /// one that is vertical or rotates; of others narrow about theirs, nearly.
  AngularFactor factor() const;

 private:
  MeanYield yield_;
  Vec3d axis_;  ///< away from the wafer; vertical if the wafer turns
  std::vector<Vec3d> directions_;
};

}  // namespace scarp
