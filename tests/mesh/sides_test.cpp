#include "mesh/sides.h"

#include <gtest/gtest.h>

namespace scarp {
namespace {

TEST(SidePlanes, KnowTheirVertices) {
  const SidePlanes planes({.lower = {-5, 0}, .upper = {5, 8}});
  EXPECT_EQ(planes.mask({0, 4, 9}), 0);
  EXPECT_EQ(planes.mask({-5, 4, 9}), 0b0001);
  EXPECT_EQ(planes.mask({5, 4, 9}), 0b0010);
  EXPECT_EQ(planes.mask({0, 0, 9}), 0b0100);
  EXPECT_EQ(planes.mask({5, 8, 9}), 0b1010);
  EXPECT_TRUE(fixes(planes.mask({5, 8, 9}), 0));
  EXPECT_TRUE(is_corner(planes.mask({5, 8, 9})));
  EXPECT_FALSE(is_corner(planes.mask({5, 4, 9})));
}

TEST(SidePlanes, ForgiveTheRoundingOfFloatsAndNoMore) {
  const SidePlanes planes({.lower = {0, 0}, .upper = {0.3, 0.3}});
  EXPECT_EQ(planes.mask({0.3F, 0.1, 0}), 0b0010);
  EXPECT_EQ(planes.mask({0.2999, 0.1, 0}), 0);
}

TEST(SidePlanes, HoldWhatLiesBetweenThem) {
  const SidePlanes planes({.lower = {-5, 0}, .upper = {5, 8}});
  EXPECT_TRUE(planes.hold({0, 4, 1e9}));
  EXPECT_TRUE(planes.hold({-5, 8.000001, 0}));
  EXPECT_FALSE(planes.hold({-5.001, 4, 0}));
  EXPECT_FALSE(planes.hold({5.001, 4, 0}));
  EXPECT_FALSE(planes.hold({0, -0.001, 0}));
  EXPECT_FALSE(planes.hold({0, 8.001, 0}));
  EXPECT_TRUE(SidePlanes(Sides{}).hold({7, 7, 7}));
}

TEST(SidePlanes, TheDiagonalIsOneOfThem) {
  const SidePlanes planes({.lower = {0, 0}, .upper = {8, 8}, .diagonal = true});
  EXPECT_EQ(planes.mask({5, 4, 9}), 0);
  EXPECT_EQ(planes.mask({5, 5, 9}), on_diagonal);
  EXPECT_EQ(planes.mask({5, 5 - 1e-6, 9}), 0);
  EXPECT_FALSE(is_corner(planes.mask({5, 5, 9})));
  EXPECT_TRUE(is_corner(planes.mask({8, 8, 9})));
  EXPECT_TRUE(planes.hold({5, 5, 9}));
  EXPECT_FALSE(planes.hold({5, 5.001, 9}));
  EXPECT_EQ(along_sides(on_diagonal, {1, 3, 7}), (Vec3d{2, 2, 7}));
  EXPECT_EQ(along_sides(planes.mask({8, 8, 9}), {1, 3, 7}), (Vec3d{0, 0, 7}));
  EXPECT_EQ(along_sides(planes.mask({8, 4, 9}), {1, 3, 7}), (Vec3d{0, 3, 7}));
}

TEST(SidePlanes, WithoutAWidthAreNone) { EXPECT_EQ(SidePlanes(Sides{}).mask({0, 0, 0}), 0); }

}  // namespace
}  // namespace scarp
