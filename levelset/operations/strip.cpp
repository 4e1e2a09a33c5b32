#include "levelset/operations/strip.h"

#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "levelset/grid/band.h"
#include "levelset/grid/carry.h"
#include "levelset/grid/exposure.h"
#include "levelset/operations/film_flood.h"
#include "levelset/operations/layer_sets.h"
#include "levelset/operations/thin_gaps.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/phase_graph.h"

namespace scarp {

namespace {

/// Which of the material of one layer gas reaches.
class Reached {
 public:
  Reached(const Layers& layers, std::size_t layer)
      : layers_(layers), layer_(layer), without_(top_without(layers, layer, layer)) {
    find_exposure();
    flood();
    follow_films();
    reach_under_covers();
  }

  bool any() const { return any_; }
  /// Solid where the material stays.
  LevelSet kept();

 private:
  using Bits = std::vector<LeafMask>;

  const Band& top() const { return layers_.top().band(); }
  Band& band() { return without_.band(); }
  static bool is_in(const Bits& bits, const NodePlace& at) {
    return at.is_there() &&
           (bits[static_cast<std::size_t>(at.leaf)][at.offset >> 6] >> (at.offset & 63) & 1) != 0;
  }
  static void put(Bits& bits, const NodePlace& at) {
    if (at.is_there())
      bits[static_cast<std::size_t>(at.leaf)][at.offset >> 6] |= std::uint64_t{1}
                                                                 << (at.offset & 63);
  }
  static void take_out(Bits& bits, const NodePlace& at) {
    if (at.is_there())
      bits[static_cast<std::size_t>(at.leaf)][at.offset >> 6] &=
          ~(std::uint64_t{1} << (at.offset & 63));
  }
  Bits no_bits() { return Bits(band().leaves().size(), LeafMask{}); }
  /// Calls visit(node, place in the band) for all nodes of the band in the domain.
  template <class Visit>
  void for_all_nodes(const Visit& visit);
  /// Calls visit for the six nodes around one, until it returns true.
  template <class Visit>
  static bool any_neighbour(const Node& node, const Visit& visit) {
    for (int face = 0; face < 6; ++face) {
      Node other = node;
      other[static_cast<std::size_t>(face / 2)] += face % 2 == 0 ? -1 : 1;
      if (visit(other)) return true;
    }
    return false;
  }
  bool is_of_layer(const Node& node) const {
    return top().node(node[0], node[1], node[2]) < 0 && layer_at(layers_, node) == layer_;
  }

  void find_exposure();
  void look_at_edge(const Node& node, int axis);
  void look_for_film_ends(const Node& solid, const Node& gas, int axis);
  void flood();
  void follow_films();
  void reach_under_covers();

  const Layers& layers_;
  std::size_t layer_;
  LevelSet without_;  ///< the top as if all of it were gone
  struct Edge {
    Node gas{};
    Node solid{};
  };
  struct FilmEnd {
    Edge edge{};      ///< beside the film's
    FilmEdge film{};  ///< the last one below the surface
  };
  std::vector<Edge> exposed_;  ///< edges on which the surface shows the material
  std::vector<FilmEnd> ends_;  ///< of films between two other materials, where they are exposed
  std::vector<Node> covered_;  ///< nodes of it next to gas, under a film of another material
  Bits reached_;               ///< its nodes, and those beside its surface
  Bits closed_;                ///< gas of the band that is not joined to the source
  bool any_ = false;
};

template <class Visit>
void Reached::for_all_nodes(const Visit& visit) {
  for (std::size_t n = 0; n < band().leaves().size(); ++n) {
    const Leaf& leaf = band().leaves()[n];
    for (int offset = 0; offset < leaf_size; ++offset) {
      const Node node = node_at(leaf, offset);
      if (node[0] >= band().node_count(0) || node[1] >= band().node_count(1)) continue;
      visit(node, NodePlace{static_cast<int>(n), offset});
    }
  }
}

void Reached::look_at_edge(const Node& node, int axis) {
  Node next = node;
  ++next[static_cast<std::size_t>(axis)];
  const bool is_solid = top().node(node[0], node[1], node[2]) < 0;
  if (is_solid == (top().node(next[0], next[1], next[2]) < 0)) return;
  const Edge edge{.gas = is_solid ? next : node, .solid = is_solid ? node : next};
  const std::size_t seen = exposed_layer(layers_, node, axis);
  if (seen < layer_) look_for_film_ends(edge.solid, edge.gas, axis);
  if (seen == layer_) {
    exposed_.push_back(edge);
  } else if (is_of_layer(edge.solid)) {
    covered_.push_back(edge.solid);
  }
}

// Where what lies below the film is seen, and beside it what lies on the film, the film between the
// two is seen as well, though no edge of the grid may cut the surface there.
void Reached::look_for_film_ends(const Node& solid, const Node& gas, int axis) {
  any_neighbour(solid, [&](const Node& beside) {
    const auto along = static_cast<std::size_t>(axis);
    Node above = beside;
    above[along] += gas[along] - solid[along];
    if (beside[along] != solid[along] || top().node(above[0], above[1], above[2]) < 0) return false;
    const FilmEdge film{.above = beside, .below = solid};
    if (is_film_edge(layers_, layer_, film)) {
      ends_.push_back({{gas, solid}, film});
    } else if (is_of_layer(beside)) {
      exposed_.push_back({.gas = above, .solid = beside});
    }
    return false;
  });
}

void Reached::find_exposure() {
  const Band& all = top();
  for (const Leaf& leaf : all.leaves()) {
    for (int offset = 0; offset < leaf_size; ++offset) {
      const Node node = node_at(leaf, offset);
      if (node[0] >= all.node_count(0) || node[1] >= all.node_count(1)) continue;
      for (int axis = 0; axis < 3; ++axis) {
        look_at_edge(node, axis);
        // The edge from the node below, where no leaf has it.
        Node before = node;
        --before[static_cast<std::size_t>(axis)];
        if (!all.place(before).is_there()) look_at_edge(before, axis);
      }
    }
  }
}

void Reached::flood() {
  // A film over it, thinner than a spacing, parts it from the gas.
  LevelSet parted = without_.copy();
  for (const Node& node : covered_) {
    const NodePlace at = parted.band().place(node);
    if (at.is_there())
      parted.band().leaves()[static_cast<std::size_t>(at.leaf)].phi[at.offset] = -smallest_phi;
  }
  const PhaseGraph graph(parted.band(), Phase::gas);
  reached_ = no_bits();
  closed_ = no_bits();
  Bits open = no_bits();
  for (std::size_t n = 0; n < band().leaves().size(); ++n)
    for (const LeafPiece& piece : graph.pieces(n))
      for (std::size_t i = 0; i < leaf_edge; ++i)
        (piece.region == 0 ? open : closed_)[n][i] |= piece.nodes[i];
  for_all_nodes([&](const Node& node, const NodePlace& at) {
    if (is_in(open, at) && is_of_layer(node)) put(reached_, at);
  });
  for (const Edge& edge : exposed_) {
    const NodePlace gas = band().place(edge.gas);
    // A leaf that is missing is gas of the source, or what was taken away is far from all else.
    if (gas.is_there() && !is_in(open, gas)) continue;
    any_ = true;
    put(reached_, gas);
    put(reached_, band().place(edge.solid));
  }
  std::erase_if(ends_, [&](const FilmEnd& end) {
    const NodePlace gas = band().place(end.edge.gas);
    return gas.is_there() && !is_in(open, gas);
  });
  for (const FilmEnd& end : ends_) {
    any_ = true;
    put(reached_, band().place(end.edge.gas));
  }
}

// Gas goes on through the film from what it has reached, also where no node lies in the film.
void Reached::follow_films() {
  if (!any_) return;
  FilmFlood flood(layers_.top().band(), [&](const Node& node) {
    return is_of_layer(node) && is_in(closed_, band().place(node));
  });
  for (const FilmEdge& edge : film_edges(layers_, layer_)) flood.add(edge);
  for (const FilmEnd& end : ends_) flood.reach(end.film);
  for (const Edge& edge : exposed_) {
    const NodePlace gas = band().place(edge.gas);
    if (!gas.is_there() || is_in(reached_, gas)) flood.reach_beside({edge.gas, edge.solid});
  }
  for_all_nodes([&](const Node& node, const NodePlace& at) {
    const auto is_bound = [&](const Node& other) { return !is_in(reached_, band().place(other)); };
    if (is_in(reached_, at) && is_of_layer(node) && any_neighbour(node, is_bound))
      flood.go_on_from(node);
  });
  for (const Node& node : flood.run()) {
    const NodePlace at = band().place(node);
    put(reached_, at);
    if (is_of_layer(node)) take_out(closed_, at);
  }
}

void Reached::reach_under_covers() {
  std::vector<NodePlace> found;
  for (const Node& node : covered_) {
    const NodePlace at = band().place(node);
    const bool is_reached = is_in(reached_, at) || any_neighbour(node, [&](const Node& other) {
                              return is_in(reached_, band().place(other)) && is_of_layer(other);
                            });
    if (is_reached) {
      found.push_back(at);
    } else {
      put(closed_, at);
    }
  }
  for (const NodePlace& at : found) put(reached_, at);
}

LevelSet Reached::kept() {
  std::vector<std::pair<NodePlace, float>> values;
  for_all_nodes([&](const Node& node, const NodePlace& at) {
    bool goes = false;
    for (int n = 0; n < 27 && !goes; ++n)
      goes =
          is_in(reached_,
                band().place({node[0] + n % 3 - 1, node[1] + n / 3 % 3 - 1, node[2] + n / 9 - 1}));
    goes = goes && !is_in(closed_, at);
    values.emplace_back(at, goes ? LevelSet::half_width : -LevelSet::half_width);
  });
  for (const auto& [at, value] : values)
    band().leaves()[static_cast<std::size_t>(at.leaf)].phi[at.offset] = value;
  return without_.copy();  // which knows the signs of missing leaves
}

/// Takes the material away; staying as for thin_gaps. Whether that left gaps which no node lay in.
bool strip_all(Layers& layers, MaterialId material, bool buried, const LevelSet* staying) {
  bool has_gaps = false;
  const auto take = [&](std::size_t n, const LevelSet* kept) {
    const std::vector<GapNode> gaps = thin_gaps(layers, n, kept, staying);
    has_gaps = has_gaps || !gaps.empty();
    take_away(layers, n, n, kept, gaps);
  };
  // What was taken away may have covered more of it, in another layer.
  bool goes_on = true;
  for (std::size_t pass = 0; goes_on && pass < layers.stack.size(); ++pass) {
    goes_on = false;
    for (std::size_t n = layers.stack.size(); n-- > 1;) {
      if (layers.stack[n].material != material || !adds_material(layers, n)) continue;
      if (buried) {
        take(n, nullptr);
        continue;
      }
      Reached reached(layers, n);
      if (!reached.any()) continue;
      const LevelSet kept = reached.kept();
      take(n, &kept);
      goes_on = true;
    }
  }
  return has_gaps;
}

}  // namespace

bool strip(Layers& layers, MaterialId material, bool buried, bool keep_free) {
  Layers parted = layers.copy();
  if (!strip_all(parted, material, buried, nullptr)) {
    layers = std::move(parted);
    return false;
  }
  // Only the whole tells what is held after all.
  if (!keep_free) remove_islands(parted);
  strip_all(layers, material, buried, &parted.top());
  return true;
}

}  // namespace scarp
