#pragma once

#include <string>
#include <vector>

#include "core/vec3.h"

namespace scarp {

/// How particles of a species leave the source plane.
struct SourceLobe {
  enum class Kind {
    cosine,  ///< power cosine about -z: pdf (n + 1) / (2 pi) cos^n(theta) per particle that crosses
             ///< the plane
    beam,    ///< all particles along one direction; solved by shadow rays, without random numbers
  };
  Kind kind = Kind::cosine;
  double cosine_power = 1;
  Vec3d direction{0, 0, -1};  ///< of a beam, towards the wafer; unit vector
};

/// One kind of particle, as data: what the tracer needs to know and nothing else.
///
/// Shape: sticking is indexed by MaterialId and covers every material of the mesh; a mesh without
/// materials uses sticking[0].
struct Species {
  std::string name;
  SourceLobe source{};
  std::vector<float> sticking{1.0F};  ///< in [0, 1]; what does not stick is re-emitted diffusely
};

}  // namespace scarp
