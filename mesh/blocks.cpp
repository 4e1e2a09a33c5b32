#include "mesh/blocks.h"

#include <array>
#include <cmath>

namespace scarp {

namespace {

/// Small enough for a core's cache, large enough that the seam is thin.
constexpr double vertices_per_block = 4000;

/// Where the cuts lie, in cubes: each pass is far from the cuts of those before it.
constexpr double shifts[]{0, 0.5, 0.25, 0.75};

constexpr std::uint32_t no_block = 0xffffffffU;

/// A lattice of cubes over the live vertices.
class Cubes {
 public:
  Cubes(const CollapseMesh& mesh, int pass) {
    Box box;
    double twice_area = 0;
    for (std::uint32_t v = 0; v < mesh.r.size(); ++v) {
      if (mesh.topology.outgoing(v) != HalfEdges::none) box.add(mesh.r[v]);
    }
    for (std::uint32_t f = 0; f < mesh.normals.size(); ++f) {
      if (mesh.topology.alive(f)) twice_area += length(mesh.normals[f]);
    }
    const double size =
        std::sqrt(0.5 * twice_area * vertices_per_block / std::max<double>(mesh.live_vertices, 1));
    // A surface that is crumpled beyond that in its box has larger blocks.
    constexpr double most_per_axis = 100;
    const Vec3d extent = box.upper - box.lower;
    const double longest = std::max({extent.x, extent.y, extent.z});
    size_ = std::max({size, longest / most_per_axis, 1e-300});
    const double shift = shifts[pass % 4] * size_;
    origin_ = box.lower - Vec3d{shift, shift, shift};
    for (int axis = 0; axis < 3; ++axis) count_[axis] = index(box.upper, axis) + 1;
  }

  std::uint32_t count() const { return count_[0] * count_[1] * count_[2]; }
  std::uint32_t of(Vec3d r) const {
    return (index(r, 2) * count_[1] + index(r, 1)) * count_[0] + index(r, 0);
  }

 private:
  std::uint32_t index(Vec3d r, int axis) const {
    return static_cast<std::uint32_t>((r[axis] - origin_[axis]) / size_);
  }

  double size_ = 1;
  Vec3d origin_;
  std::array<std::uint32_t, 3> count_{};
};

}  // namespace

Blocks::Blocks(const CollapseMesh& mesh, int pass) : block_(mesh.r.size(), no_block) {
  const Cubes cubes(mesh, pass);
  std::vector<std::uint32_t> vertices_in(cubes.count(), 0);
  for (std::uint32_t v = 0; v < block_.size(); ++v) {
    if (mesh.topology.outgoing(v) == HalfEdges::none) continue;
    block_[v] = cubes.of(mesh.r[v]);
    ++vertices_in[block_[v]];
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

}  // namespace scarp
