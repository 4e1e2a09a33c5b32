#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/tri_mesh.h"

namespace scarp {

/// The vertices of a closed line.
using VertexLoop = std::vector<std::uint32_t>;

/// Covers a plane region with triangles whose corners are the vertices of its border.
///
/// Outer loops go counter-clockwise, holes clockwise; loops may touch in vertices. All vertices of
/// the loops are used and none is added, so that whatever shares the border fits. Where three
/// vertices lie on a line there may be triangles without an area, if there is no other way.
///
/// Shape:  points by the numbers that the loops have.
/// Cost:   square of the number of vertices at worst.
/// Source: ear clipping with bridges to holes (Eberly, "Triangulation by ear clipping").
std::vector<Triangle> triangulate(std::span<const std::array<double, 2>> points,
                                  std::vector<VertexLoop> loops);

}  // namespace scarp
