#include "levelset/metrology/region_cells.h"

#include <algorithm>
#include <array>
#include <utility>

#include "levelset/metrology/region_surface.h"

namespace scarp {

namespace {

using Node = RegionLattice::Node;

constexpr std::uint32_t none = RegionCells::none;

/// Nodes nearer to a surface than this, in spacings, are moved onto it. Twice that is less than the
/// least altitude of a tetrahedron, 0.7: none turns over.
constexpr double reach = 0.25;

/// The six tetrahedra of a cell lie around its diagonal: along three axes in any order.
constexpr std::array<std::array<unsigned, 4>, 6> tetrahedra{
    {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};

/// The cut of one lattice.
class CellCut {
 public:
  explicit CellCut(const RegionLattice& lattice)
      : lattice_(lattice),
        cells_{.vertices = CutVertices(lattice.stack().count(), thinnest_meshed_film),
               .tets = {},
               .labels = {},
               .is_cut = {},
               .numbers = {},
               .nodes = {},
               .is_moved = {}},
        values_(lattice.stack().layers.size()) {}

  RegionCells run() {
    label_nodes();
    find_mixed_cells();
    number_nodes();
    move_nodes();
    find_cut_cells();
    number_other_nodes();
    cut();
    return std::move(cells_);
  }

 private:
  void label_nodes() {
    cells_.labels.resize(lattice_.node_count());
    lattice_.for_each_node([&](const Node& n) {
      lattice_.read_values(n, values_);
      cells_.labels[lattice_.index(n)] = static_cast<std::uint8_t>(lattice_.label_of(values_));
    });
  }

  void find_mixed_cells() {
    is_mixed_.resize(lattice_.node_count());
    lattice_.for_each_cell([&](const Node& cell) {
      const std::size_t c = lattice_.index(cell);
      for (unsigned n = 1; n < 8; ++n)
        if (cells_.labels[lattice_.index(RegionLattice::corner(cell, n))] != cells_.labels[c])
          is_mixed_[c] = true;
    });
  }

  /// Nodes of mixed cells are vertices.
  void number_nodes() {
    cells_.numbers.assign(lattice_.node_count(), none);
    lattice_.for_each_cell([&](const Node& cell) {
      if (is_mixed_[lattice_.index(cell)]) number_corners(cell);
    });
  }

  void number_corners(const Node& cell) {
    for (unsigned n = 0; n < 8; ++n) number_node(RegionLattice::corner(cell, n));
  }

  void number_node(const Node& n) {
    std::uint32_t& number = cells_.numbers[lattice_.index(n)];
    if (number != none) return;
    lattice_.read_values(n, values_);
    number = cells_.vertices.add(lattice_.position(n), lattice_.sides(n), values_.data());
    cells_.nodes.push_back(n);
    cells_.is_moved.push_back(false);
  }

  /// Where the nearest surface cuts an edge of the lattice at a node.
  struct NearestCut {
    double distance = 0;
    std::uint32_t other = none;
    int surface = 0;
    double part = 0;
  };

  NearestCut nearest_cut(std::uint32_t v) const {
    NearestCut nearest{.distance = reach * lattice_.frame().spacing};
    // The edges of a cube's six tetrahedra go along one, two or all axes in one direction.
    for (int direction = -1; direction <= 1; direction += 2) {
      for (unsigned step = 1; step < 8; ++step) {
        Node n = cells_.nodes[v];
        for (unsigned axis = 0; axis < 3; ++axis)
          if ((step >> axis & 1U) != 0) n[axis] += direction;
        if (!lattice_.has(n)) continue;
        const std::uint32_t other = cells_.numbers[lattice_.index(n)];
        if (other == none || (cells_.vertices.sides(v) & ~cells_.vertices.sides(other)) != 0)
          continue;
        look_along(v, other, nearest);
      }
    }
    return nearest;
  }

  void look_along(std::uint32_t v, std::uint32_t other, NearestCut& nearest) const {
    const CutVertices& vertices = cells_.vertices;
    const double edge = length(vertices.position(other) - vertices.position(v));
    for (int m = 0; m < vertices.surface_count(); ++m) {
      const double a = vertices.value(v, m);
      const double b = vertices.value(other, m);
      if ((a < 0) == (b < 0)) continue;
      const double part = a / (a - b);
      if (part * edge < nearest.distance)
        nearest = {.distance = part * edge, .other = other, .surface = m, .part = part};
    }
  }

  /// Where nodes and values go depends on where they were alone.
  void move_nodes() {
    const CutVertices& vertices = cells_.vertices;
    CutVertices moved(vertices.surface_count(), thinnest_meshed_film);
    for (std::uint32_t v = 0; v < vertices.size(); ++v) {
      const NearestCut cut = nearest_cut(v);
      Vec3d r = vertices.position(v);
      std::copy_n(vertices.values(v), values_.size(), values_.begin());
      if (cut.other != none) {
        r += cut.part * (vertices.position(cut.other) - r);
        values_between(vertices.values(v), vertices.values(cut.other), cut.part, cut.surface,
                       vertices.surface_count(), thinnest_meshed_film, values_.data());
        cells_.is_moved[v] = true;
      }
      moved.add(r, vertices.sides(v), values_.data());
    }
    cells_.vertices = std::move(moved);
  }

  /// Three moved nodes could have a face between cells lie in a surface.
  void find_cut_cells() {
    cells_.is_cut.resize(lattice_.node_count());
    lattice_.for_each_cell([&](const Node& cell) {
      int moved = 0;
      for (unsigned n = 0; n < 8; ++n)
        moved += cells_.is_inner(lattice_.index(RegionLattice::corner(cell, n))) ? 0 : 1;
      const std::size_t c = lattice_.index(cell);
      cells_.is_cut[c] = is_mixed_[c] || moved >= 3;
    });
  }

  /// Those of cells that are cut and not mixed, and those of faces on sides. They come before all
  /// vertices that are no nodes.
  void number_other_nodes() {
    lattice_.for_each_cell([&](const Node& cell) {
      if (cells_.is_cut[lattice_.index(cell)]) {
        number_corners(cell);
        return;
      }
      for (const RegionLattice::SideFace& face : lattice_.side_faces(cell))
        for (const Node& n : face.corners) number_node(n);
    });
  }

  void cut() {
    lattice_.for_each_cell([&](const Node& cell) {
      if (!cells_.is_cut[lattice_.index(cell)]) return;
      for (const auto& tet : tetrahedra) {
        std::array<std::uint32_t, 4> v{};
        for (std::size_t n = 0; n < 4; ++n)
          v[n] = cells_.numbers[lattice_.index(RegionLattice::corner(cell, tet[n]))];
        cut_tet(v, cells_.vertices, cells_.tets);
      }
    });
  }

  const RegionLattice& lattice_;
  RegionCells cells_;
  std::vector<bool> is_mixed_;  ///< of cells
  std::vector<double> values_;  ///< room for those of a node
};

}  // namespace

Node inner_corner(const RegionLattice& lattice, const RegionCells& cells, const Node& cell) {
  unsigned n = 0;
  while (!cells.is_inner(lattice.index(RegionLattice::corner(cell, n)))) ++n;
  return RegionLattice::corner(cell, n);
}

RegionCells cut_cells(const RegionLattice& lattice) { return CellCut(lattice).run(); }

}  // namespace scarp
