#pragma once

#include <array>
#include <span>

#include "core/tri_mesh.h"
#include "levelset/connectivity.h"
#include "levelset/layers.h"
#include "levelset/speed_field.h"

namespace scarp {

/// Carries speeds from the facets of a mesh to the nodes of the band.
///
/// A node next to the surface takes the speed at the closest point of the facets, linear between
/// the corners of its facet; facets that face the other way (the far side of a thin wall) do not
/// count. From there speeds are constant along the normals. Nodes of closed voids, and solid whose
/// nearest surface is not in the mesh, have speed 0.
///
/// Shape:  corner_speeds has the speeds at the three corners of every facet; facets may be
///         simplified, as long as they stay within half a spacing of the surface.
/// Units:  nm/s.
/// Cost:   a closest-point query per node with |phi| < 1.5.
SpeedField extend_speeds(const Layers& layers, const OpenGas& gas, const TriMesh& facets,
                         std::span<const std::array<float, 3>> corner_speeds);

}  // namespace scarp
