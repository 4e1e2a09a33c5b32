#pragma once

#include <cstdint>
#include <vector>

#include "levelset/metrology/region_lattice.h"
#include "levelset/metrology/tet_cut.h"

namespace scarp {

/// The cells of a lattice next to surfaces, in pieces.
///
/// Cells are known by their lowest nodes, and these by their index in the lattice.
struct RegionCells {
  static constexpr std::uint32_t none = ~std::uint32_t{0};

  CutVertices vertices;
  std::vector<CutTet> tets;                ///< pieces of all cells that are cut
  std::vector<std::uint8_t> labels;        ///< of nodes
  std::vector<bool> is_cut;                ///< of cells
  std::vector<std::uint32_t> numbers;      ///< of nodes that are vertices; none for others
  std::vector<RegionLattice::Node> nodes;  ///< of vertices that are nodes, which come first
  std::vector<bool> is_moved;              ///< likewise: they lie on a surface

  /// Whether it lies within a region.
  bool is_inner(std::size_t node) const {
    const std::uint32_t v = numbers[node];
    return v == none || !is_moved[v];
  }
};

/// A corner that lies within a region, of a cell that is not cut: two at most were moved.
RegionLattice::Node inner_corner(const RegionLattice& lattice, const RegionCells& cells,
                                 const RegionLattice::Node& cell);

/// Cuts the cells next to surfaces into tetrahedra, and these by the surfaces, after nodes near a
/// surface have moved onto it. Nodes of faces on the sides of the domain are vertices as well.
RegionCells cut_cells(const RegionLattice& lattice);

}  // namespace scarp
