#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "flux/options.h"
#include "flux/rays/patches.h"
#include "flux/rays/ray_scene.h"
#include "flux/sampling/sampling.h"
#include "flux/species.h"

namespace scarp {

/// What all engines get: a surface, a species, and what is wanted.
struct FluxProblem {
  const TriMesh& mesh;
  const RayScene& scene;
  const Patches& patches;
  std::span<const float> sticking;  ///< one per facet
  const Species& species;
  std::uint32_t species_index = 0;  ///< part of the random number's key
  const FluxOptions& options;

  /// One per tally; none if the target is the error of the flux.
  std::span<const std::vector<float>> responses() const {
    if (options.responses.empty()) return {};
    return options.responses[species_index];
  }

  /// Particles from above and from the surface. Units: source flux times squared spacings.
  double emitted() const;
  bool has_source() const { return species.source.kind != SourceLobe::Kind::none; }

  /// How many particles come from a place on the source plane, relative to the mean.
  double source_density(Vec3d r) const {
    const SourceMap& map = species.source.map;
    return map.empty() ? 1 : map.at(r.x / scene.upper().x, r.y / scene.upper().y);
  }

  /// Of a facet; in sections that of its line.
  Vec3d normal(std::size_t facet) const { return in_section(scene.normal(facet)); }
  /// A direction, or normal, as rays that travel in a section have it.
  Vec3d in_section(Vec3d n) const { return options.is_section() ? project_to_cross_section(n) : n; }
};

/// The error of the responses to a problem's tallies, whose spreads are given by number; nothing if
/// there are no responses.
std::optional<double> response_error(const FluxProblem& problem,
                                     const std::function<FluxSpread(std::size_t tally)>& spread);

}  // namespace scarp
