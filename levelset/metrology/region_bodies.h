#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "core/disjoint_sets.h"
#include "core/region_mesh.h"
#include "levelset/metrology/region_cells.h"

namespace scarp {

/// A face of one of the tetrahedra.
struct TetFace {
  std::array<std::uint32_t, 3> sorted{};
  std::uint32_t tet = 0;
  std::uint32_t number = 0;  ///< of the vertex that lies opposite

  bool is_same(const TetFace& other) const { return sorted == other.sorted; }
};

/// Counter-clockwise seen from outside.
std::array<std::uint32_t, 3> corners_of(const CutTet& tet, const TetFace& face);

/// What of the pieces of cells is connected.
struct RegionBodies {
  /// In the order of their vertices: of a face between two tetrahedra the lower one's comes first,
  /// then the other one's.
  std::vector<TetFace> faces;
  std::vector<RegionMesh::Body> bodies;
  std::vector<MeshRegion> regions;
  std::vector<int> of_tets;
  std::vector<int> of_nodes;  ///< of the lattice, within regions; nothing for others
};

/// Pieces that share a face and a material are one body; so are a node within a material and all
/// that it is a corner of. Bodies smaller than a fifth of a cell become part of what surrounds
/// them: the labels of their tetrahedra change.
RegionBodies find_bodies(const RegionLattice& lattice, RegionCells& cells, bool has_lid);

}  // namespace scarp
