#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/frame.h"
#include "core/tri_mesh.h"
#include "flux/flux_field.h"
#include "flux/species.h"

namespace scarp {

/// Units: lengths as in the mesh.
struct FluxOptions {
  enum class Engine {
    automatic,  ///< gather where it can
    forward,    ///< particles from the source, one by one
    gather,     ///< rays from the facets and an exchange between them
  };
  /// Of neutral species. Ions and tilted sources are traced forward whatever it says, beams by
  /// shadow rays: there is no other way.
  Engine engine = Engine::automatic;
  Sides sides{};                 ///< where rays are mirrored or wrapped
  bool two_dimensional = false;  ///< rays travel in the x-z plane
  double spacing = 0;            ///< of the grid; 0: as of a mesh with two facets per grid cell
  double target_error = 0.01;    ///< root mean square over the exposed surface, by area, of the
                                 ///< error on patches of 4 x 4 spacings / max(flux, 0.05)
  /// Fixes the number of rays and switches the target off, when > 0.
  ///
  /// Forward: particles of each species, rounded up to whole batches of 32. Gather: rays from all
  /// facets together, which serve all species, shared out by area; at most as many, but never fewer
  /// than 4 from each element (see Elements: a piece of a facet with edges up to 3 spacings), even
  /// if that makes more. Rays along the lobe of a source with cosine power != 1 are not counted.
  std::uint64_t rays = 0;
  /// The most rays for the target, counted as rays and with the same least numbers: 32 (forward), 4
  /// per element (gather).
  std::uint64_t max_rays = std::uint64_t{1} << 28;
  std::uint64_t memory_limit = std::uint64_t{1} << 30;  ///< in bytes, for the hits of gathered rays
  std::uint64_t seed = 1;
  std::uint32_t time_step = 0;  ///< part of the random number's key
};

/// What arrives on every facet, for each species, with standard errors and an audit.
///
/// Shape:  one FluxField per species; tallies are per facet.
/// Throws: InputError for sticking outside [0, 1], zero-area facets, a mesh without triangles, and
///         options or species that make no sense; the message starts with "flux:" or "species".
std::vector<FluxField> solve_flux(const TriMesh& facets, std::span<const Species> species,
                                  const FluxOptions& options);

}  // namespace scarp
