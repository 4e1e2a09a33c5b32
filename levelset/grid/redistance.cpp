#include "levelset/grid/redistance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "levelset/grid/band.h"
#include "levelset/grid/carry.h"
#include "levelset/grid/differences.h"
#include "levelset/grid/stencil.h"

namespace scarp {

namespace {

constexpr float half_width = LevelSet::half_width;
constexpr std::size_t grain = 16;

/// Steps per call and their length in spacings; explicit Godunov is stable up to 1 / sqrt(3).
constexpr int step_count = 2;
constexpr float step_length = 0.5F;

/// No node that is not next to the surface comes nearer to it than this.
constexpr float smallest_free_phi = 1e-3F;

/// A node lies in a valley if its neighbours along an axis are further from the surface by this.
constexpr float least_valley = 0.1F;

/// A node that enters the band has a neighbour along an axis that is nearer to the surface by at
/// least 1 / sqrt(3): only such neighbours need leaves beyond them.
constexpr float reaches_out = half_width - 0.577F;

/// Leaves to make because the band reaches them from this leaf across a face.
void leaves_reached_from(const Band& band, std::size_t n, std::vector<NewLeaf>& added) {
  const Leaf& leaf = band.leaves()[n];
  const std::array<int, 2> count{stored_nodes(band, leaf, 0), stored_nodes(band, leaf, 1)};
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2;
    const int step = face % 2 == 0 ? -1 : 1;
    std::array<int, 3> origin = leaf.origin;
    origin[axis] += step * leaf_edge;
    int next = band.neighbours(n)[face];
    if (axis < 2) {
      // Mirrored nodes exist already; wrapped ones may not.
      const int beyond = step < 0 ? leaf.origin[axis] - 1 : leaf.origin[axis] + count[axis];
      const int folded = band.fold(axis, beyond);
      origin[axis] = folded & ~7;
      next = band.find(origin[0] >> 3, origin[1] >> 3, origin[2] >> 3);
    }
    if (next >= 0) {
      continue;
    }
    const int last = axis < 2 ? count[axis] - 1 : leaf_edge - 1;
    bool reached = false;
    for (int a = 0; a < leaf_edge && !reached; ++a) {
      for (int b = 0; b < leaf_edge && !reached; ++b) {
        std::array<int, 3> node{};
        node[axis] = step < 0 ? 0 : last;
        node[(axis + 1) % 3] = a;
        node[(axis + 2) % 3] = b;
        reached = std::abs(leaf.phi[leaf_offset(node[0], node[1], node[2])]) < reaches_out;
      }
    }
    if (reached) {
      added.push_back({.origin = origin, .solid = next == Band::missing_solid});
    }
  }
}

void grow_band(Band& band) {
  const std::size_t count = band.leaves().size();
  std::vector<std::vector<NewLeaf>> found((count + grain - 1) / grain);
  parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      leaves_reached_from(band, n, found[begin / grain]);
    }
  });
  std::vector<NewLeaf> added;
  for (const auto& range : found) {
    added.insert(added.end(), range.begin(), range.end());
  }
  std::sort(added.begin(), added.end());
  added.erase(std::unique(added.begin(), added.end()), added.end());
  band.change_leaves(added, {});
}

/// Nodes that keep their phi, through the growth of a band.
class HeldNodes {
 public:
  HeldNodes(const Band& band, std::span<const std::uint64_t> held) {
    for (std::size_t n = 0; n * leaf_edge < held.size(); ++n) {
      LeafMask mask{};
      std::copy_n(held.begin() + static_cast<std::ptrdiff_t>(n * leaf_edge), leaf_edge,
                  mask.begin());
      if (mask != LeafMask{}) masks_.push_back({band.leaves()[n].origin, mask});
    }
  }

  /// To be called once the band has all its leaves.
  void find_leaves(const Band& band) {
    if (masks_.empty()) return;
    of_leaf_.assign(band.leaves().size(), nullptr);
    for (const auto& [origin, mask] : masks_) {
      const int leaf = band.find(origin[0] >> 3, origin[1] >> 3, origin[2] >> 3);
      of_leaf_[static_cast<std::size_t>(leaf)] = &mask;
    }
  }

  /// Gives what a leaf's held nodes had.
  void restore(std::size_t leaf, const Block& before, float* phi) const {
    if (of_leaf_.empty() || of_leaf_[leaf] == nullptr) return;
    for_each_node(*of_leaf_[leaf],
                  [&](int node) { phi[node] = before.row(node >> 6, node >> 3 & 7)[node & 7]; });
  }

 private:
  struct Held {
    Node origin;
    LeafMask mask;
  };

  std::vector<Held> masks_;
  std::vector<const LeafMask*> of_leaf_;
};

/// Whether a node keeps what it has: it is next to the surface, or outside the band.
SCARP_KERNEL_PART bool is_held(const float* p, float side) {
  // No node is exactly 0: a product is negative if that neighbour has the other sign.
  const float x = std::min(p[-Block::x_stride] * side, p[Block::x_stride] * side);
  const float y = std::min(p[-Block::y_stride] * side, p[Block::y_stride] * side);
  const float z = std::min(p[-1] * side, p[1] * side);
  return std::min(std::min(x, y), z) < 0 || !(*p * side < half_width);
}

/// Whether both neighbours along an axis are further from the surface.
///
/// Where two fronts have met, phi is the larger distance to what is left of either: a valley with
/// slopes of 1, though the notch between them is further away. Upwind differences fill it; without
/// that an etch would dig three spacings too deep there.
SCARP_KERNEL_PART bool is_in_valley(const float* p, float side) {
  const float x = std::min(p[-Block::x_stride] * side, p[Block::x_stride] * side);
  const float y = std::min(p[-Block::y_stride] * side, p[Block::y_stride] * side);
  const float z = std::min(p[-1] * side, p[1] * side);
  return std::max(std::max(x, y), z) - *p * side > least_valley;
}

/// One step of phi_tau = -sign (|grad phi| - 1) for the nodes of a leaf that lie in the domain.
template <Scheme scheme>
SCARP_KERNEL_PART void step_rows(const Block& block, int i_count, int j_count, float* out) {
  for (int i = 0; i < i_count; ++i) {
    for (int j = 0; j < j_count; ++j) {
      const float* row = block.row(i, j);
      float* target = out + leaf_offset(i, j, 0);
      for (int k = 0; k < leaf_edge; ++k) {
        const float* p = row + k;
        const float here = *p;
        const float side = here < 0 ? -1.0F : 1.0F;
        const float edges = is_in_valley(p, side) ? 0.0F : 1.0F;
        const float slope = distance_slope<scheme>(p, side, edges);
        const float moved = here * side - step_length * (slope - 1);
        const float kept = side * std::min(std::max(moved, smallest_free_phi), half_width);
        target[k] = is_held(p, side) ? here : kept;
      }
    }
  }
}

SCARP_VECTOR_KERNEL void step_eno2(const Block& block, int i_count, int j_count, float* out) {
  step_rows<Scheme::eno2>(block, i_count, j_count, out);
}

SCARP_VECTOR_KERNEL void step_weno5(const Block& block, int i_count, int j_count, float* out) {
  step_rows<Scheme::weno5>(block, i_count, j_count, out);
}

/// The band's nodes as they are, the nodes just outside at one spacing beyond their nearest
/// neighbour.
SCARP_VECTOR_KERNEL void extend_leaf(const Block& block, int i_count, int j_count, float* out) {
  for (int i = 0; i < i_count; ++i) {
    for (int j = 0; j < j_count; ++j) {
      const float* row = block.row(i, j);
      float* target = out + leaf_offset(i, j, 0);
      for (int k = 0; k < leaf_edge; ++k) {
        const float* p = row + k;
        const float side = *p < 0 ? -1.0F : 1.0F;
        float nearest = std::min(std::abs(p[-1]), std::abs(p[1]));
        nearest = std::min(nearest, std::abs(p[-Block::y_stride]));
        nearest = std::min(nearest, std::abs(p[Block::y_stride]));
        nearest = std::min(nearest, std::abs(p[-Block::x_stride]));
        nearest = std::min(nearest, std::abs(p[Block::x_stride]));
        target[k] = std::abs(*p) < half_width ? *p : side * std::min(nearest + 1, half_width);
      }
    }
  }
}

using LeafKernel = void (*)(const Block&, int, int, float*);

/// Applies a kernel to all leaves, from one set of values to another.
template <int halo, class Source, class Target>
void for_each_leaf(const Band& band, const HeldNodes& held, const Source& from, const Target& to,
                   LeafKernel kernel) {
  parallel_for(band.leaves().size(), grain, [&](std::size_t begin, std::size_t end) {
    Block block;
    for (std::size_t n = begin; n < end; ++n) {
      gather<halo>(band, n, from, block);
      kernel(block, stored_nodes(band, band.leaves()[n], 0),
             stored_nodes(band, band.leaves()[n], 1), to(n));
      held.restore(n, block, to(n));
    }
  });
}

/// The steps, from the tree to scratch, where the last one ends.
template <int halo>
void step_all(Band& band, const HeldNodes& held, LeafValues& scratch, LeafKernel step_leaf) {
  const auto in_tree = [&](std::size_t n) -> float* { return band.leaves()[n].phi; };
  const auto aside = [&](std::size_t n) { return scratch[n]; };
  for_each_leaf<1>(band, held, in_tree, aside, extend_leaf);
  static_assert(step_count % 2 == 0);
  for (int step = 0; step < step_count; step += 2) {
    for_each_leaf<halo>(band, held, aside, in_tree, step_leaf);
    for_each_leaf<halo>(band, held, in_tree, aside, step_leaf);
  }
}

}  // namespace

void redistance(Band& band, Scheme scheme, std::span<const std::uint64_t> held) {
  HeldNodes kept(band, held);
  grow_band(band);
  kept.find_leaves(band);
  LeafValues& scratch = band.scratch(0);
  if (scheme == Scheme::weno5) {
    step_all<3>(band, kept, scratch, step_weno5);
  } else {
    step_all<2>(band, kept, scratch, step_eno2);
  }
  band.trim(scratch);
}

void redistance_fully(Band& band) {
  constexpr int pass_count = 8;
  for (int pass = 0; pass < pass_count; ++pass) redistance(band);
}

}  // namespace scarp
