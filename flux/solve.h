#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/tri_mesh.h"
#include "flux/flux_field.h"
#include "flux/options.h"
#include "flux/species.h"

namespace scarp {

class KeptHits;

/// Sticking that depends on what arrives, as where particles cover the surface.
///
/// Shape: flux[t] is tally t on every facet: species in their order, of each one its tallies in
///        theirs, arrivals first. The sticking of a species is one number per facet.
struct StickingFeedback {
  std::vector<bool> species{};  ///< whose sticking it is; of no species when empty

  /// Changes the sticking to what the flux leads to; false, and no change, if it fits already.
  /// Asked first with arrivals of 1 of these species, as on an open flat wafer (0 of those whose
  /// emission is given), then after every solution. It decides when to give up, too.
  std::function<bool(std::span<const std::span<const float>> flux,
                     std::vector<std::vector<float>>& sticking)>
      update{};
  /// The sticking that a flux leads to, of other species empty or anything. Where it is given,
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
/// With an emission its species are solved last, once the flux of all others is
/// known, with the emission that follows from it: what leaves is what arrives and what escapes of
/// them, whatever the error of the flux that it follows from. That error is not in their own. Those
/// whose sticking a feedback changes are solved with it, and their emission is asked for anew
/// whenever the sticking changes.
///
/// With hits, rays that solutions on the same mesh gathered before are not sent again. Seed and
/// time step have to be the same, species and materials may differ. Changes no bit.
///
/// Shape:  one FluxField per species; tallies are per facet.
/// Throws: InputError for sticking outside [0, 1], zero-area facets, a mesh without triangles, and
///         options or species that make no sense; the message starts with "flux:" or "species".
std::vector<FluxField> solve_flux(const TriMesh& facets, std::span<const Species> species,
                                  const FluxOptions& options, const StickingFeedback& feedback = {},
                                  const SurfaceEmission& emission = {}, KeptHits* hits = nullptr);

}  // namespace scarp
