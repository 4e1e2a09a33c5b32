// A public header: installed as scarp/core/frame.h.
#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include "core/vec3.h"

namespace scarp {

/// What happens at a pair of opposite lateral sides of the domain.
enum class Boundary { reflective, periodic };

/// The lateral sides of the domain: x and y are bounded, z is not.
///
/// Units: nm (for mesh files without a grid: the unit of the file).
struct Sides {
  std::array<double, 2> lower{};
  std::array<double, 2> upper{};
  std::array<Boundary, 2> boundary{Boundary::reflective, Boundary::reflective};
  /// Between sides of a square with lower corner at 0 the plane x = y is a reflective side, too:
  /// what it bounds is y <= x.
  bool diagonal = false;

  double width(int axis) const { return upper[axis] - lower[axis]; }
  double area() const { return (diagonal ? 0.5 : 1) * width(0) * width(1); }
};

/// The lattice on which a level set lives, centred on the origin.
///
/// Nodes 0..cells[axis] per lateral axis; nodes 0 and cells[axis] lie exactly on the sides. With
/// periodic sides the two are the same node. Along z node k lies at k * spacing, any integer k. In
/// two dimensions y is one cell wide and nothing varies along it.
///
/// Of a wafer that is its own mirror image only the half beyond the plane may be here: node 0 then
/// lies on the plane, at 0, which is a reflective side as any other. Of a quarter that is square
/// and its own mirror image across x = y only the facets with y <= x may be known; the nodes are
/// those of the quarter, and those with y > x have what their mirror images have.
///
/// A wafer may be the same all around the axis x = y = 0. The grid is then that of two dimensions,
/// a section through the axis, and runs go on half of it, from the axis on.
///
/// What depends on the kind of domain (in space, a slice, around an axis) is asked by the questions
/// below: only what reads and writes recipes and checkpoints knows two_dimensional
/// and axisymmetric.
///
/// Units: nm.
struct Frame {
  double spacing = 0;
  std::array<int, 2> cells{};
  std::array<Boundary, 2> boundary{Boundary::reflective, Boundary::reflective};
  bool two_dimensional = false;
  bool axisymmetric = false;   ///< in two dimensions
  std::array<bool, 2> half{};  ///< the other half is the mirror image
  /// x = y mirrors the quarter, too: facets, and nodes that are moved, are those with y <= x.
  bool diagonal = false;

  /// The index of the node, or of the place between two of them, that lies at 0.
  double middle(int axis) const { return axis == 2 || half[axis] ? 0 : 0.5 * cells[axis]; }

  /// Along how many of the lateral axes anything varies: x alone in sections.
  int lateral_axes() const { return two_dimensional ? 1 : 2; }
  bool varies_along(int axis) const { return axis == 2 || axis < lateral_axes(); }

  /// Whether facets go across one cell of y, and have no depth to be seen.
  bool is_section() const { return lateral_axes() == 1; }
  /// A section of what goes on endlessly along y: volumes are those of a slice one spacing thick.
  bool is_slice() const { return is_section() && !is_around_axis(); }
  /// A section through the axis of what is the same all around it.
  bool is_around_axis() const { return axisymmetric; }
  /// Whether x = y could be a plane of symmetry.
  bool is_square() const { return lateral_axes() == 2 && cells[0] == cells[1]; }

  /// Where a place is looked up: sections are known in the plane y = 0, so that both rows of nodes
  /// have the same to the last bit. Of a direction, its part in that plane.
  Vec3d in_section(Vec3d r) const { return is_section() ? Vec3d{r.x, 0, r.z} : r; }

  /// Nodes with values of their own; the second row of a section has those of the first.
  int own_nodes(int axis) const {
    if (!varies_along(axis)) return 1;
    return cells[axis] + (boundary[axis] == Boundary::periodic ? 0 : 1);
  }

  /// Antisymmetric about the middle to the last bit, so that a mirrored geometry gives mirrored
  /// numbers.
  double node_position(int axis, double index) const { return (index - middle(axis)) * spacing; }

  Vec3d node_position(const std::array<int, 3>& node) const {
    return {node_position(0, node[0]), node_position(1, node[1]), node_position(2, node[2])};
  }

  friend bool operator==(const Frame&, const Frame&) = default;

  /// How many mirror images of the grid, with itself, make up the whole wafer.
  int images() const { return (half[0] ? 2 : 1) * (half[1] ? 2 : 1); }
  /// The same of the facets.
  int facet_images() const { return images() * (diagonal ? 2 : 1); }

  /// How many times as large what lies at x is as it is here: what goes around the axis is as long
  /// as a half circle, and another one belongs to its mirror image.
  double around(double x) const {
    return is_around_axis() ? std::numbers::pi * std::abs(x) / spacing : 1;
  }

  /// Of a section through the axis, the frame of the wafer around it, which is as wide either way.
  Frame revolved() const {
    Frame frame = *this;
    frame.cells[1] = cells[0];
    frame.two_dimensional = false;
    frame.axisymmetric = false;
    return frame;
  }

  Sides sides() const {
    Sides sides;
    for (int axis = 0; axis < 2; ++axis) {
      sides.lower[axis] = node_position(axis, 0);
      sides.upper[axis] = node_position(axis, cells[axis]);
      sides.boundary[axis] = boundary[axis];
    }
    sides.diagonal = diagonal;
    return sides;
  }
};

}  // namespace scarp
