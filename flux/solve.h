#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/frame.h"
#include "core/tri_mesh.h"
#include "flux/flux_field.h"
#include "flux/species.h"

namespace scarp {

class KeptHits;

/// Nothing is known in it yet; see FluxOptions::hits.
std::shared_ptr<KeptHits> keep_hits();

/// Whether what gathered rays met can serve a species again: one of neutrals that comes from all
/// directions and places alike, or from the surface alone.
bool can_keep_hits(const Species& species);

/// The most rays of a species: fixed-point sums hold as many.
inline constexpr std::uint64_t most_rays = std::uint64_t{1} << 32;

/// Units: lengths as in the mesh.
struct FluxOptions {
  enum class Engine {
    automatic,  ///< gather, or forward where it takes fewer flights to the target: in features that
                ///< are deep for how much sticks, and for lobes that reach down to the wafer
    forward,    ///< particles from the source, one by one
    gather,     ///< rays from the facets, and for what is re-emitted an exchange between them
  };
  /// What comes straight from the source is gathered for ions and tilted sources as well; there is
  /// no exchange for what goes on, which is followed by particles that start where it arrived.
  /// Beams are found by shadow rays whatever it says.
  Engine engine = Engine::automatic;
  Sides sides{};                 ///< where rays are mirrored or wrapped
  bool two_dimensional = false;  ///< rays travel in the x-z plane
  /// The mesh is the section of a surface of revolution about the z axis, from the axis at x = 0 to
  /// the upper end of the sides, the same all along y; what arrives is that of the whole surface
  /// (see Revolution).
  bool axisymmetric = false;
  /// Per facet: its ring, if the mesh is a surface of revolution about the z axis. What arrives is
  /// told of whole rings.
  std::vector<std::uint32_t> rings{};
  double spacing = 0;          ///< of the grid; 0: as guessed_spacing()
  double target_error = 0.01;  ///< root mean square over the exposed surface, by area, of the
                               ///< error on patches of 4 x 4 spacings / max(flux, 0.05)
  /// What follows from each tally, if there are any: the target is then the root mean square over
  /// the exposed surface, by area, of the error on patches of the sum of a species' tallies, each
  /// times its response, in the unit of these. Beams have no target.
  ///
  /// Shape: [species][tally][facet].
  std::vector<std::vector<std::vector<float>>> responses{};
  /// Fixes the number of rays and switches the target off, when > 0.
  ///
  /// Forward: particles of each species, rounded up to whole batches of 32. Gather: rays from all
  /// facets together, which serve all species, shared out by area; at most as many, but never fewer
  /// than about 4096, which tell their error, and 4 or 8 from each element (see Elements; twice of
  /// that with particles that go on), even if that makes more. Elements are then two spacings wide.
  /// Rays along the lobe of a source with cosine power != 1 are not counted. Ions and tilted
  /// sources: half of it for rays from facets, those behind the facet included, half for particles
  /// that go on; all for rays if nothing does.
  std::uint64_t rays = 0;
  /// The most rays for the target, counted as rays and with the same least numbers.
  std::uint64_t max_rays = std::uint64_t{1} << 28;
  std::uint64_t memory_limit = std::uint64_t{1} << 30;  ///< in bytes, for the hits of gathered rays
  std::uint64_t seed = 1;
  std::uint32_t time_step = 0;  ///< part of the random number's key
  /// For solutions on the same mesh, with the same seed and time step, whose species or materials
  /// may differ: rays that were gathered before are not sent again. Changes no bit.
  std::shared_ptr<KeptHits> hits{};
};

/// Sticking that depends on what arrives, as where particles cover the surface.
///
/// Shape: flux[t] is tally t on every facet: species in their order, of each one its tallies in
///        theirs, arrivals first. The sticking of a species is one number per facet.
struct StickingFeedback {
  std::vector<bool> species{};  ///< whose sticking it is; of no species when empty

  /// Changes the sticking to what the flux leads to; false, and no change, if it fits already.
  /// Asked first with arrivals of 1 of these species, as on an open flat wafer (0 of those whose
  /// emission is told), then after every solution. It decides when to give up, too.
  std::function<bool(std::span<const std::span<const float>> flux,
                     std::vector<std::vector<float>>& sticking)>
      update{};
  /// The sticking that a flux leads to, of other species empty or anything. Where it is told,
  /// errors of gathered fluxes take in that the sticking follows the flux: where more particles
  /// cover the surface fewer of them stick, and an error grows on its way down.
  std::function<std::vector<std::vector<float>>(std::span<const std::span<const float>> flux)>
      sticking_at{};
  double tolerance = 1e-7;  ///< of the flux that it is asked with, relative, root mean square

  bool changes(std::size_t index) const { return index < species.size() && species[index]; }
};

/// Particles that leave the surface because of what arrives or covers it: atoms that ions sputter,
/// molecules that desorb.
///
/// Shape: flux[t] is tally t on every facet, as in StickingFeedback, 0 for these species but those
///        whose sticking a feedback changes; the result is the emission (see Species::emission) of
///        each of them, in their order.
struct SurfaceEmission {
  std::vector<bool> species{};  ///< whose emission it is; of no species when empty
  std::function<std::vector<std::vector<float>>(std::span<const std::span<const float>> flux)> of{};

  bool tells(std::size_t index) const { return index < species.size() && species[index]; }
};

/// What arrives on every facet, for each species, with standard errors and an audit.
///
/// With a feedback the species that it does not change are solved once. The others are gathered,
/// and their exchange is solved until the sticking fits, on the first rays and on those that reach
/// the target. What particles found cannot be used again with other sticking: forward they are
/// traced anew, with the same random numbers, for every sticking on the way.
/// Gathered errors are those with the sticking that they lead to if sticking_at tells it; forward,
/// and without it, those at the sticking that is found.
///
/// With an emission the species that it tells of are solved last, once the flux of all others is
/// known, with the emission that follows from it: what leaves is what arrives and what escapes of
/// them, whatever the error of the flux that it follows from. That error is not in their own. Those
/// whose sticking a feedback changes are solved with it, and their emission is asked for anew
/// whenever the sticking changes.
///
/// Shape:  one FluxField per species; tallies are per facet.
/// Throws: InputError for sticking outside [0, 1], zero-area facets, a mesh without triangles, and
///         options or species that make no sense; the message starts with "flux:" or "species".
std::vector<FluxField> solve_flux(const TriMesh& facets, std::span<const Species> species,
                                  const FluxOptions& options, const StickingFeedback& feedback = {},
                                  const SurfaceEmission& emission = {});

}  // namespace scarp
