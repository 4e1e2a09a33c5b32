#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/tri_mesh.h"
#include "flux/flux_field.h"
#include "flux/rays/ray_scene.h"

namespace scarp {

/// Errors of a flux below it count as if it were this; units: source flux.
inline constexpr double small_flux = 0.05;

/// The facets of a surface in groups over which flux errors are judged: cells of 4 x 4 x 4 spacings
/// by centroid, one of six main directions by normal, one connected part of the surface. On a
/// surface of revolution they are made of whole rings, by the first facet of each.
class Patches {
 public:
  /// Keeps the mesh.
  /// rings: FluxOptions::rings.
  Patches(const TriMesh& mesh, const RayScene& scene, std::span<const std::uint32_t> rings = {});

  struct Patch {
    std::uint32_t part = 0;  ///< connected part of the surface
    double area = 0;         ///< in squared spacings
    double whole = 0;        ///< area of a patch that is not cut: 16, less in a narrow domain
    std::vector<std::uint32_t> facets;  ///< those of a ring together
  };
  const std::vector<Patch>& list() const { return patches_; }
  std::uint32_t part_count() const { return part_count_; }
  std::span<const std::uint32_t> rings() const { return rings_; }
  const TriMesh& mesh() const { return mesh_; }

 private:
  const TriMesh& mesh_;
  std::vector<std::uint32_t> rings_;
  std::vector<Patch> patches_;
  std::uint32_t part_count_ = 0;
};

/// The flux on each facet and how far it may be off: deviations that are equally likely, each taken
/// on all facets together. The standard error of the flux, and of its mean over any facets, is the
/// root of the sum of squared deviations over divisor.
struct FluxSpread {
  std::function<double(std::size_t facet)> flux;
  std::function<void(std::size_t facet, std::span<double> of_facet)> deviations;
  std::size_t count = 0;  ///< of deviations
  double divisor = 1;
  double unseen = 0;  ///< standard error times area (squared spacings) where nothing arrived
};

struct FluxEstimate {
  Tally tally;
  double error = 0;            ///< see FluxField::error
  double max_facet_error = 0;  ///< see FluxField::max_facet_error
};

/// Mean and standard error on facets, and the error over patches.
///
/// Where nothing arrived on a facet, the error is that of one particle, but no more than what
/// arrives on the largest patch that has a corner with it, with its error: less than a particle is
/// due on a sliver, which tells nothing of the flux around it.
///
/// Only parts of the surface on which a particle arrived count: no path joins a closed void to the
/// source. A patch that the cells' borders cut counts with the error that a whole one of the same
/// noise would have, so that the error does not depend on where they fall.
FluxEstimate estimate(const RayScene& scene, const Patches& patches, const FluxSpread& spread);

/// What follows from some tallies: their sum, each times its response.
///
/// Shape: responses[t][facet] belongs to spreads[t]; these have the same deviations, which belong
///        together. What is unseen is left out.
FluxSpread sum_of_responses(std::vector<FluxSpread> spreads,
                            std::span<const std::vector<float>> responses);

/// The root mean square error of what follows, over the patches that the estimate of the arrivals
/// counts, in the unit of the responses. Spreads are those of the tallies, arrivals first, and of
/// their sum.
double response_error(const RayScene& scene, const Patches& patches,
                      std::span<const FluxSpread> spreads,
                      std::span<const std::vector<float>> responses, const FluxSpread& sum);

}  // namespace scarp
