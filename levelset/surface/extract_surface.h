#pragma once

#include "core/tri_mesh.h"
#include "levelset/grid/layers.h"
#include "levelset/surface/connectivity.h"

namespace scarp {

class PhaseGraph;

/// The surface of the top layer as triangles, by marching cubes.
///
/// Vertices are shared and in a fixed order. Every boundary edge lies exactly on a domain side, no
/// edge is non-manifold, triangles are counter-clockwise seen from the gas and none has zero area.
/// On periodic sides the vertices of one side are those of the other, shifted. Solid that touches
/// over an edge of a cell is joined, gas is not (see open_gas). What is closed comes after the open
/// surface and stays as it was when it closed (closed_gas.h).
///
/// Shape:  materials has one entry per triangle, from the stack.
/// Units:  nm.
/// Cost:   linear in the area.
/// Source: Lorensen and Cline 1987; the cases are derived, not tabulated (cell_cases.cpp).
TriMesh extract_surface(const Layers& layers);

/// The same without the surfaces of closed voids: what gas from the source can reach.
TriMesh extract_surface(const Layers& layers, const OpenGas& gas);

/// The surfaces of closed voids alone. gas: the graph of the top layer's band.
TriMesh extract_voids(const Layers& layers, const PhaseGraph& gas);

/// The surface of what lies up to a layer, without materials. What is thinner than a spacing
/// between a layer that covers it and the gas is as thick as the top layer says.
TriMesh extract_surface(const Layers& layers, std::size_t layer);

/// The surface of a single level set, without materials.
TriMesh extract_surface(const LevelSet& phi);

}  // namespace scarp
