#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/vec3.h"
#include "flux/ions.h"

namespace scarp {

/// How particles of a species leave the source plane.
struct SourceLobe {
  enum class Kind {
    cosine,  ///< power cosine about the direction: pdf (n + 1) / (2 pi) cos^n(theta) per particle
             ///< that crosses the plane; what points away from the wafer is drawn again
    beam,    ///< all particles along one direction; solved by shadow rays, without random numbers
  };
  Kind kind = Kind::cosine;
  double cosine_power = 1;
  Vec3d direction{0, 0, -1};  ///< axis of the lobe or beam, towards the wafer; unit vector
  bool rotating = false;      ///< the wafer turns: the azimuth of the direction is uniform
};

/// One kind of particle, as data: what the tracer needs to know and nothing else.
///
/// Shape: sticking is indexed by MaterialId and covers every material of the mesh; a mesh without
/// materials uses sticking[0].
struct Species {
  std::string name;
  SourceLobe source{};
  std::vector<float> sticking{1.0F};  ///< in [0, 1]; what does not stick is re-emitted diffusely
  std::optional<Ions> ions{};         ///< has energy, and is reflected instead
  std::vector<YieldLaw> yields{};     ///< of ions; one more tally each
};

}  // namespace scarp
