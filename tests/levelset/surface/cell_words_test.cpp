#include "levelset/surface/cell_words.h"

#include <gtest/gtest.h>

#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

/// A wavy surface that goes through all sides; the domain ends amid leaves or at their ends.
Layers waves(const Frame& frame) {
  const double period = 2 * std::numbers::pi / frame.cells[0];
  return single_layer(
      frame,
      [=](Vec3d r) { return 0.5 * (r.z - 3.3 * std::sin(period * r.x + 0.7) * std::cos(r.y)); },
      -12, 12);
}

std::vector<LeafMask> solid_nodes(const Band& band) {
  std::vector<LeafMask> solid(band.leaves().size());
  for (std::size_t n = 0; n < solid.size(); ++n) {
    for (int node = 0; node < leaf_size; ++node) {
      const std::uint64_t bit = band.leaves()[n].phi[node] < 0 ? 1 : 0;
      solid[n][node >> 6] |= bit << (node & 63);
    }
  }
  return solid;
}

/// Which corners of the cell that starts at a node lie in the solid.
int solid_corners(const Band& band, Node node) {
  int mask = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const float phi =
        band.node(node[0] + (corner & 1), node[1] + (corner >> 1 & 1), node[2] + (corner >> 2));
    mask |= (phi < 0 ? 1 : 0) << corner;
  }
  return mask;
}

bool is_mixed(int corners, int of) { return (corners & of) != 0 && (corners & of) != of; }

class CellWordsTest : public testing::TestWithParam<std::tuple<int, int, Boundary>> {};

TEST_P(CellWordsTest, CutsAreWhereSignsDifferAndEndWithTheDomain) {
  const auto [cells_x, cells_y, boundary] = GetParam();
  const Frame frame{.spacing = 1, .cells = {cells_x, cells_y}, .boundary = {boundary, boundary}};
  const Layers layers = waves(frame);
  const Band& band = layers.top().band();
  const std::vector<LeafMask> solid = solid_nodes(band);
  int cut_cell_count = 0;
  for (std::size_t n = 0; n < solid.size(); ++n) {
    const CellLeaves leaves(band, n);
    const CellWords words(leaves, solid);
    for (int offset = 0; offset < leaf_size; ++offset) {
      const Node node = node_at(band.leaves()[n], offset);
      const int i = offset >> 6;
      const int bit = offset & 63;
      const int corners = solid_corners(band, node);
      const bool is_node = node[0] < band.node_count(0) && node[1] < band.node_count(1);
      const std::array<bool, 3> has{is_node && node[0] < cells_x, is_node && node[1] < cells_y,
                                    is_node};
      for (int axis = 0; axis < 3; ++axis) {
        const int b = (axis + 1) % 3;
        const int c = (axis + 2) % 3;
        EXPECT_EQ(words.cut_edges(axis, i) >> bit & 1,
                  has[axis] && is_mixed(corners, 1 | 1 << (1 << axis)));
        EXPECT_EQ(words.cut_faces(axis, i) >> bit & 1,
                  has[b] && has[c] && is_mixed(corners, std::array{0x55, 0x33, 0x0f}[axis]));
      }
      const bool is_cut = has[0] && has[1] && is_mixed(corners, 0xff);
      ASSERT_EQ(words.cut_cells(i) >> bit & 1, is_cut);
      if (is_cut) {
        EXPECT_EQ(words.corners(i, bit), corners);
        ++cut_cell_count;
      }
    }
  }
  EXPECT_GT(cut_cell_count, cells_x * cells_y);
}

INSTANTIATE_TEST_SUITE_P(Domains, CellWordsTest,
                         testing::Combine(testing::Values(15, 16, 17, 21), testing::Values(1, 24),
                                          testing::Values(Boundary::reflective,
                                                          Boundary::periodic)));

}  // namespace
}  // namespace scarp
