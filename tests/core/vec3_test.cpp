#include "core/vec3.h"

#include <gtest/gtest.h>

namespace scarp {
namespace {

TEST(Vec3, FollowsTheRulesOfVectors) {
  const Vec3d a{1, 2, 3};
  const Vec3d b{-4, 0, 5};
  EXPECT_EQ(a + b, (Vec3d{-3, 2, 8}));
  EXPECT_EQ(a - b, (Vec3d{5, 2, -2}));
  EXPECT_EQ(2.0 * a, a * 2.0);
  EXPECT_EQ(a / 2.0, (Vec3d{0.5, 1, 1.5}));
  EXPECT_EQ(dot(a, b), 11);
  EXPECT_EQ(cross(a, b), (Vec3d{10, -17, 8}));
  EXPECT_EQ(cross(a, b), -cross(b, a));
  EXPECT_EQ(a[0], 1);
  EXPECT_EQ(a[2], 3);
}

TEST(Vec3, NormalizedHasLengthOneAndZeroStaysZero) {
  EXPECT_EQ(normalized(Vec3d{3, 0, 4}), (Vec3d{0.6, 0, 0.8}));
  EXPECT_EQ(normalized(Vec3f{}), Vec3f{});
  EXPECT_EQ(length(Vec3d{2, 3, 6}), 7);
}

}  // namespace
}  // namespace scarp
