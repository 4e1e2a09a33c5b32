#pragma once

#include <optional>
#include <string>
#include <vector>

#include "flux/ions.h"
#include "flux/source_lobe.h"

namespace scarp {

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

  /// What leaves the surface besides what is re-emitted, by the cosine law: desorbed or sputtered
  /// atoms. Of neutrals, one per facet of the mesh, in particles per area relative to the flux of
  /// the source; nothing if it is empty. Taken as exact: an error of its own is not in that of the
  /// flux. A closed void has to take up what it emits. What follows from other species is given to
  /// solve_flux, see SurfaceEmission.
  std::vector<float> emission{};
};

}  // namespace scarp
