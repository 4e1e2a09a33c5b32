#include "core/triangle_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"

namespace scarp {
namespace {

/// A wavy sheet of 2 n^2 triangles over [0, n]^2.
TriMesh wavy_sheet(int n) {
  TriMesh mesh;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      const float z = static_cast<float>(2 * std::sin(0.3 * i) * std::cos(0.2 * j));
      mesh.vertices.push_back({static_cast<float>(i), static_cast<float>(j), z});
    }
  }
  const auto node = [n](int i, int j) { return static_cast<std::uint32_t>(j * (n + 1) + i); };
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      mesh.triangles.push_back({node(i, j), node(i + 1, j), node(i + 1, j + 1)});
      mesh.triangles.push_back({node(i, j), node(i + 1, j + 1), node(i, j + 1)});
    }
  }
  return mesh;
}

Vec3d random_point(RandomStream& random, double side) {
  return {side * (1.4 * random.uniform() - 0.2), side * (1.4 * random.uniform() - 0.2),
          12 * random.uniform() - 6};
}

ClosestPoint brute_force(const TriMesh& mesh, Vec3d r) {
  // Squares are compared, as in the tree: the root may make different squares equal.
  ClosestPoint best;
  double best_square = TriangleTree::unlimited;
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    ClosestPoint p = closest_on_triangle(r, corners(mesh, f));
    p.triangle = f;
    const double square = dot(r - p.point, r - p.point);
    if (square < best_square) {
      best_square = square;
      best = p;
    }
  }
  return best;
}

TEST(ClosestOnTriangle, FindsCornerEdgeAndInside) {
  const std::array<Vec3d, 3> p{Vec3d{0, 0, 0}, Vec3d{4, 0, 0}, Vec3d{0, 4, 0}};

  const auto expect = [&p](Vec3d r, Vec3d point) {
    const ClosestPoint c = closest_on_triangle(r, p);
    EXPECT_NEAR(length(c.point - point), 0, 1e-14);
    EXPECT_NEAR(c.distance, length(r - point), 1e-14);
    EXPECT_NEAR(c.barycentric[0] + c.barycentric[1] + c.barycentric[2], 1, 1e-14);
  };
  expect({-1, -2, 3}, {0, 0, 0});
  expect({6, -1, 0}, {4, 0, 0});
  expect({-1, 7, 1}, {0, 4, 0});
  expect({2, -1, 1}, {2, 0, 0});
  expect({-3, 1, 0}, {0, 1, 0});
  expect({3, 3, 2}, {2, 2, 0});
  expect({1, 1, -5}, {1, 1, 0});
}

TEST(ClosestOnTriangle, WithoutAreaIsItsEdges) {
  const std::array<Vec3d, 3> line{Vec3d{0, 0, 0}, Vec3d{1, 0, 0}, Vec3d{3, 0, 0}};
  EXPECT_DOUBLE_EQ(closest_on_triangle({2, 1, 0}, line).distance, 1);
  EXPECT_DOUBLE_EQ(closest_on_triangle({5, 0, 0}, line).distance, 2);

  const std::array<Vec3d, 3> point{Vec3d{1, 1, 1}, Vec3d{1, 1, 1}, Vec3d{1, 1, 1}};
  EXPECT_DOUBLE_EQ(closest_on_triangle({1, 1, 3}, point).distance, 2);
}

TEST(TriangleTree, AgreesWithLookingAtEveryTriangle) {
  const TriMesh mesh = wavy_sheet(24);
  const TriangleTree tree(mesh);
  RandomStream random({.seed = 5});

  for (int i = 0; i < 2000; ++i) {
    const Vec3d r = random_point(random, 24);
    const ClosestPoint expected = brute_force(mesh, r);
    const ClosestPoint found = tree.closest(r);
    ASSERT_EQ(found.triangle, expected.triangle);
    ASSERT_EQ(found.distance, expected.distance);
    ASSERT_EQ(found.point, expected.point);
    ASSERT_TRUE(tree.is_within(r, expected.distance * (1 + 1e-9)));
    ASSERT_FALSE(tree.is_within(r, expected.distance * (1 - 1e-9)));
  }
}

TEST(TriangleTree, AgreesWhereNodesAreLarge) {
  const TriMesh mesh = wavy_sheet(80);
  const TriangleTree tree(mesh);
  RandomStream random({.seed = 6});
  for (int n = 0; n < 50; ++n) {
    const Vec3d r = random_point(random, 80);
    EXPECT_EQ(tree.closest(r).triangle, brute_force(mesh, r).triangle);
  }
}

TEST(TriangleTree, ANeighbourhoodHoldsTheAnswersToItsPoints) {
  const TriMesh mesh = wavy_sheet(80);
  const TriangleTree tree(mesh);
  RandomStream random({.seed = 7});
  int found = 0;
  for (int n = 0; n < 200; ++n) {
    const Vec3d middle = random_point(random, 80);
    const double limit = 1 + 5 * random.uniform();
    Box box;
    std::array<Vec3d, 4> points;
    for (Vec3d& r : points) {
      r = middle + 5 * Vec3d{random.uniform(), random.uniform(), random.uniform()};
      box.add(r);
    }
    const TriangleTree::Neighbourhood near = tree.neighbourhood(box, limit);
    for (const Vec3d& r : points) {
      const ClosestPoint expected = tree.closest(r, limit);
      found += expected.found() ? 1 : 0;
      EXPECT_EQ(tree.closest(r, limit, near).triangle, expected.triangle);
      EXPECT_EQ(tree.closest_facing(r, {0, 0, 1}, limit, near).triangle,
                tree.closest_facing(r, {0, 0, 1}, limit).triangle);
    }
  }
  EXPECT_GT(found, 200);
}

TEST(TriangleTree, EqualDistancesGoToTheLowestTriangle) {
  // Many copies of the same triangle, more than a leaf holds.
  TriMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}, {}};
  mesh.triangles.assign(50, Triangle{0, 1, 2});
  EXPECT_EQ(TriangleTree(mesh).closest({0.2, 0.2, 1}).triangle, 0U);

  // Every inner node of a plane belongs to six triangles.
  const int n = 16;
  TriMesh plane = wavy_sheet(n);
  for (Vec3f& r : plane.vertices) r.z = 0;
  const TriangleTree tree(plane);
  for (const Vec3f& v : plane.vertices) {
    EXPECT_EQ(tree.closest(Vec3d(v) + Vec3d{0, 0, 2}).triangle,
              brute_force(plane, Vec3d(v) + Vec3d{0, 0, 2}).triangle);
  }
}

TEST(TriangleTree, FindsNothingBeyondTheLimitOrInAnEmptyMesh) {
  const TriMesh plane{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, {}};
  const TriangleTree tree(plane);
  EXPECT_FALSE(tree.closest({0.2, 0.2, 3}, 2.9).found());
  EXPECT_TRUE(tree.closest({0.2, 0.2, 3}, 3).found());
  EXPECT_FALSE(TriangleTree(TriMesh{}).closest({0, 0, 0}).found());
  EXPECT_FALSE(TriangleTree(TriMesh{}).is_within({0, 0, 0}, 1));
}

TEST(TriangleTree, FacingQueriesSkipTrianglesThatLookAway) {
  // Two parallel sheets, the lower one looks up, the upper one down.
  TriMesh mesh{{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {0, 0, 1}, {4, 0, 1}, {0, 4, 1}},
               {{0, 1, 2}, {3, 5, 4}, {0, 0, 1}},
               {}};
  const TriangleTree tree(mesh);
  const Vec3d r{1, 1, 0.9};
  EXPECT_EQ(tree.closest(r).triangle, 1U);
  EXPECT_EQ(tree.closest_facing(r, {0, 0, 1}).triangle, 0U);
  EXPECT_EQ(tree.closest_facing(r, {0, 0, -1}).triangle, 1U);
  EXPECT_FALSE(tree.closest_facing(r, {1, 0, 0}).found());
}

Vec3d random_direction(RandomStream& random) {
  return {random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5};
}

TEST(TriangleTree, AGuessChangesNoAnswer) {
  const TriMesh mesh = wavy_sheet(24);
  const TriangleTree tree(mesh);
  RandomStream random({.seed = 8});
  for (int n = 0; n < 2000; ++n) {
    const Vec3d r = random_point(random, 24);
    const Vec3d u = random_direction(random);
    const ClosestPoint expected = tree.closest_facing(r, u, 5);
    Box box;
    box.add(r);
    box.add(r + random_direction(random));
    const TriangleTree::Neighbourhood near = tree.neighbourhood(box, 5);
    const auto guess =
        static_cast<std::uint32_t>(random.uniform() * static_cast<double>(mesh.triangles.size()));
    for (const std::uint32_t each : {guess, expected.triangle}) {
      const ClosestPoint found = tree.closest_facing(r, u, 5, near, each);
      ASSERT_EQ(found.triangle, expected.triangle);
      ASSERT_EQ(found.point, expected.point);
      ASSERT_EQ(found.is_alone, expected.is_alone);
    }
  }
}

// Far from the origin the triangles around a node of a plane are as near but for rounding, each by
// a little more or less.
TEST(TriangleTree, NoGuessDecidesBetweenTrianglesThatAreAsNear) {
  const int n = 24;
  TriMesh mesh = wavy_sheet(n);
  RandomStream random({.seed = 11});
  for (Vec3f& r : mesh.vertices)
    r = {100 * r.x + 4321.7F, 100 * r.y - 7654.3F, static_cast<float>(2e-4 * random.uniform())};
  const TriangleTree tree(mesh);
  for (const Vec3f& v : mesh.vertices) {
    const Vec3d r = Vec3d(v) + Vec3d{0, 0, 63.556};
    Box box;
    box.add(r);
    const TriangleTree::Neighbourhood near = tree.neighbourhood(box, 200);
    const std::uint32_t expected = tree.closest_facing(r, {0, 0, 1}, 200).triangle;
    for (std::uint32_t guess = 0; guess < mesh.triangles.size(); ++guess) {
      if (length(corners(mesh, guess)[0] - Vec3d(v)) > 300) continue;
      ASSERT_EQ(tree.closest_facing(r, {0, 0, 1}, 200, near, guess).triangle, expected);
    }
  }
}

// Half of the places lie above nodes of the sheet or their edges, where several are as near.
TEST(TriangleTree, WhatIsAloneAnswersForEveryDirectionThatItFaces) {
  const int n = 24;
  const TriMesh mesh = wavy_sheet(n);
  const TriangleTree tree(mesh);
  RandomStream random({.seed = 10});
  int alone = 0;
  int with_rivals = 0;
  for (int i = 0; i < 4000; ++i) {
    Vec3d r = random_point(random, n);
    if (i % 2 == 0) r.x = std::round(r.x);
    if (i % 4 == 0) r.y = std::round(r.y);
    const ClosestPoint found = tree.closest_facing(r, random_direction(random));
    (found.is_alone ? alone : with_rivals) += found.found() ? 1 : 0;
    if (!found.is_alone) continue;
    ASSERT_EQ(found.triangle, brute_force(mesh, r).triangle);
    const Vec3d u = random_direction(random);
    if (dot(area_vector(mesh, found.triangle), u) > 0) {
      ASSERT_EQ(tree.closest_facing(r, u).triangle, found.triangle);
    }
  }
  EXPECT_GT(alone, 500);
  EXPECT_GT(with_rivals, 500);
}

// A floor and a wall, whose edge is what is closest to places below and beside both.
TEST(TriangleTree, FacingQueriesTakeAtAnEdgeTheTriangleThatFacesMost) {
  constexpr float edge = 1234.567F;
  constexpr float bottom = -321.987F;
  for (const bool floor_first : {true, false}) {
    TriMesh mesh{.vertices = {{edge, -30, bottom},
                              {edge, 41, bottom},
                              {edge - 50, 3, bottom},
                              {edge, 2, bottom + 60}},
                 .triangles = {{0, 1, 2}, {0, 3, 1}},
                 .materials = {}};
    if (!floor_first) std::swap(mesh.triangles[0], mesh.triangles[1]);
    const TriangleTree tree(mesh);
    const std::uint32_t floor = floor_first ? 0 : 1;
    for (int n = 0; n < 200; ++n) {
      const Vec3d r{edge + 0.1 + 0.037 * n, -20.0 + 0.29 * n, bottom - 0.3 - 0.0713 * n};
      EXPECT_EQ(tree.closest_facing(r, {-0.2, 0, 1}).triangle, floor);
      EXPECT_EQ(tree.closest_facing(r, {-1, 0, 0.2}).triangle, 1 - floor);
      EXPECT_NEAR(tree.closest_facing(r, {-1, 0, 0.2}).distance, tree.closest(r).distance, 1e-9);
    }
  }
}

TEST(TriangleTree, GivesTheSameAnswersOnAnyNumberOfThreads) {
  const TriMesh mesh = wavy_sheet(40);
  const TriangleTree tree(mesh);
  const auto query_all = [&](int threads) {
    const ThreadLimit limit(threads);
    std::vector<ClosestPoint> found(5000);
    parallel_for(found.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        RandomStream random({.seed = 9, .ray = i});
        found[i] = tree.closest(random_point(random, 40));
      }
    });
    return found;
  };
  const auto one = query_all(1);
  const auto two = query_all(2);
  for (std::size_t i = 0; i < one.size(); ++i) {
    ASSERT_EQ(one[i].triangle, two[i].triangle);
    ASSERT_EQ(one[i].point, two[i].point);
  }
}

// Those within the room, from all of the tree and from a neighbourhood.
TEST(TriangleTree, TellsWhichOthersAreNearlyAsNear) {
  RandomStream random({.seed = 12});
  const TriMesh mesh = wavy_sheet(24);
  const TriangleTree tree(mesh);
  constexpr double room = 0.1;
  for (int i = 0; i < 200; ++i) {
    const Vec3d r = random_point(random, 24);
    const Vec3d u = random_direction(random);
    const ClosestPoint best = tree.closest_facing(r, u);
    if (!best.found()) continue;
    std::vector<std::pair<double, std::uint32_t>> expected;
    for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
      const double distance = closest_on_triangle(r, corners(mesh, f)).distance;
      if (f != best.triangle && dot(area_vector(mesh, f), u) > 0 &&
          distance <= best.distance + room)
        expected.emplace_back(distance, f);
    }
    std::ranges::sort(expected);
    expected.resize(std::min<std::size_t>(expected.size(), 31));
    const TriangleTree::Neighbourhood near =
        tree.neighbourhood({.lower = r, .upper = r}, best.distance + 1);
    for (const bool is_near : {false, true}) {
      TriangleTree::Others others{.room = room};
      const ClosestPoint found =
          is_near ? tree.closest_facing(r, u, best.distance + 1, near, ClosestPoint::none, &others)
                  : tree.closest_facing(r, u, best.distance + 1, others);
      EXPECT_EQ(found.triangle, best.triangle);
      std::vector<std::pair<double, std::uint32_t>> points;
      for (const ClosestPoint& each : others.points)
        points.emplace_back(each.distance, each.triangle);
      std::ranges::sort(points);
      EXPECT_EQ(points, expected);
    }
  }
}

}  // namespace
}  // namespace scarp
