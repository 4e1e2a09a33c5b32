#include "levelset/grid/layers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/grid/band.h"
#include "levelset/grid/carry.h"
#include "levelset/grid/exposure.h"
#include "levelset/grid/stencil.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 16;

/// Leaves that the layer lacks because it is solid there, and the top has its band there.
std::vector<NewLeaf> leaves_to_cut(const Band& layer, const Band& top) {
  std::vector<NewLeaf> added;
  for (const Leaf& leaf : top.leaves()) {
    const auto [i, j, k] = leaf.origin;
    if (layer.find(i >> 3, j >> 3, k >> 3) == Band::missing_solid) {
      added.push_back({.origin = leaf.origin, .solid = true});
    }
  }
  return added;
}

/// How much of the edge from a solid node of the upper layer to a gas neighbour is the upper
/// layer's alone, in spacings.
float thickness_on_edge(const std::array<float, 2>& upper, const std::array<float, 2>& lower) {
  const auto [solid, gas] = upper;
  if (!(lower[0] < 0)) return 1;
  return crossing(solid, gas) - crossing(lower[0], lower[1]);
}

/// Calls visit(thickness_on_edge, part of it that counts for a volume) for all edges that the
/// surface of a layer cuts, until it returns false. Only there phi of both layers is that of what
/// is there: in gas the lower one may tell the distance to what has been removed since.
template <class Visit>
void for_each_cut_edge(const Band& upper, const Band& lower, const Visit& visit) {
  Block block;
  bool goes_on = true;
  for (std::size_t n = 0; n < upper.leaves().size() && goes_on; ++n) {
    const Leaf& leaf = upper.leaves()[n];
    gather<1>(
        upper, n, [&](std::size_t m) -> const float* { return upper.leaves()[m].phi; }, block);
    for_each_node(next_to_surface(leaf, block), [&](int offset) {
      const float* phi = block.row(offset >> 6, (offset >> 3) & 7) + (offset & 7);
      if (!(*phi < 0) || !goes_on) return;
      const Node node = node_at(leaf, offset);
      const float below = lower.node(node[0], node[1], node[2]);
      Vec3f gradient;
      for (int axis = 0; axis < 3; ++axis)
        gradient[axis] = phi[axis_strides[axis]] - phi[-axis_strides[axis]];
      const float square = std::max(dot(gradient, gradient), 1e-6F);
      for (int edge = 0; edge < 6 && goes_on; ++edge) {
        const int axis = edge / 2;
        const int step = edge % 2 == 0 ? -1 : 1;
        const float there = phi[step * axis_strides[axis]];
        if (there < 0) continue;
        Node next = node;
        next[axis] += step;
        const float beyond = lower.node(next[0], next[1], next[2]);
        // A plane is cut by as many edges along an axis as its normal has of it.
        goes_on = visit(thickness_on_edge({*phi, there}, {below, beyond}),
                        gradient[axis] * gradient[axis] / square);
      }
    });
  }
}

/// A film of which no more than this is left, in spacings, and on no more than this part of the
/// surface, is a residue of what was etched.
constexpr float residue_thickness = 0.05F;
constexpr double residue_part = 0.05;

/// The volume of a layer in spacings cubed, if it is a residue.
std::optional<double> residue_of(const Band& upper, const Band& lower) {
  bool is_thin = true;
  std::size_t edges = 0;
  std::size_t covered = 0;
  double volume = 0;
  for_each_cut_edge(upper, lower, [&](float thickness, float part) {
    ++edges;
    covered += thickness > same_phi ? 1 : 0;
    volume += std::max(thickness, 0.0F) * part;
    is_thin = thickness <= residue_thickness;
    return is_thin;
  });
  const bool is_residue =
      is_thin && static_cast<double>(covered) <= residue_part * static_cast<double>(edges);
  return is_residue ? std::optional(volume) : std::nullopt;
}

}  // namespace

Layers Layers::copy() const {
  Layers copied{.frame = frame, .stack = {}};
  for (const Layer& layer : stack) {
    copied.stack.push_back({layer.material, layer.phi.copy()});
  }
  return copied;
}

void add_layer(Layers& layers, MaterialId material) {
  SCARP_ASSERT(layers.stack.size(), >, std::size_t{0});
  if (layers.stack.back().material != material) {
    layers.top().band().release_scratch();
    layers.stack.push_back({material, layers.top().copy()});
  }
}

void cut(LevelSet& solid, const LevelSet& by) {
  Band& layer = solid.band();
  const Band& top = by.band();
  layer.change_leaves(leaves_to_cut(layer, top), {});
  parallel_for(layer.leaves().size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const auto [i, j, k] = layer.leaves()[n].origin;
      const int other = top.find(i >> 3, j >> 3, k >> 3);
      const float* top_phi = other >= 0 ? top.leaves()[other].phi : missing_values(other);
      float* phi = layer.leaves()[n].phi;
      for (int node = 0; node < leaf_size; ++node) {
        phi[node] = std::max(phi[node], top_phi[node]);
      }
    }
  });
  layer.trim();
}

void cut_lower_layers(Layers& layers) {
  for (std::size_t n = 0; n + 1 < layers.stack.size(); ++n) {
    cut(layers.stack[n].phi, layers.top());
  }
}

bool adds_material(const Layers& layers, std::size_t n) {
  if (n == 0) return true;
  bool adds = false;
  for_each_cut_edge(layers.stack[n].phi.band(), layers.stack[n - 1].phi.band(),
                    [&](float thickness, float) {
                      adds = thickness > same_phi;
                      return !adds;
                    });
  return adds;
}

bool has_material(const Layers& layers, MaterialId material) {
  for (std::size_t n = 0; n < layers.stack.size(); ++n)
    if (layers.stack[n].material == material && adds_material(layers, n)) return true;
  return false;
}

namespace {

/// Where no more than the given thickness of layer n is left, what lay under the layer below it as
/// well gets its surface to the last bit: no sliver of that layer remains there.
void hand_down_surface(Layers& layers, std::size_t n, float thickness) {
  const Band& upper = layers.stack[n].phi.band();
  Block block;
  for (std::size_t l = 0; l < upper.leaves().size(); ++l) {
    const Leaf& leaf = upper.leaves()[l];
    gather<1>(
        upper, l, [&](std::size_t m) -> const float* { return upper.leaves()[m].phi; }, block);
    for_each_node(next_to_surface(leaf, block), [&](int offset) {
      const auto [i, j, k] = node_at(leaf, offset);
      const float below = layers.stack[n - 1].phi.node(i, j, k);
      if (below - leaf.phi[offset] > thickness) return;
      for (std::size_t lower = 0; lower + 1 < n; ++lower) {
        Band& band = layers.stack[lower].phi.band();
        const int found = band.find(i >> 3, j >> 3, k >> 3);
        if (found < 0) continue;
        float& phi = band.leaves()[static_cast<std::size_t>(found)].phi[offset];
        if (phi - below <= same_phi) phi = leaf.phi[offset];
      }
    });
  }
}

/// The upper of two layers keeps the surface, the lower one the material.
void merge_with_lower(Layers& layers, std::size_t n, float thickness) {
  hand_down_surface(layers, n, thickness);
  layers.stack[n].material = layers.stack[n - 1].material;
  layers.stack.erase(layers.stack.begin() + static_cast<std::ptrdiff_t>(n) - 1);
}

}  // namespace

void remove_empty_layers(Layers& layers) {
  for (std::size_t n = layers.stack.size(); n-- > 1;) {
    if (!adds_material(layers, n)) merge_with_lower(layers, n, same_phi);
  }
}

double remove_residues(Layers& layers, const std::vector<bool>& is_etched) {
  SCARP_ASSERT(is_etched.size(), ==, layers.stack.size());
  const double h = layers.frame.spacing;
  double volume = 0;
  for (std::size_t n = layers.stack.size(); n-- > 1;) {
    if (!is_etched[n]) continue;
    const auto residue = residue_of(layers.stack[n].phi.band(), layers.stack[n - 1].phi.band());
    if (!residue) continue;
    volume += *residue * h * h * h;
    merge_with_lower(layers, n, residue_thickness);
  }
  return volume;
}

std::uint64_t hash(const Layers& layers) {
  std::uint64_t hash = layers.stack.size();
  for (const Layer& layer : layers.stack) {
    // 64-bit FNV-1a over the hashes of the layers.
    for (const std::uint64_t word : {layer.phi.hash(), std::uint64_t{layer.material}}) {
      hash = (hash ^ word) * 0x100000001b3U;
      hash ^= hash >> 29;
    }
  }
  return hash;
}

}  // namespace scarp
