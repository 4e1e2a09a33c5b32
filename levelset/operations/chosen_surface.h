#pragma once

#include <span>

#include "core/tri_mesh.h"
#include "levelset/grid/layers.h"
#include "levelset/surface/connectivity.h"

namespace scarp {

/// What gas from the source can reach of some materials: the extracted surface, cut off where
/// another material begins.
///
/// A facet has one material, so a border runs along facets, up to a spacing away from where it is.
/// Here facets near a border are cut along it, by the distance to the layers a little below the
/// surface, which knows from both sides where another body begins.
///
/// Shape: triangles do not share vertices; without materials.
/// Error: borders to a tenth of a spacing; to 1.25 spacings at the edges of films thinner than a
///        spacing and a half.
TriMesh chosen_surface(const Layers& layers, const OpenGas& gas,
                       std::span<const MaterialId> materials);

}  // namespace scarp
