#include "mesh/blocks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "mesh/cube_lattice.h"

namespace scarp {

namespace {

/// Small enough for a core's cache, large enough that the seam is thin.
constexpr double vertices_per_block = 4000;

/// Where the cuts lie, in cubes: each pass is far from the cuts of those before it.
constexpr double shifts[]{0, 0.5, 0.25, 0.75};

/// Where a periodic mesh is cut open, in cubes before its upper side: so that the sides are then in
/// the middle of cubes.
constexpr double openings[]{0.5, 0.95, 0.3, 0.7};

constexpr std::size_t grain = 8192;

constexpr std::uint32_t no_block = 0xffffffffU;

/// Cubes over the live vertices, cut where the pass says. A periodic mesh is cut open before its
/// upper side; what lies behind goes one period down.
class Cubes {
 public:
  Cubes(const CollapseMesh& mesh, int pass) {
    Box box = box_of(mesh);
    const double size = size_of(mesh);
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
  static Box box_of(const CollapseMesh& mesh);
  /// So that a cube has its share of the area.
  static double size_of(const CollapseMesh& mesh);

  CubeLattice lattice_;
  std::array<double, 2> period_{};
  Vec3d end_;
};

Box Cubes::box_of(const CollapseMesh& mesh) {
  const auto box_of_range = [&mesh](std::size_t begin, std::size_t end) {
    Box box;
    for (auto v = static_cast<std::uint32_t>(begin); v < end; ++v) {
      if (mesh.topology.outgoing(v) != HalfEdges::none) box.add(mesh.r[v]);
    }
    return box;
  };
  return parallel_reduce(mesh.r.size(), grain, Box{}, box_of_range, [](Box all, const Box& part) {
    all.add(part.lower);
    all.add(part.upper);
    return all;
  });
}

double Cubes::size_of(const CollapseMesh& mesh) {
  // Some living facets stand for all, of which there are two to a vertex.
  constexpr std::uint32_t stride = 7;
  double twice_area = 0;
  std::uint32_t count = 0;
  for (std::uint32_t f = 0; f < mesh.normals.size(); f += stride) {
    if (!mesh.topology.alive(f)) continue;
    twice_area += length(mesh.normals[f]);
    ++count;
  }
  // Of a few regular facets all that are looked at may be gone: then one cube holds all.
  return count > 0 ? std::sqrt(twice_area / count * vertices_per_block)
                   : std::numeric_limits<double>::max();
}

}  // namespace

Blocks::Blocks(const CollapseMesh& mesh, int pass) : block_(mesh.r.size(), no_block) {
  const Cubes cubes(mesh, pass);
  parallel_for(block_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (auto v = static_cast<std::uint32_t>(begin); v < end; ++v) {
      if (mesh.topology.outgoing(v) != HalfEdges::none) block_[v] = cubes.of(mesh.r[v]);
    }
  });
  std::vector<std::uint32_t> vertices_in(cubes.count(), 0);
  for (const std::uint32_t cube : block_) {
    if (cube != no_block) ++vertices_in[cube];
  }
  // Empty cubes are no blocks.
  std::vector<std::uint32_t> number(cubes.count(), no_block);
  begin_ = {0};
  for (std::uint32_t cube = 0; cube < number.size(); ++cube) {
    if (vertices_in[cube] == 0) continue;
    number[cube] = count();
    begin_.push_back(begin_.back() + vertices_in[cube]);
  }
  vertices_.resize(begin_.back());
  std::vector<std::uint32_t> cursor(begin_.begin(), begin_.end() - 1);
  for (std::uint32_t v = 0; v < block_.size(); ++v) {
    if (block_[v] == no_block) continue;
    block_[v] = number[block_[v]];
    vertices_[cursor[block_[v]]++] = v;
  }
}

Blocks Blocks::whole(const CollapseMesh& mesh) {
  Blocks blocks;
  blocks.block_.assign(mesh.r.size(), 0);
  for (std::uint32_t v = 0; v < mesh.r.size(); ++v) {
    if (mesh.topology.outgoing(v) != HalfEdges::none) blocks.vertices_.push_back(v);
  }
  blocks.begin_ = {0, static_cast<std::uint32_t>(blocks.vertices_.size())};
  return blocks;
}

}  // namespace scarp
