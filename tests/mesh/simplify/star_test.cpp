#include "mesh/simplify/star.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

TEST(Star, HoldsTheFacetsOfBothEndsInTheOrderOfTheirRing) {
  const HalfEdges mesh(noisy_plane(8, 0.02));
  int closed = 0;
  int open = 0;
  for (std::uint32_t h = 0; h < mesh.half_edge_count(); ++h) {
    if (!mesh.can_collapse(h)) continue;
    Star star;
    ASSERT_TRUE(star.gather(mesh, h));
    std::set<std::uint32_t> expected;
    for (const std::uint32_t v : {mesh.origin(h), mesh.target(h)}) {
      mesh.for_each_outgoing(v, [&](std::uint32_t g) { expected.insert(HalfEdges::facet(g)); });
    }
    for (const std::uint32_t f : star.dying) expected.erase(f);
    const std::set<std::uint32_t> found(star.facet.begin(), star.facet.begin() + star.count);
    ASSERT_EQ(found, expected);
    for (int i = 0; i < star.count; ++i) {
      // The corner, then the ring counter-clockwise.
      const std::uint32_t corner = star.at_target[i] ? star.v : star.u;
      std::uint32_t g = 3 * star.facet[i];
      while (mesh.origin(g) != corner) ++g;
      ASSERT_EQ(mesh.target(g), star.ring[i]);
      ASSERT_EQ(mesh.apex(g), star.ring[i + 1]);
    }
    const bool boundary = mesh.on_boundary(star.u) || mesh.on_boundary(star.v);
    ASSERT_EQ(star.closed, !boundary);
    (star.closed ? closed : open) += 1;
  }
  EXPECT_GT(closed, 50);
  EXPECT_GT(open, 20);
}

TEST(Star, OfAVertexHoldsItsFacetsInTheOrderOfTheirRing) {
  const HalfEdges mesh(noisy_plane(8, 0.02));
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    Star star;
    ASSERT_TRUE(star.gather_vertex(mesh, v));
    EXPECT_EQ(star.dying_count(), 0);
    EXPECT_EQ(star.closed, !mesh.on_boundary(v));
    int count = 0;
    mesh.for_each_outgoing(v, [&](std::uint32_t g) {
      ASSERT_EQ(star.facet[count], HalfEdges::facet(g));
      ASSERT_EQ(star.ring[count], mesh.target(g));
      ASSERT_EQ(star.ring[count + 1], mesh.apex(g));
      ++count;
    });
    EXPECT_EQ(star.count, count);
  }
}

TEST(Star, IsApartFromThoseItSharesNoVertexWith) {
  const HalfEdges mesh(noisy_plane(8, 0.02));
  Star first;
  ASSERT_TRUE(first.gather_vertex(mesh, 0));
  const std::set<std::uint32_t> vertices = [&] {
    std::set<std::uint32_t> found(first.ring.begin(), first.ring.begin() + first.count + 1);
    found.insert(0);
    return found;
  }();
  int apart = 0;
  for (std::uint32_t h = 0; h < mesh.half_edge_count(); ++h) {
    Star second;
    ASSERT_TRUE(second.gather(mesh, h));
    bool shares = vertices.count(second.u) + vertices.count(second.v) > 0;
    for (int i = 0; i <= second.count; ++i) shares = shares || vertices.count(second.ring[i]) > 0;
    ASSERT_EQ(first.is_apart_from(second), !shares);
    ASSERT_EQ(second.is_apart_from(first), !shares);
    apart += shares ? 0 : 1;
  }
  EXPECT_GT(apart, 50);
}

TEST(Star, TooManyFacetsAreRefused) {
  TriMesh wheel{{{0, 0, 0}}, {}, {}};
  const std::uint32_t n = Star::capacity + 8;
  for (std::uint32_t i = 0; i < n; ++i) {
    const auto x = static_cast<float>(i);
    wheel.vertices.push_back({x, 1 + x * x, 0});
    if (i > 0) wheel.triangles.push_back({0, i + 1, i});
  }
  const HalfEdges mesh(wheel);
  Star star;
  EXPECT_FALSE(star.gather(mesh, mesh.outgoing(0)));
  EXPECT_FALSE(star.gather_vertex(mesh, 0));
}

}  // namespace
}  // namespace scarp
