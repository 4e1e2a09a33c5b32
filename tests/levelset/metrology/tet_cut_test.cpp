#include "levelset/metrology/tet_cut.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>

namespace scarp {
namespace {

double volume(const CutVertices& vertices, const std::array<std::uint32_t, 4>& tet) {
  const Vec3d a = vertices.position(tet[0]);
  return dot(vertices.position(tet[1]) - a,
             cross(vertices.position(tet[2]) - a, vertices.position(tet[3]) - a)) /
         6;
}

TEST(TetCut, APlaneCutsACornerOff) {
  CutVertices vertices(1, 0);
  const std::array<Vec3d, 4> r{Vec3d{0, 0, 0}, Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
  for (const Vec3d& place : r) {
    const double value = place.x + place.y + place.z - 0.5;
    vertices.add(place, 0, &value);
  }
  std::vector<CutTet> pieces;
  cut_tet({0, 1, 2, 3}, vertices, pieces);
  std::array<double, 2> volumes{};
  for (const CutTet& piece : pieces)
    volumes[static_cast<std::size_t>(piece.label)] += volume(vertices, piece.v);
  EXPECT_NEAR(volumes[0], 1.0 / 48, 1e-15);
  EXPECT_NEAR(volumes[1], 7.0 / 48, 1e-15);
  EXPECT_EQ(vertices.size(), 7U);
}

// Cubes with random values of three nested surfaces, some of them the same or zero.
TEST(TetCut, PiecesFitAndFillTheWhole) {
  constexpr std::uint32_t nodes = 4;
  std::mt19937 random(7);
  CutVertices vertices(3, 0.02);
  const auto draw = [&] { return static_cast<double>(random() % 200) / 100; };
  for (std::uint32_t n = 0; n < nodes * nodes * nodes; ++n) {
    std::array<double, 3> values{draw() - 0.5, 0, 0};
    for (std::size_t m = 1; m < 3; ++m)
      values[m] = values[m - 1] - (random() % 3 == 0 ? 0 : draw() / 2);
    if (random() % 4 == 0) values[2] = std::min(0.0, values[1]);
    vertices.add({1.0 * (n % nodes), 1.0 * static_cast<int>(n / nodes % nodes),
                  1.0 * static_cast<int>(n / nodes / nodes)},
                 0, values.data());
  }
  std::vector<CutTet> pieces;
  for (std::uint32_t n = 0; n < nodes * nodes * nodes; ++n) {
    if (n % nodes == nodes - 1 || n / nodes % nodes == nodes - 1 || n / nodes / nodes == nodes - 1)
      continue;
    std::array<std::uint32_t, 3> steps{1, nodes, nodes * nodes};
    do {  // around the diagonal; every second order is turned over
      std::array<std::uint32_t, 4> tet{n, n + steps[0], n + steps[0] + steps[1],
                                       n + steps[0] + steps[1] + steps[2]};
      if (volume(vertices, tet) < 0) std::swap(tet[0], tet[1]);
      cut_tet(tet, vertices, pieces);
    } while (std::ranges::next_permutation(steps).found);
  }
  double whole = 0;
  std::map<std::array<std::uint32_t, 3>, int> faces;
  for (const CutTet& piece : pieces) {
    const double own = volume(vertices, piece.v);
    EXPECT_GE(own, -1e-12);
    whole += own;
    for (std::size_t skipped = 0; skipped < 4; ++skipped) {
      std::array<std::uint32_t, 3> face{};
      for (std::size_t c = 0, k = 0; c < 4; ++c)
        if (c != skipped) face[k++] = piece.v[c];
      std::ranges::sort(face);
      ++faces[face];
    }
    // All of it lies on one side of each surface.
    for (const std::uint32_t v : piece.v) {
      for (int m = 0; m < 3; ++m) {
        const double value = vertices.value(v, m);
        EXPECT_TRUE(m > piece.label || (m < piece.label ? value >= 0 : value <= 0));
      }
    }
  }
  EXPECT_NEAR(whole, 27, 1e-9);
  int alone = 0;
  for (const auto& [face, count] : faces) {
    EXPECT_LE(count, 2);
    if (count == 2) continue;
    ++alone;
    bool is_outside = false;
    for (int axis = 0; axis < 3; ++axis) {
      for (const double side : {0.0, nodes - 1.0}) {
        is_outside = is_outside || std::ranges::all_of(face, [&](std::uint32_t v) {
                       return vertices.position(v)[axis] == side;
                     });
      }
    }
    EXPECT_TRUE(is_outside);
  }
  EXPECT_GE(alone, 6 * 9 * 2);
}

}  // namespace
}  // namespace scarp
