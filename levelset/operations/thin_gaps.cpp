#include "levelset/operations/thin_gaps.h"

#include <algorithm>
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

 private:
  static constexpr float reach = 1.5F;  // of a diagonal

  bool goes(const Node& node) const { return kept_ == nullptr || phi_at(*kept_, node) > 0; }

  /// Whether the film runs between a node above it and one below it.
  bool runs_between(const Node& above, const Node& other) const {
    const float under = phi_at(below_, other);
    return under < 0 && goes(other) &&
           crossing(under, phi_at(below_, above)) + least_gap <
               crossing(phi_at(last_, other), phi_at(last_, above));
  }

  bool is_parted_along_an_axis(const Node& node) const {
    return any_beside(node, [&](const Node& other) { return runs_between(node, other); });
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
          if (runs_between(node, other) && will_be_gas(first) && will_be_gas(second)) return true;
        }
    return false;
  }

  void find(bool (GapFinder::*is_parted)(const Node&) const) {
    const Band& band = last_.band();
    for (const Leaf& leaf : band.leaves()) {
      for (int offset = 0; offset < leaf_size; ++offset) {
        if (!(leaf.phi[offset] > 0) || leaf.phi[offset] > reach) continue;
        const Node node = node_at(leaf, offset);
        if (node[0] >= band.node_count(0) || node[1] >= band.node_count(1)) continue;
        if (!(phi_at(top_, node) < 0) || !goes(node) || gaps_.contains(node)) continue;
        if ((this->*is_parted)(node)) found_.push_back(node);
      }
    }
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

}  // namespace

std::vector<GapNode> thin_gaps(const Layers& layers, std::size_t layer, const LevelSet* kept,
                               const LevelSet* staying) {
  const LevelSet& below = layers.stack[layer - 1].phi;
  std::vector<GapNode> gaps;
  for (const Node& node : GapFinder(layers, layer, kept).run()) {
    GapNode gap{.node = node, .layer = layer_at(layers, node), .lower = phi_at(below, node)};
    // Films between the two that no node holds go as well.
    gap.half_gap = std::clamp(0.5F * (gap.lower - phi_at(layers.stack[gap.layer - 1].phi, node)),
                              smallest_phi, 1.0F);
    gap.stays = staying != nullptr && stays_above(layers, below, *staying, node);
    gaps.push_back(gap);
  }
  return gaps;
}

void open_gaps(Band& band, std::size_t layer, const LevelSet& below,
               std::span<const GapNode> gaps) {
  std::map<Node, float> half_gaps;
  for (const GapNode& gap : gaps) {
    const NodePlace at = band.place(gap.node);
    if (!at.is_there()) continue;
    const bool stays = gap.stays && layer >= gap.layer;
    band.leaves()[static_cast<std::size_t>(at.leaf)].phi[at.offset] =
        stays ? gap.half_gap : gap.lower;
    if (stays) half_gaps[gap.node] = gap.half_gap;
  }
  // The solid beside a gap is a spacing from its middle, where it is next to no other gas.
  for (const auto& [node, half] : half_gaps) {
    any_beside(node, [&](const Node& beside) {
      const Node solid = folded(band, beside);
      if (!(band.node(solid[0], solid[1], solid[2]) < 0)) return false;
      float widest = half;
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
