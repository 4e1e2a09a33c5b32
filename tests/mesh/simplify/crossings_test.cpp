#include "mesh/simplify/crossings.h"

#include <gtest/gtest.h>

#include "core/parallel.h"
#include "core/random.h"
#include "tests/mesh/generated_surface.h"
#include "tests/mesh/self_intersections.h"

namespace scarp {
namespace {

/// Triangles of all directions, each on its own.
TriMesh tangle(std::uint32_t count, float size) {
  TriMesh mesh;
  RandomStream random({.seed = 3});
  const auto draw = [&random] { return static_cast<float>(random.uniform()); };
  for (std::uint32_t f = 0; f < count; ++f) {
    const Vec3f centre{size * draw(), size * draw(), size * draw()};
    for (int i = 0; i < 3; ++i) mesh.vertices.push_back(centre + Vec3f{draw(), draw(), draw()});
    mesh.triangles.push_back({3 * f, 3 * f + 1, 3 * f + 2});
  }
  return mesh;
}

TEST(Crossings, AreWhereAnEdgePassesThroughAFacet) {
  TriMesh mesh{{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {1, 1, -1}, {1, 1, 3}, {1, 9, 1}}, {}, {}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  const CollapseMesh crossed(mesh, {});
  const std::vector<Box> found = crossings(crossed);
  ASSERT_EQ(found.size(), 1U);
  // The upright edge at its foot, and the plane's far edge where the other one has come through.
  EXPECT_EQ(found[0].lower + crossed.centre, (Vec3d{1, 1, 0}));
  EXPECT_EQ(found[0].upper + crossed.centre, (Vec3d{1, 3, 0}));
  // One that only touches.
  mesh.vertices[3].z = 0;
  EXPECT_TRUE(crossings(CollapseMesh(mesh, {})).empty());
}

TEST(Crossings, OfATangleAreThoseOfAllPairsThatFaceApart) {
  const TriMesh mesh = tangle(1000, 7);
  std::size_t count = 0;
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    for (std::uint32_t g = 0; g < f; ++g) {
      using self_intersections_detail::edge_pierces;
      if (!edge_pierces(mesh, f, g) && !edge_pierces(mesh, g, f)) continue;
      const double cosine = dot(normalized(area_vector(mesh, f)), normalized(area_vector(mesh, g)));
      count += cosine <= 0.5 ? 1 : 0;
    }
  }
  EXPECT_GT(count, 100U);
  EXPECT_EQ(crossings(CollapseMesh(mesh, {})).size(), count);
}

TEST(Crossings, OfASurfaceThatHasNoneAreNone) {
  EXPECT_TRUE(crossings(CollapseMesh(noisy_plane(60, 0.1), {})).empty());
}

TEST(Crossings, DoNotDependOnTheNumberOfThreads) {
  const CollapseMesh mesh(tangle(3000, 10), {});
  const auto with_threads = [&mesh](int threads) {
    const ThreadLimit limit(threads);
    return crossings(mesh);
  };
  const std::vector<Box> one = with_threads(1);
  const std::vector<Box> two = with_threads(2);
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].lower, two[i].lower);
    EXPECT_EQ(one[i].upper, two[i].upper);
  }
}

TEST(FacetsNear, AreThoseWhoseBoxesMeetOneOfThese) {
  const CollapseMesh mesh(tangle(300, 5), {});
  const std::vector<Box> boxes{{{-1, -1, -1}, {0, 0, 0}}, {{-0.5, -0.5, -0.5}, {1, 0.5, 0.5}}};
  std::vector<std::uint32_t> expected;
  for (std::uint32_t f = 0; f < 300; ++f) {
    Box box;
    for (std::uint32_t i = 0; i < 3; ++i) box.add(mesh.r[3 * f + i]);
    bool near = false;
    for (const Box& other : boxes) {
      bool meets = true;
      for (int axis = 0; axis < 3; ++axis) {
        meets &= box.lower[axis] <= other.upper[axis] && other.lower[axis] <= box.upper[axis];
      }
      near |= meets;
    }
    if (near) expected.push_back(f);
  }
  EXPECT_GT(expected.size(), 5U);
  EXPECT_EQ(facets_near(mesh, boxes), expected);
}

}  // namespace
}  // namespace scarp
