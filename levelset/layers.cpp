#include "levelset/layers.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/band.h"
#include "levelset/exposure.h"

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

/// Whether the upper layer is thicker than same_phi next to its surface.
bool is_thicker(const Band& upper, const Band& lower) {
  for (const Leaf& leaf : upper.leaves()) {
    const auto [i, j, k] = leaf.origin;
    const int other = lower.find(i >> 3, j >> 3, k >> 3);
    const float* below = other >= 0 ? lower.leaves()[other].phi : missing_values(other);
    for (int node = 0; node < leaf_size; ++node) {
      if (std::abs(leaf.phi[node]) < 1 && below[node] - leaf.phi[node] > same_phi) {
        return true;
      }
    }
  }
  return false;
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
  return n == 0 || is_thicker(layers.stack[n].phi.band(), layers.stack[n - 1].phi.band());
}

void remove_empty_layers(Layers& layers) {
  for (std::size_t n = layers.stack.size(); n-- > 1;) {
    if (!adds_material(layers, n)) {
      // The upper of the two keeps the surface, the lower one the material.
      layers.stack[n].material = layers.stack[n - 1].material;
      layers.stack.erase(layers.stack.begin() + static_cast<std::ptrdiff_t>(n) - 1);
    }
  }
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
