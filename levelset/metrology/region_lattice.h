#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/grid/layers.h"

namespace scarp {

/// The layers that add a material, and between which heights their surfaces lie.
struct MeshedStack {
  std::vector<const Layer*> layers;
  double lower = 0;
  double upper = 0;

  int count() const { return static_cast<int>(layers.size()); }
};

MeshedStack meshed_stack(const Layers& layers);

/// The nodes and cells that the surfaces of a wafer cut, from its bottom to the lid.
///
/// Planes of nodes are those of the grid where surfaces are; beyond, they are further and further
/// apart. A section around an axis begins there.
class RegionLattice {
 public:
  /// Also a cell, by its lowest node.
  using Node = std::array<int, 3>;

  RegionLattice(const Layers& layers, double bottom, std::optional<double> lid);

  const Frame& frame() const { return frame_; }
  const MeshedStack& stack() const { return stack_; }
  bool is_periodic(int axis) const {
    return frame_.varies_along(axis) &&
           frame_.boundary[static_cast<std::size_t>(axis)] == Boundary::periodic;
  }

  std::size_t node_count() const { return index({0, 0, nodes_[2]}); }
  std::size_t index(const Node& n) const {
    const auto at = [](int i) { return static_cast<std::size_t>(i); };
    return (at(n[2]) * at(nodes_[1]) + at(n[1])) * at(nodes_[0]) + at(n[0]);
  }
  bool has(const Node& n) const;
  /// The one at the upper end of each axis.
  Node last_node() const { return {nodes_[0] - 1, nodes_[1] - 1, nodes_[2] - 1}; }

  Vec3d position(const Node& n) const;
  /// Those of the domain that it lies on: a bit each.
  std::uint8_t sides(const Node& n) const;

  /// phi of the layers in spacings; a film that is too thin is none.
  void read_values(const Node& n, std::vector<double>& values) const;
  /// The lowest layer that such values are inside of, or the number of layers.
  int label_of(const std::vector<double>& values) const;

  /// Calls do_it(node) for all nodes.
  template <class F>
  void for_each_node(const F& do_it) const {
    for_each(nodes_, do_it);
  }
  /// Calls do_it(lowest node) for all cells.
  template <class F>
  void for_each_cell(const F& do_it) const {
    for_each(last_node(), do_it);
  }

  static Node corner(const Node& cell, unsigned n) {
    return {cell[0] + static_cast<int>(n & 1U), cell[1] + static_cast<int>(n >> 1U & 1U),
            cell[2] + static_cast<int>(n >> 2U)};
  }

  struct SideFace {
    int side = 0;
    std::array<Node, 4> corners;  ///< counter-clockwise seen from outside, a diagonal's end first
  };
  /// The faces of a cell that lie on sides of the domain.
  std::vector<SideFace> side_faces(const Node& cell) const;

 private:
  void add_planes(double bottom, double top);

  template <class F>
  static void for_each(const Node& count, const F& do_it) {
    for (int k = 0; k < count[2]; ++k)
      for (int j = 0; j < count[1]; ++j)
        for (int i = 0; i < count[0]; ++i) do_it(Node{i, j, k});
  }

  Frame frame_;
  MeshedStack stack_;
  int first_;                     ///< node of the grid at the lower side
  std::vector<double> z_;         ///< of planes of nodes
  std::vector<int> grid_planes_;  ///< of the grid, or below or above all surfaces
  Node nodes_{};                  ///< how many along each axis
};

}  // namespace scarp
