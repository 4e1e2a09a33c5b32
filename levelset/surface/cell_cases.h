#pragma once

#include <array>
#include <cstdint>

namespace scarp {

/// Corner c of a cell lies at (c & 1, (c >> 1) & 1, c >> 2). Edge e runs along axis e / 4 from the
/// corner edge_corner(e).
inline constexpr int edge_corner(int edge) {
  const int axis = edge / 4;
  const int b = axis == 0 ? 1 : 0;
  const int c = axis == 2 ? 1 : 2;
  return ((edge & 1) << b) | (((edge >> 1) & 1) << c);
}

/// A closed chain of cut edges, counter-clockwise seen from the gas.
struct CellLoop {
  int edge_count = 0;
  std::array<std::uint8_t, 12> edges{};
  /// The face of the cell that holds the segment from each edge to the next: face / 2 is the axis
  /// it is normal to, face % 2 tells the upper one.
  std::array<std::uint8_t, 12> faces{};
  /// As places in the loop; two less than there are edges.
  std::array<std::array<std::uint8_t, 3>, 10> triangles{};

  int triangle_count() const { return edge_count - 2; }
};

/// How the surface cuts a cell whose corners lie in the solid or in the gas.
struct CellCase {
  int loop_count = 0;
  std::array<CellLoop, 4> loops{};
};

/// The cases of all masks with bit c set if corner c lies in the solid.
const std::array<CellCase, 256>& cell_cases();

}  // namespace scarp
