#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <vector>

#include "core/material.h"
#include "flux/engines/view.h"

namespace scarp {

/// Whether what gathered rays met can serve a species again: one of neutrals that comes from all
/// directions and places alike, or from the surface alone.
bool can_keep_hits(const Species& species);

/// What gathered rays met on one mesh, for solutions that send the same ones again.
///
/// Rays are a function of mesh, seed, time step, elements and how many each of these sends, so
/// whether they were sent or remembered changes no bit of a flux, and they are counted either way.
/// Those that tell from where to aim at the sky, one per element, are sent anew. Only rays to the
/// same sky are: those of species that come evenly from all directions, or from the surface alone.
///
/// The facets may change their materials, which decide what is joined; the last few patterns are
/// remembered.
class KeptHits {
 public:
  /// As scarp::look.
  /// widths: of the cells in which elements are joined, per facet.
  std::shared_ptr<const View> look(std::span<const FluxProblem> problems, const RayPlan& plan,
                                   std::span<const float> widths,
                                   std::shared_ptr<const View> earlier);

  /// Rays that were sent, not remembered.
  std::uint64_t sent() const { return sent_; }

 private:
  struct Known {
    std::vector<MaterialId> materials;
    std::vector<bool> have_source;
    std::vector<float> widths;  ///< of the cells of elements
    std::shared_ptr<const View> view;
  };
  std::deque<Known> known_;  ///< the oldest first
  std::uint64_t sent_ = 0;
};

}  // namespace scarp
