#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/angular_factor.h"
#include "core/vec3.h"
#include "flux/ions.h"
#include "flux/species.h"
#include "models/speed_question.h"

namespace scarp {

// How speeds depend on the normal of the surface under particles that come from about one direction
// (a lobe). The model is asked what it would say of a point if it leaned by a few other angles, and
// the grid takes what is between them at its own normals.

/// A tally of particles of a lobe.
struct LobeTally {
  std::size_t tally = 0;
  std::optional<MeanYield> yield{};  ///< that depends on the angle
  bool is_peaked = false;            ///< the yield is largest at a slant
  float along = 0;                   ///< arrivals_along() of the source
};

/// Particles that come from about one direction, of one or more species.
struct Lobe {
  Vec3d direction;  ///< unit vector towards the wafer
  std::vector<LobeTally> tallies{};
};

inline constexpr std::size_t lobe_factor_count = 7;

/// What arrives on a surface along the axis of a source, of what does on one across it: not
/// nothing, since no lobe is a beam.
float arrivals_along(const SourceLobe& source);

/// One factor for each slope that the model is asked for.
std::vector<AngularFactor> lobe_factors(Vec3d direction);

/// What there is of the speeds because of a lobe. Its peaked yields do not count where they are
/// apart.
///
/// Shape: an entry per point, as has apart. Units: nm/s.
std::vector<float> contribution_of_lobe(const SpeedQuestion& question, const Lobe& lobe,
                                        const std::vector<bool>& apart);

/// The amplitudes of the factors; what they come to at the points' own normals is taken from rest.
///
/// contribution is that of contribution_of_lobe(), and what turns is that, or a share of it. A
/// surface along the lobe gets none of it: that a floor goes on nearly as fast with fewer ions says
/// nothing of the walls that it leaves behind, which ions alone may etch.
///
/// Shape: by factor, an entry per point; factors are those of lobe_factors(). Units: nm/s.
std::vector<std::vector<float>> lobe_amplitudes(const SpeedQuestion& question, const Lobe& lobe,
                                                std::span<const AngularFactor> factors,
                                                const std::vector<bool>& apart,
                                                std::span<const float> contribution,
                                                std::span<const float> angular,
                                                std::vector<float>& rest);

}  // namespace scarp
