#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/tri_mesh.h"
#include "levelset/surface/cell_cases.h"
#include "levelset/surface/surface_vertices.h"

namespace scarp {

/// A corner of a triangle before the parts are put together: a number and, in the upper bits, what
/// it counts.
struct Corner {
  static constexpr std::uint32_t kind_bit = 29;
  static constexpr std::uint32_t most = 1U << kind_bit;
  static constexpr std::uint32_t in_cell = 4;  ///< a corner inside a cell of the same part
  static constexpr std::uint32_t none = ~0U;

  /// 0: a vertex on the grid; 1, 2, 3: its copy on the upper periodic side along x, y, both.
  static std::uint32_t kind(std::uint32_t corner) { return corner >> kind_bit; }
  static std::uint32_t number(std::uint32_t corner) { return corner & (most - 1); }
  static std::uint32_t of(std::uint32_t kind, std::uint32_t number) {
    return kind << kind_bit | number;
  }
};

/// What the cells of a few leaves add to the mesh.
struct PartTriangles {
  std::vector<Triangle> triangles;  ///< of Corners
  std::vector<Vec3f> cell_vertices;
  bool plain = true;  ///< all corners are vertices on the grid

  /// Memory is kept.
  void clear() {
    triangles.clear();
    cell_vertices.clear();
    plain = true;
  }
};

/// Cuts the cells that start at the nodes of a leaf into triangles, one leaf after the other.
class TriangleMaker {
 public:
  TriangleMaker(const Band& band, const SurfaceVertices& vertices)
      : band_(band), vertices_(vertices) {}

  void add_leaf(std::size_t n, PartTriangles& part);

 private:
  struct Cell;

  void number_own(const CellLeaves& leaves);
  void number_upper(const CellLeaves& leaves, int upper);
  void add_smooth(const CellLeaves& leaves, const CellWords& words, PartTriangles& part);
  void add_creased(const CellLeaves& leaves, const CellWords& words, PartTriangles& part);
  void add_plain_loop(const Cell& cell, const CellLoop& loop, PartTriangles& part) const;
  bool add_creased_loop(const Cell& cell, const CellLoop& loop, PartTriangles& part) const;
  std::uint32_t corner_in_cell(const Cell& cell, const CellLoop& loop, PartTriangles& part) const;

  /// The nodes of a leaf's cells, nine along each axis, and what starts there.
  static constexpr int node_stride = LeafVertices::kind_count;
  static constexpr std::array<int, 3> strides{81 * node_stride, 9 * node_stride, node_stride};
  static int place(int i, int j, int k) { return i * strides[0] + j * strides[1] + k * strides[2]; }
  static const std::array<int, 12> edge_places;
  static const std::array<int, 6> face_places;

  std::uint32_t& corner(int place) { return corners_[static_cast<std::size_t>(place)]; }
  std::uint32_t corner(int place) const { return corners_[static_cast<std::size_t>(place)]; }

  const Band& band_;
  const SurfaceVertices& vertices_;
  std::array<std::uint32_t, std::size_t{9} * 9 * 9 * node_stride> corners_;  ///< by place
};

}  // namespace scarp
