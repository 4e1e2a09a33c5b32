#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/tri_mesh.h"
#include "levelset/grid/band.h"
#include "levelset/grid/layers.h"

namespace scarp {

/// A piece of gas that no path joins to the source (a void), or of solid that none joins to the
/// wafer (an island).
///
/// Volume and heights are those of its extracted surface, also where that is an edge, and with the
/// bulge of its facets. Units: nm. In two dimensions the volume is that of a slice one spacing
/// thick.
struct Region {
  /// The first of its nodes in the order of the band. A void does not move while it is closed, so
  /// this tells it from others from one time step to the next.
  std::array<int, 3> first_node{};
  double volume = 0;
  double lower = 0;  ///< height of the lowest and of the highest point of its surface
  double upper = 0;
  /// How many of them the wafer has, where the frame holds the half of it; one that the plane cuts
  /// is measured as a whole.
  int images = 1;
};

/// Which gas is joined to the source above the wafer.
///
/// Two gas nodes are joined if they are neighbours along an axis: two fronts that touch over an
/// edge of a cell separate the gas, as they do in the extracted surface. Valid until the layers
/// change.
///
/// Shape: open has 8 words per leaf of the top layer's band, one bit per node.
struct OpenGas {
  std::vector<std::uint64_t> open;
  std::vector<Region> voids{};  ///< ordered by their first node

  bool is_open(std::size_t leaf, int node) const {
    return ((open[leaf * 8 + static_cast<std::size_t>(node >> 6)] >> (node & 63)) & 1) != 0;
  }
};

/// Whether a node lies in gas that is joined to the source.
bool is_open_gas(const Band& band, const OpenGas& gas, const Node& node);

/// The gas nodes of closed voids, as OpenGas::open; nothing if there are none.
std::vector<std::uint64_t> closed_nodes(const Layers& layers, const OpenGas& gas);

/// Labels the gas of the top layer. Voids that are known from before, by their first node, keep
/// what was measured when they closed: a closed void does not move.
///
/// Cost: linear in the number of leaves of the band, and for new voids as extract_surface.
OpenGas open_gas(const Layers& layers, std::span<const Region> known = {});

/// The surfaces of closed voids, in the order in which open_gas lists them.
///
/// Cost: as extract_surface.
std::vector<TriMesh> void_surfaces(const Layers& layers, const OpenGas& gas);

/// Takes away all solid that is not joined to the wafer, of every layer, and tells what it was.
///
/// Solid is joined across the diagonals of cell faces, too, as in the extracted surface. What stays
/// keeps its surface to the last bit.
/// Cost: as open_gas, where there is no island.
std::vector<Region> remove_islands(Layers& layers);

}  // namespace scarp
