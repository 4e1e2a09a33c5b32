#include "levelset/connectivity.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "levelset/band.h"
#include "levelset/exposure.h"
#include "levelset/phase_graph.h"
#include "levelset/redistance.h"

namespace scarp {

namespace {

/// A node deeper than this, in spacings, has no neighbour across the surface.
constexpr float next_to_surface = 1.5F;

/// Part of a node's cell that lies in the domain: nodes on a reflective side have half a cell.
double cell_share(const Band& band, int axis, int index) {
  const bool on_side = index == 0 || index == band.frame().cells[axis];
  return on_side && band.frame().boundary[axis] == Boundary::reflective ? 0.5 : 1.0;
}

/// Calls visit(node of the leaf) for every node of a mask.
template <class Visit>
void for_each_node(const LeafMask& mask, const Visit& visit) {
  for (int i = 0; i < leaf_edge; ++i) {
    for (std::uint64_t word = mask[i]; word != 0; word &= word - 1) {
      visit(i * leaf_edge * leaf_edge + std::countr_zero(word));
    }
  }
}

/// Measures the regions of a graph that are closed off.
class RegionList {
 public:
  RegionList(const Band& band, Phase phase, const PhaseGraph& graph)
      : band_(band), graph_(graph), sign_(phase == Phase::gas ? 1.0F : -1.0F) {}

  std::vector<Region> run() {
    place_.assign(graph_.region_limit(), 0);
    for (std::size_t n = 0; n < band_.leaves().size(); ++n) {
      for (const LeafPiece& piece : graph_.pieces(n)) {
        if (piece.region != 0) {
          add_piece(band_.leaves()[n], piece);
        }
      }
    }
    for (int x = 0; x < band_.column_count(0); ++x) {
      for (int y = 0; y < band_.column_count(1); ++y) {
        add_gaps(x, y);
      }
    }
    return std::move(regions_);
  }

 private:
  Region& region(std::uint32_t number, const Node& node) {
    if (place_[number] == 0) {
      regions_.push_back({.first_node = node, .volume = 0, .lower = 1e300, .upper = -1e300});
      place_[number] = regions_.size();
    }
    return regions_[place_[number] - 1];
  }

  void add_piece(const Leaf& leaf, const LeafPiece& piece) {
    for_each_node(piece.nodes, [&](int n) {
      const Node node = node_at(leaf, n);
      Region& r = region(piece.region, node);
      const float here = depth(node);
      bool is_inner = true;
      for (int face = 0; here < next_to_surface && face < 6; ++face) {
        const std::optional<Node> other = neighbour(node, face);
        if (other && is_outside(*other)) {
          add_neighbour(node, *other, face, r);
          is_inner = false;
        }
      }
      r.volume += (is_inner ? cell(node) : filled_cell(node)) * cube();
    });
  }

  /// What the region fills of the cell of a neighbour that is not part of it, and its surface on
  /// the way if that is above or below.
  void add_neighbour(const Node& node, const Node& other, int face, Region& r) const {
    int sharers = 0;
    for (int back = 0; back < 6; ++back) {
      const std::optional<Node> sharer = neighbour(other, back);
      sharers += sharer && !is_outside(*sharer) ? 1 : 0;
    }
    r.volume += filled_cell(other) / sharers * cube();
    if (face / 2 == 2) {
      const double cut = crossing(depth(node), depth(other));
      const double z = (node[2] + (face % 2 == 0 ? -cut : cut)) * band_.frame().spacing;
      r.lower = std::min(r.lower, z);
      r.upper = std::max(r.upper, z);
    }
  }

  void add_gaps(int x, int y) {
    for (const Gap& gap : graph_.gaps(x, y)) {
      // What has no end below is no void.
      if (gap.region == 0 || gap.lower == Gap::no_end) {
        continue;
      }
      double share = leaf_edge * (gap.upper - gap.lower);
      for (int axis = 0; axis < 2; ++axis) {
        const int first = (axis == 0 ? x : y) * leaf_edge;
        double width = 0;
        for (int n = first; n < std::min(first + leaf_edge, band_.node_count(axis)); ++n) {
          width += cell_share(band_, axis, n);
        }
        share *= width;
      }
      region(gap.region, {x * leaf_edge, y * leaf_edge, gap.lower * leaf_edge}).volume +=
          share * cube();
    }
  }

  double cube() const {
    const double h = band_.frame().spacing;
    return h * h * h;
  }

  /// Distance into the phase, in spacings.
  float depth(const Node& node) const { return sign_ * band_.node(node[0], node[1], node[2]); }
  bool is_outside(const Node& node) const { return depth(node) < 0; }

  /// Part of a node's cell that lies in the domain.
  double cell(const Node& node) const {
    return cell_share(band_, 0, node[0]) * cell_share(band_, 1, node[1]);
  }

  /// What the phase fills of the cell of a node next to its surface, as if that were flat and along
  /// the grid.
  double filled_cell(const Node& node) const {
    return cell(node) * std::clamp(0.5 + depth(node), 0.0, 1.0);
  }

  /// A stored node, or none beyond a reflective side.
  std::optional<Node> neighbour(Node node, int face) const {
    const int axis = face / 2;
    node[axis] += face % 2 == 0 ? -1 : 1;
    if (axis == 2) {
      return node;
    }
    const bool is_stored = node[axis] >= 0 && node[axis] < band_.node_count(axis);
    if (!is_stored && band_.frame().boundary[axis] == Boundary::reflective) {
      return std::nullopt;
    }
    node[axis] = band_.fold(axis, node[axis]);
    return node;
  }

  const Band& band_;
  const PhaseGraph& graph_;
  float sign_;
  std::vector<std::size_t> place_;
  std::vector<Region> regions_;
};

bool is_next_to_solid(const Band& band, const Node& node) {
  for (int face = 0; face < 6; ++face) {
    Node other = node;
    other[face / 2] += face % 2 == 0 ? -1 : 1;
    if (band.node(other[0], other[1], other[2]) < 0) {
      return true;
    }
  }
  return false;
}

/// Makes gas of the islands, and forgets how far gas was from them.
void clear_islands(Band& band, const PhaseGraph& solid) {
  for (std::size_t n = 0; n < band.leaves().size(); ++n) {
    for (const LeafPiece& piece : solid.pieces(n)) {
      if (piece.region == 0) {
        continue;
      }
      for_each_node(piece.nodes,
                    [&](int node) { band.leaves()[n].phi[node] = LevelSet::half_width; });
    }
  }
  // All of it, so that what comes out does not depend on where leaves begin.
  for (const Leaf& leaf : band.leaves()) {
    for (int node = 0; node < leaf_size; ++node) {
      if (!(leaf.phi[node] < 0) && !is_next_to_solid(band, node_at(leaf, node))) {
        leaf.phi[node] = LevelSet::half_width;
      }
    }
  }
  band.trim();
  redistance_fully(band);
}

}  // namespace

OpenGas open_gas(const Layers& layers) {
  const Band& band = layers.top().band();
  const PhaseGraph graph(band, Phase::gas);
  OpenGas gas;
  gas.open.assign(band.leaves().size() * 8, 0);
  for (std::size_t n = 0; n < band.leaves().size(); ++n) {
    for (const LeafPiece& piece : graph.pieces(n)) {
      for (int i = 0; piece.region == 0 && i < leaf_edge; ++i) {
        gas.open[n * 8 + static_cast<std::size_t>(i)] |= piece.nodes[i];
      }
    }
  }
  if (graph.has_closed_regions()) {
    gas.voids = RegionList(band, Phase::gas, graph).run();
  }
  return gas;
}

std::vector<Region> remove_islands(Layers& layers) {
  Band& band = layers.top().band();
  const PhaseGraph graph(band, Phase::solid);
  if (!graph.has_closed_regions()) {
    return {};
  }
  std::vector<Region> islands = RegionList(band, Phase::solid, graph).run();
  clear_islands(band, graph);
  cut_lower_layers(layers);
  return islands;
}

}  // namespace scarp
