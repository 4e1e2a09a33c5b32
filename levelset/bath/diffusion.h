#pragma once

#include <span>
#include <vector>

#include "core/solute.h"
#include "core/tri_mesh.h"
#include "levelset/grid/layers.h"

namespace scarp {

/// The concentration of a solute at the surface, and where it goes.
///
/// Shape: at_facets has one entry per facet. Units: relative to saturation; amounts per time in
/// nm^3/s times the concentration of saturation. In two dimensions they are those of a slice one
/// spacing thick.
struct Concentration {
  std::vector<float> at_facets;
  double released = 0;
  double settled = 0;
  double escaped = 0;  ///< to the stirred bath; below 0 comes from there
};

/// Steady diffusion in the bath above the surface: what the facets give spreads until as much
/// settles and escapes.
///
///     div grad c = 0,  -D dc/dn = release - uptake max(0, c - 1) at the surface
///
/// c is known at the nodes of the grid that are joined to the bath above. Between neighbours D (c -
/// c') flows through what the surface leaves open of the face between them, to a side as far as the
/// surface lies: exact for walls along the axes, wherever they lie between nodes. A facet gives to,
/// and sees, the nodes next to it. Above the highest point the grid goes on for as much as the
/// domain is wide or the layer is thick; through the rest of the layer c is linear. c never goes
/// below 0 where the bath's does not.
///
/// Closed voids are left out; facets of theirs must not be in the mesh.
///
/// Shape: exchange has one entry per facet.
/// Throws: NumericalError when rounding errors keep it from a solution.
/// Cost:   memory and time of the box around the surface: 200 bytes and some tens of microseconds
///         for each node of the bath.
/// Source: finite volumes with faces cut as by Ng, Min, Gibou 2009; where it settles by turns, as
///         Howard 1960.
Concentration diffuse(const Layers& layers, const TriMesh& facets,
                      std::span<const Exchange> exchange, const Solute& solute);

}  // namespace scarp
