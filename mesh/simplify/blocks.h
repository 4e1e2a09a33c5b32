#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "mesh/simplify/collapse_mesh.h"
#include "mesh/simplify/star.h"

namespace scarp {

/// The vertices of a mesh sorted into cubes, so that the cubes can be worked on at the same time.
///
/// A star is local if all its vertices lie in one block. A facet that touches two blocks is in no
/// local star, so local stars of different blocks have no facet and no vertex in common; and what
/// surrounds a local star has a vertex in its block, so nothing that another block changes. The
/// seam between the blocks stays as it is; the next pass cuts elsewhere. Opposite periodic sides
/// lie inside the same blocks, and what a block may change on one of them it may change on the
/// other.
class Blocks {
 public:
  /// Cuts shift with the pass. Does not depend on the number of threads.
  Blocks(const CollapseMesh& mesh, int pass);
  /// One block that holds all.
  static Blocks whole(const CollapseMesh& mesh);

  /// Some of them may be empty.
  std::uint32_t count() const { return count_; }

  /// That of a vertex with facets.
  std::uint32_t of(std::uint32_t v) const { return block_[v]; }
  bool holds(std::uint32_t block, std::uint32_t v) const { return block_[v] == block; }

  bool holds(std::uint32_t block, const Star& star) const {
    return holds(block, star.u) && holds(block, star.v) &&
           std::all_of(star.ring.begin(), star.ring.begin() + star.count + 1,
                       [&](std::uint32_t v) { return holds(block, v); });
  }

  /// Whether the ends of an edge lie in the block, and those of its twin edge, if it has one.
  bool holds_edge(std::uint32_t block, const CollapseMesh& mesh, std::uint32_t h) const {
    const std::uint32_t u = mesh.topology.origin(h);
    const std::uint32_t v = mesh.topology.target(h);
    if (!holds(block, u) || !holds(block, v)) return false;
    // What the twins of other blocks' vertices are is not to be looked at.
    const auto holds_twin = [&](std::uint32_t w) {
      return mesh.twin[w] == HalfEdges::none || holds(block, mesh.twin[w]);
    };
    return !mesh.has_twins() || mesh.topology.opposite(h) != HalfEdges::none ||
           (holds_twin(u) && holds_twin(v));
  }

 private:
  Blocks() = default;

  std::vector<std::uint32_t> block_;  ///< per vertex
  std::uint32_t count_ = 0;
};

/// Calls body(block) for each block that is not empty, on all threads; those with most to do go
/// first, so that no thread is left waiting for one of them. sizes: per block, how much there is to
/// do.
void for_each_block(std::span<const std::size_t> sizes,
                    const std::function<void(std::uint32_t block)>& body);

/// The vertices that have facets, by block.
class VerticesByBlock {
 public:
  VerticesByBlock(const CollapseMesh& mesh, const Blocks& blocks);

  /// In their order in the mesh.
  std::span<const std::uint32_t> of(std::uint32_t block) const {
    return {vertices_.data() + begin_[block], vertices_.data() + begin_[block + 1]};
  }

  /// As the function above, with the vertices of the block.
  void for_each_block(
      const std::function<void(std::uint32_t block, std::span<const std::uint32_t>)>& body) const;

 private:
  std::vector<std::uint32_t> begin_;  ///< per block, and one more
  std::vector<std::uint32_t> vertices_;
};

}  // namespace scarp
