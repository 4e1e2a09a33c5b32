#pragma once

#include <cstdint>
#include <vector>

#include "core/frame.h"
#include "core/tri_mesh.h"

namespace scarp::bench {

/// CPU time to make a scene and to fly in it, and how many flights.
struct TraceTime {
  std::vector<double> cpu_seconds;  ///< of the scene, then of blocks of particles
  std::uint64_t segments = 0;

  double total() const;
  /// Of every part the lesser time: another run of the same flights, disturbed at other places.
  void take_lesser(const TraceTime& again);
};

/// Follows particles of a cosine source until they stick (probability .1) or leave; facets re-emit
/// them by the cosine law. Emission and reflection are not timed.
///
/// Units: lengths in spacings.
TraceTime trace_time(const TriMesh& mesh, const Sides& sides, std::uint64_t particles);

}  // namespace scarp::bench
