#pragma once

#include <vector>

#include "core/tri_mesh.h"
#include "levelset/grid/layers.h"

namespace scarp {

/// All that is of one material in the domain, as a closed surface.
struct MaterialBody {
  MaterialId material = 0;
  TriMesh surface;
};

/// The material between the surface of each layer and that of the one below, closed at the sides of
/// the domain and, for the lowest, at a plane below it: for tools that want solids.
///
/// Every edge belongs to two triangles that go through it in opposite directions, also where a
/// body touches itself along an edge: it has two vertices at one place there. Bodies of several
/// layers of one material are one mesh. Where bodies meet, their triangles are the same.
///
/// Shape:  in the order of the layers; materials absent from the wafer are left out.
/// Units:  nm, bottom as a height.
/// Throws: InputError unless the bottom lies below the surface of the lowest layer.
/// Cost:   as extract_surface of all layers, and a few times that.
std::vector<MaterialBody> material_bodies(const Layers& layers, double bottom);

/// A height for the bottom: ten spacings below the lowest point of the lowest layer.
double default_bottom(const Layers& layers);

/// The volume within a closed surface. Units: nm^3.
double enclosed_volume(const TriMesh& surface);

}  // namespace scarp
