#include "mesh/quadric.h"

#include <gtest/gtest.h>

namespace scarp {
namespace {

void expect_near(Vec3d a, Vec3d b, double tolerance = 1e-12) {
  EXPECT_NEAR(length(a - b), 0, tolerance) << "(" << a.x << ", " << a.y << ", " << a.z << ") and ("
                                           << b.x << ", " << b.y << ", " << b.z << ")";
}

TEST(Quadric, OfAPlaneIsTheSquaredDistance) {
  Quadric q;
  q.add_plane(2, {0, 0, 1}, 3);
  EXPECT_DOUBLE_EQ(q.value({7, -8, 5}), 2 * 4);
}

TEST(Quadric, OfALineIsTheSquareOfTwiceTheArea) {
  Quadric q;
  q.add_line(1, {1, 1, 0}, {4, 1, 0});
  EXPECT_DOUBLE_EQ(q.value({9, 3, 0}), (3 * 2) * (3 * 2));
  EXPECT_DOUBLE_EQ(q.value({2, 1, 5}), (3 * 5) * (3 * 5));
}

TEST(Quadric, MovedIsTheSameFunctionInAnotherFrame) {
  Quadric q;
  q.add_plane(1, {1, 2, 3}, 4);
  q.add_plane(3, {-1, 1, 0.5}, 2);
  q.add_line(0.5, {1, 0, 0}, {0, 2, 1});
  const Vec3d origin{3, -1, 2};
  const Vec3d r{0.3, 0.4, -0.6};
  EXPECT_NEAR(q.moved(origin).value(r), q.value(origin + r), 1e-10);
}

TEST(Minimum, OfThreePlanesIsTheirCorner) {
  Quadric q;
  q.add_plane(1, {1, 0, 0}, 1);
  q.add_plane(5, {0, 1, 0}, 2);
  q.add_plane(2, {0.6, 0, 0.8}, 3);
  expect_near(minimum(q, 1e-12, {}, {}), {1, 2, (3 - 0.6) / 0.8}, 1e-9);
}

TEST(Minimum, OfOnePlaneIsWhereThePullMeetsIt) {
  Quadric q;
  q.add_plane(1, {0, 0, 1}, 2);
  expect_near(minimum(q, 1e-9, {5, 6, 7}, {}), {5, 6, 2}, 1e-7);
}

TEST(Minimum, StaysInItsSubspace) {
  Quadric q;
  q.add_plane(1, {1, 0, 0}, 1);
  q.add_plane(1, {0, 1, 0}, 1);
  q.add_plane(1, {0, 0, 1}, 1);
  Subspace plane;
  plane.intersect({1, 1, 1}, 0);
  EXPECT_EQ(plane.dimension, 2);
  expect_near(minimum(q, 1e-12, {}, plane), {0, 0, 0}, 1e-9);

  Subspace line = plane;
  line.intersect({1, -1, 0}, 2);
  EXPECT_EQ(line.dimension, 1);
  const Vec3d r = minimum(q, 1e-12, {}, line);
  EXPECT_NEAR(r.x + r.y + r.z, 0, 1e-12);
  EXPECT_NEAR(r.x - r.y, 2, 1e-12);
  EXPECT_NEAR(q.value(r), 5, 1e-9);

  Subspace side;
  side.origin = {9, 9, 9};
  side.fix(1, -4);
  expect_near(minimum(q, 1e-12, {}, side), {1, -4, 1}, 1e-9);
}

TEST(Subspace, IgnoresANormalThatItCannotFollow) {
  Subspace side;
  side.fix(0, 3);
  side.intersect({1, 0, 0}, 8);
  EXPECT_EQ(side.dimension, 2);
  EXPECT_EQ(side.origin.x, 3);
}

TEST(MinimumOnPlane, IsTheMinimumInTheSubspaceOfThePlane) {
  Quadric q;
  q.add_plane(2, {1, 0.5, -0.3}, 0.7);
  q.add_plane(1, {-0.2, 1, 0.1}, -0.4);
  q.add_plane(0.5, {0.1, 0.2, 1}, 0.3);
  const Vec3d centre{0.3, -0.1, 0.2};
  const Vec3d n{0.4, -0.7, 2};
  Subspace plane;
  plane.intersect(n, 0.9);
  const Vec3d expected = minimum(q, 1e-3, centre, plane);
  EXPECT_NEAR(length(minimum_on_plane(q, 1e-3, centre, n, 0.9) - expected), 0, 1e-10);
  EXPECT_NEAR(dot(n, minimum_on_plane(q, 1e-3, centre, n, 0.9)), 0.9, 1e-12);
  const Vec3d anywhere = minimum(q, 1e-3, centre, {});
  EXPECT_NEAR(length(minimum_on_plane(q, 1e-3, centre, {}, 0) - anywhere), 0, 1e-10);
}

}  // namespace
}  // namespace scarp
