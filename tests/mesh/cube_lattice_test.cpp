#include "mesh/cube_lattice.h"

#include <gtest/gtest.h>

#include <cmath>

namespace scarp {
namespace {

const Box box{{-1, 0, 2}, {3, 5, 8}};

TEST(CubeLattice, NumbersCubesWithXFastest) {
  const CubeLattice cubes(box, 1.5, 0);
  EXPECT_EQ(cubes.count(), 3U * 4U * 5U);
  EXPECT_EQ(cubes.of({-1, 0, 2}), 0U);
  EXPECT_EQ(cubes.of({0.6, 0, 2}), 1U);
  EXPECT_EQ(cubes.of({-1, 1.6, 2}), 3U);
  EXPECT_EQ(cubes.of({-1, 0, 3.6}), 12U);
  EXPECT_EQ(cubes.of({3, 5, 8}), cubes.count() - 1);
}

TEST(CubeLattice, IsShiftedByAPartOfItsSize) {
  const CubeLattice cubes(box, 2, 0.5);
  EXPECT_EQ(cubes.of({-0.1, 0, 2}), 0U) << "the first cube begins at -2";
  EXPECT_EQ(cubes.of({0.1, 0, 2}), 1U);
}

TEST(CubeLattice, PlacesOutsideBelongToTheNearestCube) {
  const CubeLattice cubes(box, 1.5, 0);
  EXPECT_EQ(cubes.of({-1e30, -1e30, -1e30}), 0U);
  EXPECT_EQ(cubes.of({1e30, 1e30, 1e30}), cubes.count() - 1);
  EXPECT_EQ(cubes.of({std::nan(""), 0, 2}), 0U);
}

TEST(CubeLattice, HasFewCubesInALongBox) {
  EXPECT_LE(CubeLattice({{0, 0, 0}, {1e6, 1, 1}}, 1, 0).count(), 128U);
  EXPECT_EQ(CubeLattice({{1, 1, 1}, {1, 1, 1}}, 0, 0).count(), 1U);
}

}  // namespace
}  // namespace scarp
