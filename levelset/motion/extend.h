#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/tri_mesh.h"
#include "levelset/grid/layers.h"
#include "levelset/motion/extension.h"
#include "levelset/motion/speed_field.h"
#include "levelset/surface/connectivity.h"

namespace scarp {

/// How far simplified facets are taken to be from the surface where nothing else is known.
/// Spacings.
inline constexpr double close_facets = 0.5;

/// Speeds at the three corners of every facet. Units: nm/s.
using CornerSpeeds = std::vector<std::array<float, 3>>;

/// How one layer would move if it were seen.
struct LayerSpeeds {
  CornerSpeeds speed;  ///< at the facets' own normals
  /// What speed consists of: the part that does not depend on the normal, then the amplitude of
  /// every factor. Empty where there are no factors.
  std::vector<CornerSpeeds> parts{};
};

/// Carries speeds from the facets of a mesh to the nodes of the band.
///
/// A node next to the surface takes the speed at the closest point of the facets, linear between
/// the corners of its facet; facets that face the other way (the far side of a thin wall) do not
/// count. At an edge it takes that of the side that leads, or the mean of the sides that face it
/// alike (facet_shares.h). From there speeds are constant along the normals. Nodes of closed voids,
/// and solid whose nearest surface is not in the mesh, have speed 0.
///
/// Every node takes the speed of the layer that is seen at the surface nearest to it; with factors
/// it gets the amplitudes of that layer. Where the surface passes from layer to layer within dt,
/// the speed is the mean over dt, and amplitudes are scaled: a film much thinner than a spacing
/// delays an etch by the right time. Layers whose speeds are all 0 lose nothing. A film beside a
/// wall that stays where it is has one speed, without a normal (contact_line.h).
///
/// The facets may be simplified, as long as they stay within distance of the surface, and may be
/// those of some time before. Speeds do not depend on what facets keeps; it spares most queries of
/// all calls but the first.
///
/// Shape:  speeds_of_layers[k] is how the facets would move if layer k were seen there; its parts
///         have one entry more than factors.
/// Units:  dt in s, advect must be called with the same; distance in nm.
/// Cost:   a closest-point query per node next to the surface, about half a microsecond each.
SpeedField extend_speeds(const Layers& layers, const OpenGas& gas, FacetTree& facets,
                         std::span<const LayerSpeeds> speeds_of_layers,
                         std::span<const AngularFactor> factors, double dt, double distance);

/// The time in which the fastest layer moves by cfl spacings, of those layers that are seen or lie
/// within two spacings below the surface. Speeds that depend on the normal have kinks, which may
/// run faster than the surface moves. Units: s.
double stable_time_step(const Layers& layers, std::span<const LayerSpeeds> speeds_of_layers,
                        std::span<const AngularFactor> factors, double cfl);

}  // namespace scarp
