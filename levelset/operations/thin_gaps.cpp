#include "levelset/operations/thin_gaps.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "levelset/grid/exposure.h"

namespace scarp {

namespace {

/// A film thinner than this, in spacings, leaves no gap: it may be no more than rounding.
constexpr float least_gap = 0.01F;

float phi_at(const LevelSet& level_set, const Node& node) {
  return level_set.node(node[0], node[1], node[2]);
}

Node moved(Node node, int axis, int step) {
  node[static_cast<std::size_t>(axis)] += step;
  return node;
}

Node folded(const Band& band, const Node& node) {
  return {band.fold(0, node[0]), band.fold(1, node[1]), node[2]};
}

/// Calls visit for the six nodes around one, until it returns true.
template <class Visit>
bool any_beside(const Node& node, const Visit& visit) {
  for (int face = 0; face < 6; ++face)
    if (visit(moved(node, face / 2, face % 2 == 0 ? -1 : 1))) return true;
  return false;
}

/// Looks for the nodes that lie on a film beside what lies below it.
class GapFinder {
 public:
  GapFinder(const Layers& layers, std::size_t layer, const LevelSet* kept)
      : top_(layers.top()),
        last_(layers.stack[layer].phi),
        below_(layers.stack[layer - 1].phi),
        kept_(kept) {}

  std::vector<Node> run() {
    find(&GapFinder::is_parted_along_an_axis);
    for (const Node& node : found_) gaps_.insert(node);
    // Across the diagonals of cell faces solid is joined as well, where the other two are gas.
    find(&GapFinder::is_parted_across_a_face);
    return std::move(found_);
  }

  /// Nodes of the film with both what lies on it and what lies below it beside them.
  std::vector<Node> squeezed() const {
    std::vector<Node> found;
    for_nodes_near([&](const Node& node, float last) {
      if (!(last < 0) || !(phi_at(below_, node) > 0) || !goes(node)) return;
      if (any_beside(node, [&](const Node& other) { return phi_at(below_, other) < 0; }) &&
          any_beside(node, [&](const Node& other) { return lies_above(other); }) && is_film(node))
        found.push_back(node);
    });
    std::ranges::sort(found);
    return found;
  }

  /// Nodes of gas over films that lie on this one, all of them together between two nodes: what is
  /// left of them then has no place on the grid.
  std::vector<Node> bare() const {
    std::vector<Node> found;
    for_nodes_near([&](const Node& node, float last) {
      const float top = phi_at(top_, node);
      if (!(last > 0) || !(top > 0) || last - top <= same_phi || !goes(node)) return;
      const Vec3d r = last_.band().frame().node_position(node);
      if (is_parted_along_an_axis(node) && dot(top_.normal(r), last_.normal(r)) > least_cosine)
        found.push_back(node);
    });
    return found;
  }

  bool has_no_gas_but(const Node& node, const std::vector<Node>& squeezed) const {
    return !any_beside(node, [&](const Node& other) {
      const Node gas = folded(last_.band(), other);
      return will_be_gas(other) && !std::ranges::binary_search(squeezed, gas);
    });
  }

  bool lies_above(const Node& node) const {
    return phi_at(top_, node) < 0 && phi_at(last_, node) > 0;
  }

  bool is_film_edge(const FilmEdge& edge) const {
    return lies_above(edge.above) && runs_between(edge.above, edge.below);
  }

  std::vector<FilmEdge> film_edges() const {
    std::vector<FilmEdge> found;
    for_nodes_near([&](const Node& node, float last) {
      if (!(last > 0) || !lies_above(node)) return;
      any_beside(node, [&](const Node& other) {
        if (runs_between(node, other)) found.push_back({.above = node, .below = other});
        return false;
      });
    });
    return found;
  }

 private:
  static constexpr float reach = 1.5F;         // of a diagonal
  static constexpr double least_cosine = 0.7;  // between sides that go alike

  /// Of the film's upper side.
  template <class Visit>
  void for_nodes_near(const Visit& visit) const {
    const Band& band = last_.band();
    for (const Leaf& leaf : band.leaves()) {
      for (int offset = 0; offset < leaf_size; ++offset) {
        if (std::abs(leaf.phi[offset]) > reach) continue;
        const Node node = node_at(leaf, offset);
        if (node[0] < band.node_count(0) && node[1] < band.node_count(1))
          visit(node, leaf.phi[offset]);
      }
    }
  }

  bool goes(const Node& node) const { return kept_ == nullptr || phi_at(*kept_, node) > 0; }

  /// Whether the film runs between a node above it and one below it.
  bool runs_between(const Node& above, const Node& other) const {
    const float under = phi_at(below_, other);
    if (!(under < 0) || !goes(other)) return false;
    const float lower = phi_at(below_, above);
    const float upper = phi_at(last_, above);
    const float last = phi_at(last_, other);
    // Where the surface is nearer than the film, its distance is all that is known.
    const bool is_at_surface = under <= phi_at(top_, other) + same_phi;
    return is_at_surface ? upper + least_gap < lower
                         : crossing(under, lower) + least_gap < crossing(last, upper);
  }

  /// Whether both sides of the film go alike there: what fills a corner is no film.
  bool is_film(const Node& node) const {
    const Vec3d r = last_.band().frame().node_position(node);
    return dot(last_.normal(r), below_.normal(r)) > least_cosine;
  }

  bool is_parted_along_an_axis(const Node& node) const {
    return any_beside(node, [&](const Node& other) { return runs_between(node, other); }) &&
           is_film(node);
  }

  bool will_be_gas(const Node& node) const {
    return phi_at(top_, node) > 0 || gaps_.contains(folded(last_.band(), node)) ||
           (phi_at(last_, node) < 0 && phi_at(below_, node) > 0 && goes(node));
  }

  bool is_parted_across_a_face(const Node& node) const {
    for (int axis = 0; axis < 3; ++axis)
      for (const int a : {-1, 1})
        for (const int b : {-1, 1}) {
          const Node first = moved(node, axis, a);
          const Node second = moved(node, (axis + 1) % 3, b);
          const Node other = moved(first, (axis + 1) % 3, b);
          if (runs_between(node, other) && will_be_gas(first) && will_be_gas(second))
            return is_film(node);
        }
    return false;
  }

  void find(bool (GapFinder::*is_parted)(const Node&) const) {
    for_nodes_near([&](const Node& node, float last) {
      if (!(last > 0) || !(phi_at(top_, node) < 0) || !goes(node) || gaps_.contains(node)) return;
      if ((this->*is_parted)(node)) found_.push_back(node);
    });
  }

  const LevelSet& top_;
  const LevelSet& last_;
  const LevelSet& below_;
  const LevelSet* kept_;
  std::vector<Node> found_;
  std::set<Node> gaps_;
};

/// Whether what lies on the film at a node goes on where it stays, and does not end at gas.
bool stays_above(const Layers& layers, const LevelSet& below, const LevelSet& staying,
                 const Node& node) {
  const auto ends = [&](const Node& other) { return phi_at(layers.top(), other) > 0; };
  return !any_beside(node, ends) && any_beside(node, [&](const Node& other) {
    return phi_at(staying, other) < 0 && phi_at(below, other) > 0;
  });
}

/// phi of nodes above a film with which its upper side stays where it is, though nodes of the film
/// tell how far the lower one is.
std::map<Node, float> upper_sides(const Layers& layers, std::size_t layer,
                                  const std::vector<Node>& squeezed) {
  const LevelSet& last = layers.stack[layer].phi;
  const LevelSet& below = layers.stack[layer - 1].phi;
  std::map<Node, float> sides;
  for (const Node& node : squeezed) {
    any_beside(node, [&](const Node& other) {
      const float above = phi_at(last, other);
      if (!(above > 0) || !(phi_at(layers.top(), other) < 0)) return false;
      const float part = crossing(phi_at(last, node), above);
      const float phi = std::clamp(-phi_at(below, node) * (1 - part) / part, -LevelSet::half_width,
                                   -smallest_phi);
      const auto [at, is_new] = sides.try_emplace(folded(last.band(), other), phi);
      if (!is_new) at->second = std::max(at->second, phi);
      return false;
    });
  }
  return sides;
}

}  // namespace

std::vector<GapNode> thin_gaps(const Layers& layers, std::size_t layer, const LevelSet* kept,
                               const LevelSet* staying) {
  const LevelSet& below = layers.stack[layer - 1].phi;
  std::vector<GapNode> gaps;
  GapFinder finder(layers, layer, kept);
  const std::vector<Node> squeezed = finder.squeezed();
  gaps.reserve(squeezed.size());  // and a few more
  for (const auto& nodes : {squeezed, finder.bare()})
    for (const Node& node : nodes)
      gaps.push_back({.node = node,
                      .place = GapNode::Place::within,
                      .layer = layer,
                      .phi = phi_at(below, node)});
  for (const auto& [node, phi] : upper_sides(layers, layer, squeezed))
    gaps.push_back({.node = node,
                    .place = GapNode::Place::beside,
                    .layer = layer_at(layers, node),
                    .phi = phi,
                    .half_gap = phi_at(layers.stack[layer].phi, node),
                    .stays = finder.has_no_gas_but(node, squeezed)});
  for (const Node& node : finder.run()) {
    GapNode gap{.node = node, .layer = layer_at(layers, node), .phi = phi_at(below, node)};
    // Films between the two that no node holds go as well.
    gap.half_gap = std::clamp(0.5F * (gap.phi - phi_at(layers.stack[gap.layer - 1].phi, node)),
                              smallest_phi, 1.0F);
    gap.stays = staying != nullptr && stays_above(layers, below, *staying, node);
    gaps.push_back(gap);
  }
  return gaps;
}

std::vector<FilmEdge> film_edges(const Layers& layers, std::size_t layer) {
  return GapFinder(layers, layer, nullptr).film_edges();
}

bool is_film_edge(const Layers& layers, std::size_t layer, const FilmEdge& edge) {
  return GapFinder(layers, layer, nullptr).is_film_edge(edge);
}

void open_gaps(Band& band, std::size_t layer, const LevelSet& below,
               std::span<const GapNode> gaps) {
  std::map<Node, float> half_gaps;
  for (const GapNode& gap : gaps) {
    const NodePlace at = band.place(gap.node);
    if (!at.is_there()) continue;
    float& phi = band.leaves()[static_cast<std::size_t>(at.leaf)].phi[at.offset];
    if (gap.place == GapNode::Place::beside) {
      // Where a border with what lies above is nearer than the film, it stays.
      const bool is_nearest = gap.stays && phi <= same_phi - gap.half_gap;
      if (layer >= gap.layer) phi = is_nearest ? gap.phi : std::max(phi, gap.phi);
      continue;
    }
    const bool stays = gap.stays && layer >= gap.layer;
    phi = stays ? gap.half_gap : gap.phi;
    if (stays) half_gaps[gap.node] = gap.half_gap;
  }
  // The solid beside a gap is a spacing from its middle, where it is next to no other gas.
  for (const auto& gap : half_gaps) {
    any_beside(gap.first, [&](const Node& beside) {
      const Node solid = folded(band, beside);
      if (!(band.node(solid[0], solid[1], solid[2]) < 0)) return false;
      float widest = gap.second;
      const bool is_beside_other_gas = any_beside(solid, [&](const Node& other) {
        const Node gas = folded(band, other);
        if (band.node(gas[0], gas[1], gas[2]) < 0) return false;
        const auto found = half_gaps.find(gas);
        if (found != half_gaps.end()) widest = std::max(widest, found->second);
        return found == half_gaps.end();
      });
      if (is_beside_other_gas) return false;
      const NodePlace at = band.place(solid);
      if (at.is_there())
        band.leaves()[static_cast<std::size_t>(at.leaf)].phi[at.offset] =
            std::min({widest - 1, phi_at(below, solid), -smallest_phi});
      return false;
    });
  }
}

}  // namespace scarp
