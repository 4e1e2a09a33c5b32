#pragma once

#include <optional>

#include "core/region_mesh.h"
#include "levelset/grid/layers.h"

namespace scarp {

struct RegionOptions {
  double bottom = 0;            ///< height at which the wafer ends
  std::optional<double> lid{};  ///< height at which the gas above ends; none: it is empty space
};

/// Films thinner than this, in spacings, are left out: their facets at the sides could not have a
/// greater altitude.
inline constexpr double thinnest_meshed_film = 0.1;

/// The interfaces between all materials, and the sides of the domain, as one conforming mesh.
///
/// The cells of the grid are cut into tetrahedra, these by the surfaces of the layers from the
/// lowest up, linearly: so films thinner than a cell stay, surfaces never cross, and what is cut
/// off fits what it is cut off from. Nodes of the grid near a surface are moved onto it before, so
/// that no piece is thin. Edges finer than a cell are cut off: RegionRemesher brings them back.
///
/// Opposite periodic sides have the same facets, but for some that lie in interfaces.
///
/// Of a section the mesh is flat and fills the regions; of one around an axis it is the half from
/// the axis on. Pieces smaller than a fifth of a cell count as what surrounds them.
///
/// Regions are materials in the order of the layers, without names; then the gas; then, if there
/// are any, closed voids. Materials of several layers are one region.
///
/// Units:  nm.
/// Throws: InputError unless the bottom lies a spacing below the surface of the lowest layer, and
///         the lid a spacing above the highest.
/// Source: the cut of tetrahedra and the moved nodes as in Labelle and Shewchuk 2007, of several
///         surfaces one after the other and on a lattice of cubes.
RegionMesh region_surface(const Layers& layers, const RegionOptions& options);

}  // namespace scarp
