#include "levelset/surface/cell_cases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <set>

namespace scarp {
namespace {

/// The two corners of an edge.
std::array<int, 2> corners_of(int edge) {
  return {edge_corner(edge), edge_corner(edge) | 1 << edge / 4};
}

/// Whether a face of the cell holds an edge: both corners lie on its side.
bool holds(int face, int edge) {
  const auto lies_in = [face](int corner) { return ((corner >> face / 2) & 1) == face % 2; };
  const std::array<int, 2> corners = corners_of(edge);
  return std::ranges::all_of(corners, lies_in);
}

bool share_a_face(int a, int b) {
  for (int face = 0; face < 6; ++face)
    if (holds(face, a) && holds(face, b)) return true;
  return false;
}

TEST(CellCases, LoopsGoThroughAllCutEdgesOnce) {
  for (int mask = 0; mask < 256; ++mask) {
    const CellCase& cell = cell_cases()[static_cast<std::size_t>(mask)];
    std::multiset<int> found;
    for (int n = 0; n < cell.loop_count; ++n) {
      const CellLoop& loop = cell.loops[static_cast<std::size_t>(n)];
      ASSERT_GE(loop.edge_count, 3);
      for (int e = 0; e < loop.edge_count; ++e) {
        const int next = loop.edges[static_cast<std::size_t>((e + 1) % loop.edge_count)];
        const auto at = static_cast<std::size_t>(e);
        found.insert(loop.edges[at]);
        EXPECT_TRUE(holds(loop.faces[at], loop.edges[at]) && holds(loop.faces[at], next)) << mask;
      }
    }
    std::multiset<int> expected;
    for (int edge = 0; edge < 12; ++edge) {
      const auto [a, b] = corners_of(edge);
      if (((mask >> a) & 1) != ((mask >> b) & 1)) expected.insert(edge);
    }
    EXPECT_EQ(found, expected) << mask;
  }
}

// There it could meet the same edge of the neighbour.
TEST(CellCases, NoInnerEdgeOfALoopLiesInAFace) {
  for (int mask = 0; mask < 256; ++mask) {
    const CellCase& cell = cell_cases()[static_cast<std::size_t>(mask)];
    for (int n = 0; n < cell.loop_count; ++n) {
      const CellLoop& loop = cell.loops[static_cast<std::size_t>(n)];
      std::multiset<std::array<int, 2>> sides;
      for (int t = 0; t < loop.triangle_count(); ++t) {
        const auto& triangle = loop.triangles[static_cast<std::size_t>(t)];
        for (std::size_t k = 0; k < 3; ++k) {
          const int a = triangle[k];
          const int b = triangle[(k + 1) % 3];
          sides.insert({std::min(a, b), std::max(a, b)});
          const bool is_rim = std::abs(a - b) == 1 || std::abs(a - b) == loop.edge_count - 1;
          EXPECT_TRUE(is_rim || !share_a_face(loop.edges[a], loop.edges[b])) << mask;
        }
      }
      // Once along the rim, twice within.
      for (const auto& side : sides) {
        const int apart = side[1] - side[0];
        EXPECT_EQ(sides.count(side), apart == 1 || apart == loop.edge_count - 1 ? 1U : 2U) << mask;
      }
    }
  }
}

}  // namespace
}  // namespace scarp
