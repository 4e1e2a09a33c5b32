#pragma once

#include <span>
#include <vector>

#include "core/tri_mesh.h"
#include "core/triangle_tree.h"
#include "levelset/motion/extend.h"

namespace scarp {

/// How the speeds of one layer change while the surface moves.
///
/// Shape: one entry per facet. Units: 1/s, relative to the size of the speed there.
struct LayerChange {
  std::vector<float> of_speed;
  std::vector<std::vector<float>> of_parts{};  ///< see LayerSpeeds::parts
};

/// How the speeds of a surface change while it moves, as far as those a time step ago tell.
///
/// Every facet is compared with the place that was closest to it then and faced the same way; where
/// there is none nothing is known, and nothing changes. Changes are those of means over patches
/// about 4 spacings wide that pass smoothly into each other: noise of the flux is hardly taken for
/// a change, and what it brings here and there adds up to no bias.
struct SpeedChange {
  std::vector<LayerChange> of_layers;  ///< as Survey::speeds_of_layers
  /// Of the layers that are seen: of the changes of patches the root of the mean square, weighted
  /// by the square itself, since what changes counts and not its neighbourhood. Units: nm/s^2.
  double typical = 0;
};

/// Speeds on a mesh.
struct SurfaceSpeeds {
  const TriMesh& facets;
  std::span<const LayerSpeeds> of_layers;
};

/// Where speeds depend on the normal by known factors they are compared at the normal of now.
///
/// tree_before: of the earlier facets.
/// Shape: of the two surfaces as many layers; layer_of_facet, one per facet of the later one.
/// Units: dt, the time between them, in s; spacing in nm.
/// Cost:  a closest-point query per facet, about a microsecond.
SpeedChange speed_change(const SurfaceSpeeds& before, const TriangleTree& tree_before,
                         const SurfaceSpeeds& now, std::span<const std::size_t> layer_of_facet,
                         std::span<const AngularFactor> factors, double dt, double spacing);

/// The speeds some time later, if they go on changing as they did; none turns round, nor more than
/// doubles.
///
/// With speeds of the middle of a time step a surface moves to second order in it.
/// Source: Bashforth and Adams 1883. Units: s.
std::vector<LayerSpeeds> changed_speeds(std::span<const LayerSpeeds> speeds,
                                        const SpeedChange& change, double time);

}  // namespace scarp
