#include "levelset/operations/layer_sets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/grid/band.h"
#include "levelset/grid/exposure.h"
#include "levelset/grid/redistance.h"
#include "levelset/operations/closed_voids.h"
#include "levelset/start/sheets.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 16;

template <std::size_t count>
using Bands = std::array<const Band*, count>;

/// Makes the leaves that other bands have.
template <std::size_t count>
void add_leaves_of(Band& band, const Bands<count>& others) {
  std::vector<NewLeaf> added;
  for (const Band* other : others) {
    if (other == nullptr) continue;
    for (const Leaf& leaf : other->leaves()) {
      const auto [i, j, k] = leaf.origin;
      const int found = band.find(i >> 3, j >> 3, k >> 3);
      if (found < 0)
        added.push_back({.origin = leaf.origin, .solid = found == Band::missing_solid});
    }
  }
  std::sort(added.begin(), added.end());
  added.erase(std::unique(added.begin(), added.end()), added.end());
  band.change_leaves(added, {});
}

/// phi := op(phi, phi of the others) at all nodes of a band and of the others. Where there is none,
/// all is gas.
template <std::size_t count, class Op>
void combine(Band& band, const Bands<count>& others, const Op& op) {
  add_leaves_of(band, others);
  parallel_for(band.leaves().size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      Leaf& leaf = band.leaves()[n];
      const auto [i, j, k] = leaf.origin;
      std::array<const float*, count> values{};
      for (std::size_t m = 0; m < count; ++m) {
        const int found =
            others[m] == nullptr ? Band::missing_gas : others[m]->find(i >> 3, j >> 3, k >> 3);
        values[m] = found >= 0 ? others[m]->leaves()[static_cast<std::size_t>(found)].phi
                               : missing_values(found);
      }
      for (int node = 0; node < leaf_size; ++node) {
        std::array<float, count> at{};
        for (std::size_t m = 0; m < count; ++m) at[m] = values[m][node];
        leaf.phi[node] = op(leaf.phi[node], at);
      }
    }
  });
  band.trim();
}

/// What is left of a layer of which the materials from some layer to a last one are gas, but for
/// what is kept. below: the layer under them.
float without(float phi, float last, float below, float kept) {
  // Where nothing lies on the last one, the layer below it comes out to the last bit.
  const bool is_seen = last - phi <= same_phi;
  return std::max(phi,
                  is_seen ? std::min(std::max(last, kept), below) : std::min({-last, kept, below}));
}

/// Whether a neighbour along an axis has the other sign.
bool is_next_to_surface(const Band& band, const Node& node) {
  const bool is_solid = band.node(node[0], node[1], node[2]) < 0;
  for (int face = 0; face < 6; ++face) {
    Node other = node;
    other[static_cast<std::size_t>(face / 2)] += face % 2 == 0 ? -1 : 1;
    if ((band.node(other[0], other[1], other[2]) < 0) != is_solid) return true;
  }
  return false;
}

// What lies below is part of a layer. Beside its edges phi is found anew too large where they lie
// between nodes: the nodes around do not tell of an edge.
void keep_distances_of(Band& band, const Band& below) {
  combine(band, Bands<1>{&below}, [](float phi, const auto& other) {
    return (phi < 0) == (other[0] < 0) ? std::min(phi, other[0]) : phi;
  });
}

}  // namespace

void fill_gas(Layers& layers, const LevelSet& solid) {
  Band& band = layers.top().band();
  const OpenGas gas = open_gas(layers);
  const std::unique_ptr<const Band> before = gas.voids.empty() ? nullptr : band.copy();
  combine(band, Bands<1>{&solid.band()},
          [](float phi, const auto& other) { return std::min(phi, other[0]); });
  remove_sheets(layers.top());
  redistance_fully(band);
  if (before) take_over_voids(*before, gas, band);
}

void keep_within(Layers& layers, const LevelSet& earlier, const LevelSet& solid) {
  Band& band = layers.top().band();
  combine(band, Bands<2>{&earlier.band(), &solid.band()}, [](float phi, const auto& others) {
    return std::min(others[0], std::max(phi, others[1]));
  });
  redistance_fully(band);
}

void take_away(Layers& layers, std::size_t first, std::size_t last, const LevelSet* kept,
               std::span<const GapNode> gaps) {
  const LevelSet* const below = first > 0 ? &layers.stack[first - 1].phi : nullptr;
  const LevelSet of_last = layers.stack[last].phi.copy();
  const LevelSet of_top = layers.top().copy();
  for (std::size_t n = first; n < layers.stack.size(); ++n) {
    Band& band = layers.stack[n].phi.band();
    combine(band,
            Bands<4>{&of_last.band(), below == nullptr ? nullptr : &below->band(),
                     kept == nullptr ? nullptr : &kept->band(), &of_top.band()},
            [is_among = n <= last](float phi, const auto& others) {
              // In what lies on the last one, and stays, borders of materials stay as well.
              if (!is_among && phi > 0 && others[0] > 0 && others[3] < 0) return phi;
              return without(phi, is_among ? phi : others[0], others[1], others[2]);
            });
    if (n > last && !gaps.empty()) open_gaps(band, n, *below, gaps);
    redistance_fully(band);
    if (below != nullptr) keep_distances_of(band, below->band());
  }
  for (std::size_t n = layers.stack.size(); n-- > 1;)
    cut(layers.stack[n - 1].phi, layers.stack[n].phi);
}

LevelSet top_without(const Layers& layers, std::size_t first, std::size_t last) {
  SCARP_ASSERT(first, >, std::size_t{0});
  LevelSet top = layers.top().copy();
  combine(top.band(), Bands<2>{&layers.stack[last].phi.band(), &layers.stack[first - 1].phi.band()},
          [](float phi, const auto& others) {
            return without(phi, others[0], others[1], LevelSet::half_width);
          });
  return top;
}

bool is_same_surface(const LevelSet& a, const LevelSet& b) {
  const auto has_all_of = [](const Band& one, const Band& other) {
    return std::ranges::all_of(one.leaves(), [&](const Leaf& leaf) {
      for (int offset = 0; offset < leaf_size; ++offset) {
        const float here = leaf.phi[offset];
        if (std::abs(here) >= 1) continue;
        const auto [i, j, k] = node_at(leaf, offset);
        const float there = other.node(i, j, k);
        // Further away phi may be found anew where the surface stays.
        if ((here < 0) == (there < 0) && !is_next_to_surface(one, {i, j, k})) continue;
        if (std::abs(here - there) > same_phi) return false;
      }
      return true;
    });
  };
  return has_all_of(a.band(), b.band()) && has_all_of(b.band(), a.band());
}

}  // namespace scarp
