#include "levelset/connectivity.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "core/parallel.h"
#include "levelset/band.h"

namespace scarp {

namespace {

/// Disjoint sets; the root of a set is its smallest member, so results do not depend on the order
/// of unions.
class Sets {
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

/// Pieces of gas inside one leaf: a label per node, 0 for solid and for nodes beyond the domain.
struct LeafPieces {
  std::array<std::uint16_t, leaf_size> label{};
  std::uint16_t count = 0;
};

LeafPieces pieces_of(const Leaf& leaf, int i_count, int j_count) {
  LeafPieces pieces;
  std::array<std::int16_t, leaf_size> stack;
  const auto is_new = [&](int i, int j, int k) {
    const bool inside = i >= 0 && i < i_count && j >= 0 && j < j_count && k >= 0 && k < leaf_edge;
    return inside && pieces.label[leaf_offset(i, j, k)] == 0 &&
           !(leaf.phi[leaf_offset(i, j, k)] < 0);
  };
  for (int seed = 0; seed < leaf_size; ++seed) {
    if (!is_new(seed >> 6, (seed >> 3) & 7, seed & 7)) {
      continue;
    }
    const std::uint16_t label = ++pieces.count;
    int depth = 0;
    const auto push = [&](int i, int j, int k) {
      if (is_new(i, j, k)) {
        pieces.label[leaf_offset(i, j, k)] = label;
        stack[depth++] = static_cast<std::int16_t>(leaf_offset(i, j, k));
      }
    };
    push(seed >> 6, (seed >> 3) & 7, seed & 7);
    while (depth > 0) {
      const int node = stack[--depth];
      const int i = node >> 6;
      const int j = (node >> 3) & 7;
      const int k = node & 7;
      push(i - 1, j, k);
      push(i + 1, j, k);
      push(i, j - 1, k);
      push(i, j + 1, k);
      push(i, j, k - 1);
      push(i, j, k + 1);
    }
  }
  return pieces;
}

/// A run of missing leaves in a column, all gas. Heights in leaves.
struct Gap {
  int lower = 0;
  int upper = 0;
  std::uint32_t set = 0;
};

constexpr int far_below = std::numeric_limits<int>::min();
constexpr int far_above = std::numeric_limits<int>::max();

/// The gas of a band as pieces inside leaves and gaps between leaves, and which of them touch.
class GasGraph {
 public:
  explicit GasGraph(const Band& band)
      : band_(band), pieces_(band.leaves().size()), first_set_(band.leaves().size()) {
    parallel_for(pieces_.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        const Leaf& leaf = band.leaves()[n];
        pieces_[n] = pieces_of(leaf, std::min(leaf_edge, band.node_count(0) - leaf.origin[0]),
                               std::min(leaf_edge, band.node_count(1) - leaf.origin[1]));
      }
    });
    // Set 0 is the source.
    std::uint32_t sets = 1;
    for (std::size_t n = 0; n < pieces_.size(); ++n) {
      first_set_[n] = sets;
      sets += pieces_[n].count;
    }
    find_gaps(sets);
  }

  std::size_t set_count() const { return set_count_; }

  std::uint32_t set(std::size_t leaf, int node) const {
    return first_set_[leaf] + pieces_[leaf].label[node] - 1;
  }
  bool is_gas(std::size_t leaf, int node) const { return pieces_[leaf].label[node] != 0; }

  const std::vector<std::vector<Gap>>& gaps() const { return gaps_; }

  void join(Sets& sets) const {
    for (int x = 0; x < band_.column_count(0); ++x) {
      for (int y = 0; y < band_.column_count(1); ++y) {
        join_column(x, y, sets);
        for (int axis = 0; axis < 2; ++axis) {
          join_side(x, y, axis, sets);
        }
      }
    }
  }

 private:
  std::size_t column_index(int x, int y) const {
    return static_cast<std::size_t>(x) * band_.column_count(1) + y;
  }

  void find_gaps(std::uint32_t sets) {
    gaps_.resize(column_index(band_.column_count(0), 0));
    for (int x = 0; x < band_.column_count(0); ++x) {
      for (int y = 0; y < band_.column_count(1); ++y) {
        auto& gaps = gaps_[column_index(x, y)];
        const auto [begin, end] = band_.column(x, y);
        int below = far_below;
        for (std::size_t n = begin; n < end; ++n) {
          const Leaf& leaf = band_.leaves()[n];
          const int z = leaf.origin[2] >> 3;
          if ((below == far_below || below < z) && !(leaf.phi[0] < 0)) {
            gaps.push_back({below, z, sets++});
          }
          below = z + 1;
        }
        gaps.push_back({below, far_above, 0});
      }
    }
    set_count_ = sets;
  }

  /// Joins what touches across one face of a leaf with a neighbour (a leaf or a missing one).
  void join_face(std::size_t leaf, int axis, int node_index, int other_leaf, int other_index,
                 std::uint32_t other_set, Sets& sets) const {
    for (int a = 0; a < leaf_edge; ++a) {
      for (int b = 0; b < leaf_edge; ++b) {
        std::array<int, 3> node{};
        node[axis] = node_index;
        node[(axis + 1) % 3] = a;
        node[(axis + 2) % 3] = b;
        const int here = leaf_offset(node[0], node[1], node[2]);
        if (!is_gas(leaf, here)) {
          continue;
        }
        if (other_leaf < 0) {
          sets.unite(set(leaf, here), other_set);
          continue;
        }
        node[axis] = other_index;
        const int there = leaf_offset(node[0], node[1], node[2]);
        if (is_gas(static_cast<std::size_t>(other_leaf), there)) {
          sets.unite(set(leaf, here), set(static_cast<std::size_t>(other_leaf), there));
        }
      }
    }
  }

  /// The gap of a column that holds height z (in leaves), or none.
  const Gap* gap_at(int x, int y, int z) const {
    for (const Gap& gap : gaps_[column_index(x, y)]) {
      if (gap.lower <= z && z < gap.upper) {
        return &gap;
      }
    }
    return nullptr;
  }

  void join_column(int x, int y, Sets& sets) const {
    const auto [begin, end] = band_.column(x, y);
    for (std::size_t n = begin; n < end; ++n) {
      const int z = band_.leaves()[n].origin[2] >> 3;
      for (const int step : {-1, 1}) {
        const int next = band_.neighbours(n)[step < 0 ? 4 : 5];
        const Gap* gap = next < 0 ? gap_at(x, y, z + step) : nullptr;
        if (next >= 0 || gap != nullptr) {
          join_face(n, 2, step < 0 ? 0 : 7, next, step < 0 ? 7 : 0, gap ? gap->set : 0, sets);
        }
      }
    }
  }

  /// Joins a column with the next one along a lateral axis; the last one wraps if periodic.
  void join_side(int x, int y, int axis, Sets& sets) const {
    const std::array<int, 2> here{x, y};
    const int last_node = std::min(here[axis] * leaf_edge + 7, band_.node_count(axis) - 1);
    const int next_node = band_.fold(axis, last_node + 1);
    const bool wraps = next_node <= last_node;
    if (wraps && band_.frame().boundary[axis] == Boundary::reflective) {
      return;
    }
    std::array<int, 2> there = here;
    there[axis] = next_node >> 3;

    const auto [begin, end] = band_.column(x, y);
    for (std::size_t n = begin; n < end; ++n) {
      const int z = band_.leaves()[n].origin[2] >> 3;
      const int next = band_.find(there[0], there[1], z);
      const Gap* gap = next < 0 ? gap_at(there[0], there[1], z) : nullptr;
      if (next >= 0 || gap != nullptr) {
        join_face(n, axis, last_node & 7, next, next_node & 7, gap ? gap->set : 0, sets);
      }
    }
    const auto [other_begin, other_end] = band_.column(there[0], there[1]);
    for (std::size_t n = other_begin; n < other_end; ++n) {
      const int z = band_.leaves()[n].origin[2] >> 3;
      const Gap* gap = gap_at(x, y, z);
      if (gap != nullptr) {
        join_face(n, axis, next_node & 7, -1, 0, gap->set, sets);
      }
    }
    for (const Gap& a : gaps_[column_index(x, y)]) {
      for (const Gap& b : gaps_[column_index(there[0], there[1])]) {
        if (std::max(a.lower, b.lower) < std::min(a.upper, b.upper)) {
          sets.unite(a.set, b.set);
        }
      }
    }
  }

  const Band& band_;
  std::vector<LeafPieces> pieces_;
  std::vector<std::uint32_t> first_set_;
  std::vector<std::vector<Gap>> gaps_;
  std::size_t set_count_ = 0;
};

/// Nodes of every closed set, with their heights.
class VoidList {
 public:
  VoidList(const Frame& frame, std::size_t set_count) : frame_(frame), index_(set_count, 0) {}

  void add(std::uint32_t root, double nodes, int lower, int upper) {
    if (index_[root] == 0) {
      voids_.push_back({.volume = 0, .lower = 1e300, .upper = -1e300});
      index_[root] = voids_.size();
    }
    Void& v = voids_[index_[root] - 1];
    v.volume += nodes * frame_.spacing * frame_.spacing * frame_.spacing;
    v.lower = std::min(v.lower, lower * frame_.spacing);
    v.upper = std::max(v.upper, upper * frame_.spacing);
  }

  std::vector<Void> take() { return std::move(voids_); }

 private:
  const Frame& frame_;
  std::vector<std::size_t> index_;
  std::vector<Void> voids_;
};

/// Part of a node's cell that lies in the domain: nodes on a reflective side have half a cell.
double cell_share(const Band& band, int axis, int index) {
  const bool on_side = index == 0 || index == band.frame().cells[axis];
  return on_side && band.frame().boundary[axis] == Boundary::reflective ? 0.5 : 1.0;
}

std::vector<Void> list_voids(const Band& band, const GasGraph& graph, Sets& sets) {
  VoidList list(band.frame(), graph.set_count());
  for (std::size_t n = 0; n < band.leaves().size(); ++n) {
    const auto [i0, j0, k0] = band.leaves()[n].origin;
    for (int node = 0; node < leaf_size; ++node) {
      if (graph.is_gas(n, node) && sets.root(graph.set(n, node)) != 0) {
        const double share =
            cell_share(band, 0, i0 + (node >> 6)) * cell_share(band, 1, j0 + ((node >> 3) & 7));
        const int k = k0 + (node & 7);
        list.add(sets.root(graph.set(n, node)), share, k, k);
      }
    }
  }
  const auto share_of_column = [&](int axis, int c) {
    double share = 0;
    for (int i = c * leaf_edge; i < std::min((c + 1) * leaf_edge, band.node_count(axis)); ++i) {
      share += cell_share(band, axis, i);
    }
    return share;
  };
  for (std::size_t c = 0; c < graph.gaps().size(); ++c) {
    for (const Gap& gap : graph.gaps()[c]) {
      if (sets.root(gap.set) != 0 && gap.lower != far_below) {
        const auto y_count = static_cast<std::size_t>(band.column_count(1));
        const double share = share_of_column(0, static_cast<int>(c / y_count)) *
                             share_of_column(1, static_cast<int>(c % y_count));
        list.add(sets.root(gap.set), share * leaf_edge * (gap.upper - gap.lower),
                 gap.lower * leaf_edge, gap.upper * leaf_edge - 1);
      }
    }
  }
  return list.take();
}

}  // namespace

OpenGas open_gas(const Layers& layers) {
  const Band& band = layers.top().band();
  const GasGraph graph(band);
  Sets sets(graph.set_count());
  graph.join(sets);

  OpenGas gas;
  gas.open.assign(band.leaves().size() * 8, 0);
  for (std::size_t n = 0; n < band.leaves().size(); ++n) {
    for (int node = 0; node < leaf_size; ++node) {
      if (graph.is_gas(n, node) && sets.root(graph.set(n, node)) == 0) {
        gas.open[n * 8 + static_cast<std::size_t>(node >> 6)] |= std::uint64_t{1} << (node & 63);
      }
    }
  }
  gas.voids = list_voids(band, graph, sets);
  return gas;
}

}  // namespace scarp
