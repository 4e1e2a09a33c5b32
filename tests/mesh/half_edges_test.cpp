#include "mesh/half_edges.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "core/error.h"
#include "core/random.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

/// A square fan: centre 0, rim 1..4 counter-clockwise.
TriMesh fan() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}},
          {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}},
          {}};
}

TriMesh tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
          {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}},
          {}};
}

std::uint32_t half_edge(const HalfEdges& mesh, std::uint32_t from, std::uint32_t to) {
  for (std::uint32_t h = 0; h < mesh.half_edge_count(); ++h) {
    if (mesh.alive(HalfEdges::facet(h)) && mesh.origin(h) == from && mesh.target(h) == to) return h;
  }
  return HalfEdges::none;
}

std::vector<std::uint32_t> neighbours(const HalfEdges& mesh, std::uint32_t v) {
  std::vector<std::uint32_t> found;
  mesh.for_each_neighbour(v, [&](std::uint32_t w) { found.push_back(w); });
  return found;
}

/// Everything that has to hold between the arrays.
void expect_consistent(const HalfEdges& mesh) {
  std::vector<int> degree(mesh.vertex_count(), 0);
  std::set<std::pair<std::uint32_t, std::uint32_t>> directed;
  for (std::uint32_t h = 0; h < mesh.half_edge_count(); ++h) {
    if (!mesh.alive(HalfEdges::facet(h))) continue;
    ++degree[mesh.origin(h)];
    ASSERT_NE(mesh.origin(h), mesh.target(h));
    ASSERT_TRUE(directed.emplace(mesh.origin(h), mesh.target(h)).second) << "edge twice";
    const std::uint32_t o = mesh.opposite(h);
    if (o == HalfEdges::none) continue;
    ASSERT_TRUE(mesh.alive(HalfEdges::facet(o)));
    ASSERT_EQ(mesh.opposite(o), h);
    ASSERT_EQ(mesh.origin(o), mesh.target(h));
    ASSERT_EQ(mesh.target(o), mesh.origin(h));
  }
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    int turned = 0;
    mesh.for_each_outgoing(v, [&](std::uint32_t h) {
      ASSERT_EQ(mesh.origin(h), v);
      ++turned;
    });
    ASSERT_EQ(turned, degree[v]) << "turning around vertex " << v << " misses facets";
  }
}

int euler_characteristic(const HalfEdges& mesh) {
  int vertices = 0;
  int edges = 0;
  int facets = 0;
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    vertices += mesh.outgoing(v) != HalfEdges::none ? 1 : 0;
  }
  for (std::uint32_t h = 0; h < mesh.half_edge_count(); ++h) {
    if (!mesh.alive(HalfEdges::facet(h))) continue;
    facets += h % 3 == 0 ? 1 : 0;
    edges += mesh.is_edge(h) ? 1 : 0;
  }
  return vertices - edges + facets;
}

TEST(HalfEdges, TurnsCounterClockwiseAroundInnerAndBoundaryVertices) {
  const HalfEdges mesh(fan());
  expect_consistent(mesh);
  std::vector<std::uint32_t> ring = neighbours(mesh, 0);
  std::rotate(ring.begin(), std::find(ring.begin(), ring.end(), 1U), ring.end());
  EXPECT_THAT(ring, ElementsAre(1, 2, 3, 4));
  EXPECT_FALSE(mesh.on_boundary(0));
  EXPECT_TRUE(mesh.on_boundary(1));
  EXPECT_THAT(neighbours(mesh, 1), ElementsAre(2, 0, 4));
}

TEST(HalfEdges, EdgesWithThreeTrianglesAreRefusedWithTheirEnds) {
  TriMesh mesh = fan();
  mesh.vertices.push_back({0, 0, 7});
  mesh.triangles.push_back({0, 1, 5});
  try {
    const HalfEdges half_edges(mesh);
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(),
                AllOf(HasSubstr("not a 2-manifold"), HasSubstr("(0, 0"), HasSubstr("(1, 0, 0)")));
  }
}

TEST(HalfEdges, NeighboursThatDisagreeAboutTheOutsideAreRefused) {
  TriMesh mesh = fan();
  std::swap(mesh.triangles[1][1], mesh.triangles[1][2]);
  EXPECT_THROW(HalfEdges{mesh}, InputError);
}

TEST(HalfEdges, RepeatedTrianglesAndRepeatedCornersAreDropped) {
  TriMesh mesh = fan();
  mesh.triangles.insert(mesh.triangles.begin() + 1, {1, 2, 0});  // the first once more
  mesh.triangles.push_back({3, 3, 2});
  const HalfEdges half_edges(mesh);
  EXPECT_EQ(half_edges.facet_count(), 4U);
  EXPECT_THAT(half_edges.input_triangles(), ElementsAre(0, 2, 3, 4));
}

TEST(HalfEdges, TouchingSheetsGetAVertexEach) {
  TriMesh mesh{
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}}, {{0, 1, 2}, {0, 3, 4}}, {}};
  const HalfEdges half_edges(mesh);
  EXPECT_EQ(half_edges.vertex_count(), 6U);
  EXPECT_THAT(half_edges.copies(), ElementsAre(0));
  expect_consistent(half_edges);
}

TEST(HalfEdges, CollapseMergesTheTargetIntoTheOrigin) {
  HalfEdges mesh(fan());
  const std::uint32_t h = half_edge(mesh, 0, 1);
  // The inner vertex may go to the rim, seen from either end of the edge.
  ASSERT_TRUE(mesh.can_collapse(h));
  mesh.collapse(h);
  expect_consistent(mesh);
  EXPECT_EQ(mesh.outgoing(1), HalfEdges::none);
  EXPECT_THAT(neighbours(mesh, 0), UnorderedElementsAre(2, 3, 4));
  EXPECT_TRUE(mesh.on_boundary(0));
}

TEST(HalfEdges, CollapsesThatWouldBreakTheSurfaceAreRefused) {
  const HalfEdges closed(tetrahedron());
  for (std::uint32_t h = 0; h < closed.half_edge_count(); ++h) {
    EXPECT_FALSE(closed.can_collapse(h)) << "a tetrahedron would fold flat";
  }
  // Two boundary vertices joined across the surface.
  const HalfEdges strip(
      TriMesh{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}});
  EXPECT_FALSE(strip.can_collapse(half_edge(strip, 0, 2)));
  // Nothing would be left but an edge without a facet.
  const HalfEdges single(TriMesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, {}});
  EXPECT_FALSE(single.can_collapse(0));
  // Around a tube of three sides, an edge of a rung shares a neighbour that is no apex.
  TriMesh tube{{{1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}, {1, 0, 1}, {-1, 1, 1}, {-1, -1, 1}}, {}, {}};
  for (std::uint32_t i = 0; i < 3; ++i) {
    const std::uint32_t j = (i + 1) % 3;
    tube.triangles.push_back({i, j, j + 3});
    tube.triangles.push_back({i, j + 3, i + 3});
  }
  const HalfEdges ring(tube);
  EXPECT_FALSE(ring.can_collapse(half_edge(ring, 0, 1))) << "the rim would become two edges";
}

TEST(HalfEdges, AnOctahedronMayLoseAnyEdge) {
  const HalfEdges mesh(octahedral_sphere(1, 1));
  for (std::uint32_t h = 0; h < mesh.half_edge_count(); ++h) EXPECT_TRUE(mesh.can_collapse(h));
}

TEST(HalfEdges, FlipTurnsTheEdgeAndBack) {
  HalfEdges mesh(TriMesh{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}});
  const std::uint32_t h = half_edge(mesh, 0, 2);
  ASSERT_TRUE(mesh.can_flip(h));
  mesh.flip(h);
  expect_consistent(mesh);
  EXPECT_EQ(half_edge(mesh, 0, 2), HalfEdges::none);
  EXPECT_NE(half_edge(mesh, 1, 3), HalfEdges::none);
  const HalfEdges closed(tetrahedron());
  EXPECT_FALSE(closed.can_flip(0)) << "the other two corners are joined already";
}

TEST(HalfEdges, RandomCollapsesAndFlipsKeepTopologyAndOrder) {
  HalfEdges mesh(octahedral_sphere(1, 8));
  ASSERT_EQ(euler_characteristic(mesh), 2);
  RandomStream random({.seed = 3});
  int collapses = 0;
  for (int i = 0; i < 2000; ++i) {
    const std::uint32_t h = random.bits() % mesh.half_edge_count();
    if (!mesh.alive(HalfEdges::facet(h))) continue;
    if (i % 3 == 0 && mesh.can_flip(h)) {
      mesh.flip(h);
    } else if (mesh.can_collapse(h)) {
      mesh.collapse(h);
      ++collapses;
    }
    if (i % 100 == 0) expect_consistent(mesh);
  }
  EXPECT_GT(collapses, 100);
  expect_consistent(mesh);
  EXPECT_EQ(euler_characteristic(mesh), 2);
}

TEST(HalfEdges, RandomCollapsesOfAnOpenSheetKeepItsTopology) {
  HalfEdges mesh(noisy_plane(12, 0.01));
  ASSERT_EQ(euler_characteristic(mesh), 1);
  RandomStream random({.seed = 4});
  for (int i = 0; i < 4000; ++i) {
    const std::uint32_t h = random.bits() % mesh.half_edge_count();
    if (mesh.alive(HalfEdges::facet(h)) && mesh.can_collapse(h)) mesh.collapse(h);
    if (i % 200 == 0) expect_consistent(mesh);
  }
  expect_consistent(mesh);
  EXPECT_EQ(euler_characteristic(mesh), 1);
}

}  // namespace
}  // namespace scarp
