#include "levelset/surface/phase_graph.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "core/parallel.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 16;
constexpr int far_above = std::numeric_limits<int>::max();

// A plane of 8 x 8 nodes is a word; rows are its bytes.
constexpr std::uint64_t first_of_rows = 0x0101010101010101U;
constexpr std::uint64_t last_of_rows = 0x8080808080808080U;

std::uint64_t along_rows(std::uint64_t plane) {
  return plane | ((plane & ~last_of_rows) << 1) | ((plane & ~first_of_rows) >> 1);
}

std::uint64_t across_rows(std::uint64_t plane) { return plane | (plane << 8) | (plane >> 8); }

/// With the neighbours along both axes of the plane.
std::uint64_t with_neighbours(std::uint64_t plane) {
  return along_rows(plane) | across_rows(plane);
}

/// The node at the given place of every row, as the bits of a byte in some fixed order.
std::uint64_t column_of_rows(std::uint64_t plane, int place) {
  return (((plane >> place) & first_of_rows) * 0x0102040810204080U) >> 56;
}

/// With all nodes of the leaf that are joined to a node of the mask if they are of its phase.
LeafMask grown(const LeafMask& mask, Phase phase) {
  LeafMask result;
  for (int i = 0; i < leaf_edge; ++i) {
    const std::uint64_t beside = (i > 0 ? mask[i - 1] : 0) | (i + 1 < leaf_edge ? mask[i + 1] : 0);
    result[i] = phase == Phase::gas ? with_neighbours(mask[i]) | beside
                                    : along_rows(across_rows(mask[i])) | with_neighbours(beside);
  }
  return result;
}

/// The nodes of the phase that lie in the domain.
LeafMask nodes_of(const Leaf& leaf, Phase phase, int i_count, int j_count) {
  LeafMask mask{};
  for (int i = 0; i < std::min(i_count, leaf_edge); ++i) {
    std::uint64_t solid = 0;
    for (int jk = 0; jk < leaf_edge * leaf_edge; ++jk) {
      solid |= std::uint64_t{leaf.phi[i * leaf_edge * leaf_edge + jk] < 0} << jk;
    }
    const std::uint64_t inside =
        j_count >= leaf_edge ? ~std::uint64_t{0} : (std::uint64_t{1} << (8 * j_count)) - 1;
    mask[i] = (phase == Phase::solid ? solid : ~solid) & inside;
  }
  return mask;
}

LeafMask seed_of(const LeafMask& mask) {
  LeafMask seed{};
  const auto word = std::find_if(mask.begin(), mask.end(), [](std::uint64_t w) { return w != 0; });
  if (word != mask.end()) {
    seed[static_cast<std::size_t>(word - mask.begin())] = *word & (~*word + 1);
  }
  return seed;
}

void add_pieces(LeafMask rest, Phase phase, std::vector<LeafPiece>& pieces) {
  for (LeafMask piece = seed_of(rest); piece != LeafMask{}; piece = seed_of(rest)) {
    for (LeafMask last{}; piece != last;) {
      last = piece;
      piece = grown(piece, phase);
      for (int i = 0; i < leaf_edge; ++i) piece[i] &= rest[i];
    }
    for (int i = 0; i < leaf_edge; ++i) rest[i] &= ~piece[i];
    pieces.push_back({.nodes = piece});
  }
}

/// The plane of nodes with the given index along an axis; rows along the higher of the other axes.
std::uint64_t plane_of(const LeafMask& mask, int axis, int index) {
  if (axis == 0) {
    return mask[index];
  }
  std::uint64_t plane = 0;
  for (int i = 0; i < leaf_edge; ++i) {
    const std::uint64_t row =
        axis == 1 ? (mask[i] >> (8 * index)) & 0xff : column_of_rows(mask[i], index);
    plane |= row << (8 * i);
  }
  return plane;
}

/// The line of nodes with the given indices along two axes, the first one lower.
std::uint64_t line_of(const LeafMask& mask, const std::array<int, 2>& axes,
                      const std::array<int, 2>& index) {
  const std::uint64_t plane = plane_of(mask, axes[0], index[0]);
  const bool is_row = axes[1] == (axes[0] == 0 ? 1 : 0);
  return is_row ? (plane >> (8 * index[1])) & 0xff : column_of_rows(plane, index[1]);
}

}  // namespace

/// Disjoint sets; the root of a set is its smallest member, so results do not depend on the order
/// of unions.
class PhaseGraph::Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  std::uint32_t root(std::uint32_t member) {
    while (parent_[member] != member) {
      parent_[member] = parent_[parent_[member]];
      member = parent_[member];
    }
    return member;
  }

  void unite(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

PhaseGraph::PhaseGraph(const Band& band, Phase phase) : band_(band), phase_(phase) {
  find_pieces();
  find_gaps();
  Sets sets(region_limit());
  join_all(sets);
  for (LeafPiece& piece : pieces_) piece.region = sets.root(piece.region);
  for (Gap& gap : gaps_) gap.region = sets.root(gap.region);
}

bool PhaseGraph::has_closed_regions() const {
  const auto is_closed = [](const auto& part) { return part.region != 0; };
  return std::any_of(pieces_.begin(), pieces_.end(), is_closed) ||
         std::any_of(gaps_.begin(), gaps_.end(), is_closed);
}

void PhaseGraph::find_pieces() {
  const std::span<const Leaf> leaves = band_.leaves();
  std::vector<std::vector<LeafPiece>> found((leaves.size() + grain - 1) / grain);
  first_.assign(leaves.size() + 1, 0);
  parallel_for(leaves.size(), grain, [&](std::size_t begin, std::size_t end) {
    std::vector<LeafPiece>& pieces = found[begin / grain];
    for (std::size_t n = begin; n < end; ++n) {
      const std::size_t before = pieces.size();
      add_pieces(nodes_of(leaves[n], phase_, band_.node_count(0) - leaves[n].origin[0],
                          band_.node_count(1) - leaves[n].origin[1]),
                 phase_, pieces);
      first_[n + 1] = pieces.size() - before;
    }
  });
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  for (const auto& some : found) pieces_.insert(pieces_.end(), some.begin(), some.end());
  // Region 0 is kept for the source or the wafer.
  for (std::size_t n = 0; n < pieces_.size(); ++n) {
    pieces_[n].region = static_cast<std::uint32_t>(n + 1);
  }
}

void PhaseGraph::find_gaps() {
  const auto add = [&](int lower, int upper, bool is_main) {
    const std::size_t set = pieces_.size() + gaps_.size() + 1;
    gaps_.push_back({lower, upper, is_main ? 0 : static_cast<std::uint32_t>(set)});
  };
  for (int x = 0; x < band_.column_count(0); ++x) {
    for (int y = 0; y < band_.column_count(1); ++y) {
      first_gap_.push_back(gaps_.size());
      const auto [begin, end] = band_.column(x, y);
      int below = Gap::no_end;
      for (std::size_t n = begin; n < end; ++n) {
        const Leaf& leaf = band_.leaves()[n];
        const int z = leaf.origin[2] >> 3;
        const bool is_solid = leaf.phi[0] < 0;
        if ((below == Gap::no_end || below < z) && is_solid == (phase_ == Phase::solid)) {
          add(below, z, below == Gap::no_end && is_solid);
        }
        below = z + 1;
      }
      if (phase_ == Phase::gas) {
        add(below, far_above, true);
      }
    }
  }
  first_gap_.push_back(gaps_.size());
}

void PhaseGraph::join_all(Sets& sets) const {
  for (std::size_t n = 0; n < band_.leaves().size(); ++n) {
    for (int axis = 0; axis < 3; ++axis) {
      join_faces(n, axis, sets);
    }
    if (phase_ == Phase::solid) {
      join_edges(n, sets);
    }
  }
  for (int x = 0; x < band_.column_count(0); ++x) {
    for (int y = 0; y < band_.column_count(1); ++y) {
      join_gaps(x, y, sets);
    }
  }
}

std::optional<PhaseGraph::Contact> PhaseGraph::contact(const std::array<int, 3>& place, int axis,
                                                       int step) const {
  if (axis == 2) {
    return Contact{place[2] + step, step < 0 ? 0 : 7, step < 0 ? 7 : 0};
  }
  const int last = std::min(place[axis] * leaf_edge + 7, band_.node_count(axis) - 1);
  const int here = step < 0 ? place[axis] * leaf_edge : last;
  const int next = here + step;
  const bool is_beyond = next < 0 || next >= band_.node_count(axis);
  // The mirror images of joined nodes are joined anyway.
  if (is_beyond && band_.frame().boundary[axis] == Boundary::reflective) {
    return std::nullopt;
  }
  const int there = band_.fold(axis, next);
  return Contact{there >> 3, here & 7, there & 7};
}

namespace {

std::array<int, 3> place_of(const Leaf& leaf) {
  return {leaf.origin[0] >> 3, leaf.origin[1] >> 3, leaf.origin[2] >> 3};
}

}  // namespace

/// With the next leaf along an axis.
void PhaseGraph::join_faces(std::size_t leaf, int axis, Sets& sets) const {
  std::array<int, 3> place = place_of(band_.leaves()[leaf]);
  const auto next = contact(place, axis, 1);
  if (!next) {
    return;
  }
  place[axis] = next->place;
  const int other = band_.find(place[0], place[1], place[2]);
  if (other < 0) {
    return;
  }
  for (const LeafPiece& a : pieces(leaf)) {
    const std::uint64_t plane = plane_of(a.nodes, axis, next->here);
    const std::uint64_t touched = phase_ == Phase::solid ? with_neighbours(plane) : plane;
    for (const LeafPiece& b : pieces(static_cast<std::size_t>(other))) {
      if ((touched & plane_of(b.nodes, axis, next->there)) != 0) {
        sets.unite(a.region, b.region);
      }
    }
  }
}

/// The gaps of a column with the leaves at their ends.
void PhaseGraph::join_gaps(int x, int y, Sets& sets) const {
  for (const Gap& gap : gaps(x, y)) {
    const auto join = [&](int z, int touching) {
      for (const LeafPiece& piece : pieces(static_cast<std::size_t>(band_.find(x, y, z))))
        if (plane_of(piece.nodes, 2, touching) != 0) sets.unite(piece.region, gap.region);
    };
    if (gap.lower != Gap::no_end) join(gap.lower - 1, leaf_edge - 1);
    if (gap.upper != far_above) join(gap.upper, 0);
  }
}

/// With the leaves across the edges of a leaf, where only diagonals of faces join. Gaps lie deep in
/// the solid: what touches one across an edge touches it or another across a face.
void PhaseGraph::join_edges(std::size_t leaf, Sets& sets) const {
  constexpr std::array<std::array<int, 2>, 3> planes{{{0, 1}, {0, 2}, {1, 2}}};
  const std::array<int, 3> here = place_of(band_.leaves()[leaf]);
  for (const std::array<int, 2>& axes : planes) {
    for (const int step : {-1, 1}) {
      const auto first = contact(here, axes[0], 1);
      const auto second = contact(here, axes[1], step);
      if (!first || !second) {
        continue;
      }
      std::array<int, 3> there = here;
      there[axes[0]] = first->place;
      there[axes[1]] = second->place;
      const int other = band_.find(there[0], there[1], there[2]);
      if (other < 0) {
        continue;
      }
      const auto touch = [&](const LeafPiece& a, const LeafPiece& b) {
        return (line_of(a.nodes, axes, {first->here, second->here}) &
                line_of(b.nodes, axes, {first->there, second->there})) != 0;
      };
      for (const LeafPiece& a : pieces(leaf)) {
        for (const LeafPiece& b : pieces(static_cast<std::size_t>(other))) {
          if (touch(a, b)) sets.unite(a.region, b.region);
        }
      }
    }
  }
}

}  // namespace scarp
