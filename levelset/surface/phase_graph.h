#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "levelset/grid/band.h"

namespace scarp {

enum class Phase { gas, solid };

/// Nodes of one leaf that are joined within it, and the region they belong to.
struct LeafPiece {
  LeafMask nodes{};
  std::uint32_t region = 0;
};

/// A run of missing leaves of one column, all of the phase. Heights in leaves.
struct Gap {
  int lower = 0;  ///< no_end if it has none
  int upper = 0;
  std::uint32_t region = 0;

  static constexpr int no_end = INT32_MIN;
};

/// The regions of one phase of a band: pieces within leaves and gaps between leaves, joined where
/// they touch.
///
/// Gaps need joining only to the leaves at their ends: where gaps lie side by side, their upper
/// ends are side by side as well, or a leaf at one of them touches the column of the other.
///
/// Gas is joined between neighbours along an axis, solid across the diagonals of cell faces as
/// well: as in the extracted surface, where what is parted for one is joined for the other. Region
/// 0 is the gas of the source, or the solid of the wafer.
///
/// Cost: linear in the number of leaves, about a microsecond each.
class PhaseGraph {
 public:
  PhaseGraph(const Band& band, Phase phase);

  std::span<const LeafPiece> pieces(std::size_t leaf) const {
    return std::span(pieces_).subspan(first_[leaf], first_[leaf + 1] - first_[leaf]);
  }
  /// The gaps of a column (see Band::column), upwards.
  std::span<const Gap> gaps(int x, int y) const {
    const std::size_t c = static_cast<std::size_t>(x) * band_.column_count(1) + y;
    return std::span(gaps_).subspan(first_gap_[c], first_gap_[c + 1] - first_gap_[c]);
  }
  /// The nodes of those pieces that is_wanted(piece) holds for: 8 words per leaf, one bit per node.
  template <class IsWanted>
  std::vector<std::uint64_t> nodes_where(const IsWanted& is_wanted) const {
    std::vector<std::uint64_t> nodes((first_.size() - 1) * leaf_edge, 0);
    for (std::size_t n = 0; n + 1 < first_.size(); ++n) {
      for (const LeafPiece& piece : pieces(n)) {
        if (!is_wanted(piece)) continue;
        for (std::size_t i = 0; i < leaf_edge; ++i) nodes[n * leaf_edge + i] |= piece.nodes[i];
      }
    }
    return nodes;
  }
  /// Numbers of regions are below this; not all of them occur.
  std::size_t region_limit() const { return pieces_.size() + gaps_.size() + 1; }
  /// Anything that is not joined to region 0.
  bool has_closed_regions() const;

 private:
  class Sets;

  void find_pieces();
  void find_gaps();
  void join_all(Sets& sets) const;
  void join_faces(std::size_t leaf, int axis, Sets& sets) const;
  void join_gaps(int x, int y, Sets& sets) const;
  void join_edges(std::size_t leaf, Sets& sets) const;

  /// Where a leaf's nodes meet those of the next leaf (step = 1) or the one before (-1) along an
  /// axis: the place of that leaf, in leaves, and the local index of the touching nodes in both.
  struct Contact {
    int place = 0;
    int here = 0;
    int there = 0;
  };
  std::optional<Contact> contact(const std::array<int, 3>& place, int axis, int step) const;

  const Band& band_;
  Phase phase_;
  std::vector<LeafPiece> pieces_;
  std::vector<std::size_t> first_;
  std::vector<Gap> gaps_;
  std::vector<std::size_t> first_gap_;
};

}  // namespace scarp
