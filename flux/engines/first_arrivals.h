#pragma once

#include <cstdint>
#include <vector>

#include "flux/rays/problem.h"
#include "flux/rays/ray_plan.h"
#include "flux/rays/shots.h"

namespace scarp {

/// What comes straight from the source, from rays along its lobe.
struct FirstArrivals {
  /// A ray that met the source: turned around, the first flight of a particle.
  struct Lit {
    ShotName name;
    float goes_on = 0;  ///< of the flux of the ray, what does not stick; > 0
  };

  /// At rank * set_count + set, the sum over the rays of arrivals, then of yields, last of what
  /// does not stick; divided by the number of rays it is the flux.
  std::vector<std::vector<double>> sums;
  std::vector<Lit> lit;             ///< by rank
  std::vector<std::uint32_t> rays;  ///< in each set of a rank
  /// By rank, in both sets: rays that flew, since they do not leave into the solid, and those of
  /// them that met the source.
  std::vector<std::uint32_t> flown;
  std::vector<std::uint32_t> met;
  std::uint64_t flights = 0;
};

/// Sends the rays of a plan against the lobe, except those that an earlier look with smaller sets
/// has sent.
FirstArrivals look_for_source(const FluxProblem& problem, const RayPlan& plan,
                              FirstArrivals earlier);

/// Whether anything can go on after it arrives.
bool sticks_at_once(const FluxProblem& problem);

}  // namespace scarp
