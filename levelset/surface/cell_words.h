#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "levelset/grid/band.h"

namespace scarp {

/// A leaf and the seven that its cells reach into. Beyond an upper periodic side those at the lower
/// side take their place.
struct CellLeaves {
  CellLeaves(const Band& band, std::size_t n);

  /// As Band::find gives them; bit a of the place tells the upper one along axis a.
  std::array<int, 8> leaf{};
  std::array<int, 2> nodes{};  ///< of the leaf that lie in the domain, along x and y
  std::array<int, 2> cells{};  ///< that start at nodes of the leaf, along x and y
  int wrapped = 0;             ///< bit a: the upper leaves along axis a lie at the lower side
};

/// Which nodes of a leaf's cells lie in the solid, as words: bit 8 j + k for the node (i, j, k).
///
/// An edge, a face or a cell belongs to its lowest node. What follows is found for 64 nodes at
/// once.
class CellWords {
 public:
  /// solid holds the nodes of every leaf of the band.
  CellWords(const CellLeaves& leaves, const std::vector<LeafMask>& solid);

  /// Edges along an axis with an end on each side of the surface.
  std::uint64_t cut_edges(int axis, int i) const;

  /// Faces normal to an axis with corners on both sides.
  std::uint64_t cut_faces(int normal, int i) const;

  /// Cells with corners on both sides.
  std::uint64_t cut_cells(int i) const;

  /// The corners of a cell that lie in the solid, as cell_cases wants them.
  int corners(int i, int bit) const {
    int mask = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const std::uint64_t word = words_[corner >> 1 & 3][i + (corner & 1)];
      mask |= static_cast<int>(word >> bit & 1) << corner;
    }
    return mask;
  }

 private:
  /// Rows of nodes below a count along y.
  static std::uint64_t rows(int count) { return count > 0 ? ~0ULL >> (64 - 8 * count) : 0; }

  const CellLeaves& leaves_;
  /// Of the nodes one further along y (bit 0 of the place) and z (bit 1), for i = 0..8.
  std::array<std::array<std::uint64_t, leaf_edge + 1>, 4> words_{};
};

/// Calls visit(bit) for every bit that is set, from the lowest.
template <class Visit>
inline void for_each_bit(std::uint64_t word, const Visit& visit) {
  for (; word != 0; word &= word - 1) {
    visit(std::countr_zero(word));
  }
}

}  // namespace scarp
