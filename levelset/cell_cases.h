#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace scarp {

/// Corner c of a cell lies at (c & 1, (c >> 1) & 1, c >> 2). Edge e runs along axis e / 4 from the
/// corner edge_corner(e).
inline constexpr int edge_corner(int edge) {
  const int axis = edge / 4;
  const int b = axis == 0 ? 1 : 0;
  const int c = axis == 2 ? 1 : 2;
  return ((edge & 1) << b) | (((edge >> 1) & 1) << c);
}

/// How the surface cuts a cell whose corners lie in the solid or in the gas.
struct CellCase {
  /// Closed chains of cut edges, counter-clockwise seen from the gas.
  std::vector<std::vector<int>> loops;
  /// The face of the cell that holds the segment from each edge of a loop to the next: face / 2 is
  /// the axis it is normal to, face % 2 tells the upper one.
  std::vector<std::vector<int>> faces;
  /// Triangles of every loop, as places in the loop.
  std::vector<std::vector<std::array<int, 3>>> triangles;
};

/// The case for a mask with bit c set if corner c lies in the solid.
const CellCase& cell_case(int solid_mask);

}  // namespace scarp
