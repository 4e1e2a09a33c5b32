#include "mesh/simplify/blocks.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/parallel.h"
#include "mesh/cube_lattice.h"

namespace scarp {

namespace {

/// Small enough for a core's cache, large enough that the seam is thin; and enough of them that
/// threads end at about the same time.
constexpr double most_per_block = 6000;
constexpr double least_per_block = 2500;
constexpr double blocks_wanted = 16;

/// Where the cuts lie, in cubes: each pass is far from the cuts of those before it.
constexpr double shifts[]{0, 0.5, 0.25, 0.75};

/// Where a periodic mesh is cut open, in cubes before its upper side: so that the sides are then in
/// the middle of cubes.
constexpr double openings[]{0.5, 0.95, 0.3, 0.7};

constexpr std::size_t grain = 8192;

constexpr std::uint32_t no_block = 0xffffffffU;

/// Cubes over a mesh, cut where the pass says, each with its share of the area. A periodic mesh is
/// cut open before its upper side; what lies behind goes one period down.
class Cubes {
 public:
  Cubes(const CollapseMesh& mesh, int pass) {
    Box box = mesh.box;
    const double live = std::max(mesh.live_vertices, 1U);
    const double per_block = std::clamp(live / blocks_wanted, least_per_block, most_per_block);
    const double size = std::sqrt(mesh.area / live * per_block);
    for (int axis = 0; axis < 2; ++axis) {
      const double width = box.upper[axis] - box.lower[axis];
      if (!mesh.periodic[axis] || !(width > 0)) continue;
      const double opening = std::min(openings[pass % 4] * size, 0.5 * width);
      box.lower[axis] -= opening;
      box.upper[axis] -= opening;
      period_[axis] = width;
    }
    end_ = box.upper;
    lattice_ = {box, size, shifts[pass % 4]};
  }

  std::uint32_t count() const { return lattice_.count(); }

  std::uint32_t of(Vec3d r) const {
    for (int axis = 0; axis < 2; ++axis) {
      if (r[axis] > end_[axis]) r[axis] -= period_[axis];
    }
    return lattice_.of(r);
  }

 private:
  CubeLattice lattice_;
  std::array<double, 2> period_{};
  Vec3d end_;
};

}  // namespace

Blocks::Blocks(const CollapseMesh& mesh, int pass) : block_(mesh.r.size(), no_block) {
  const Cubes cubes(mesh, pass);
  count_ = cubes.count();
  parallel_for(block_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (auto v = static_cast<std::uint32_t>(begin); v < end; ++v) {
      if (mesh.topology.outgoing(v) != HalfEdges::none) block_[v] = cubes.of(mesh.r[v]);
    }
  });
}

Blocks Blocks::whole(const CollapseMesh& mesh) {
  Blocks blocks;
  blocks.block_.assign(mesh.r.size(), 0);
  blocks.count_ = 1;
  return blocks;
}

void for_each_block(std::span<const std::size_t> sizes,
                    const std::function<void(std::uint32_t block)>& body) {
  std::vector<std::uint32_t> order;
  for (std::uint32_t block = 0; block < sizes.size(); ++block) {
    if (sizes[block] > 0) order.push_back(block);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return sizes[a] > sizes[b]; });
  // Threads take what comes next, whatever ranges they are given.
  std::atomic<std::size_t> taken = 0;
  parallel_for(order.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(order[taken++]);
  });
}

VerticesByBlock::VerticesByBlock(const CollapseMesh& mesh, const Blocks& blocks)
    : begin_(blocks.count() + 1, 0) {
  const auto for_each = [&](const auto& visit) {
    for (std::uint32_t v = 0; v < mesh.r.size(); ++v) {
      if (mesh.topology.outgoing(v) != HalfEdges::none) visit(v, blocks.of(v));
    }
  };
  for_each([&](std::uint32_t, std::uint32_t block) { ++begin_[block + 1]; });
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  vertices_.resize(begin_.back());
  std::vector<std::uint32_t> cursor(begin_.begin(), begin_.end() - 1);
  for_each([&](std::uint32_t v, std::uint32_t block) { vertices_[cursor[block]++] = v; });
}

void VerticesByBlock::for_each_block(
    const std::function<void(std::uint32_t block, std::span<const std::uint32_t>)>& body) const {
  std::vector<std::size_t> sizes(begin_.size() - 1);
  for (std::uint32_t block = 0; block < sizes.size(); ++block) sizes[block] = of(block).size();
  scarp::for_each_block(sizes, [&](std::uint32_t block) { body(block, of(block)); });
}

}  // namespace scarp
