#include "mesh/simplify/edge_cost.h"

#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "mesh/simplify/placement.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

FloatLanes lanes(Vec3f a) { return FloatLanes{a.x, a.y, a.z, 0}; }

struct Terms {
  explicit Terms(const CollapseMesh& mesh, Measure measure = Measure::distance)
      : of(mesh.r.size()) {
    for (std::uint32_t v = 0; v < of.size(); ++v) {
      mesh.topology.for_each_outgoing(v, [&](std::uint32_t h) {
        of[v] += FloatTerms::of(measure, lanes(Vec3f(mesh.normals[HalfEdges::facet(h)])));
      });
    }
  }
  std::vector<FloatTerms> of;
};

/// What the cost of an edge depends on.
struct Edge {
  Edge(const CollapseMesh& mesh, std::uint32_t h)
      : u(mesh.topology.origin(h)),
        v(mesh.topology.target(h)),
        along(mesh.r[v] - mesh.r[u]),
        a(mesh.normals[HalfEdges::facet(h)]),
        b(mesh.normals[HalfEdges::facet(mesh.topology.opposite(h))]) {}
  std::uint32_t u;
  std::uint32_t v;
  Vec3f along;
  Vec3f a;
  Vec3f b;
};

template <class Visit>
void for_each_inner_edge(const CollapseMesh& mesh, const Visit& visit) {
  for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); ++h) {
    if (!mesh.topology.is_edge(h) || mesh.topology.on_boundary(mesh.topology.origin(h)) ||
        mesh.topology.on_boundary(mesh.topology.target(h))) {
      continue;
    }
    visit(h);
  }
}

FloatPlaced placed(Measure measure, const Terms& terms, const Edge& edge) {
  return place_merged(measure, edge.along, terms.of[edge.u], terms.of[edge.v], edge.a, edge.b);
}

class EdgeCostBy : public testing::TestWithParam<Measure> {};

TEST_P(EdgeCostBy, IsThatOfLindstromAndTurk) {
  const Grid grid{.cells = {20, 20, 20}, .noise = 0.05, .seed = 2};
  const CollapseMesh mesh(polygonised(grid, random_landscape(grid.cells, grid.seed)), {});
  const Terms terms(mesh, GetParam());
  const LindstromTurkPlacement placement(mesh, GetParam());
  int count = 0;
  for_each_inner_edge(mesh, [&](std::uint32_t h) {
    const Edge edge(mesh, h);
    const FloatPlaced found = placed(GetParam(), terms, edge);
    const Placed expected = placement.place(mesh, h, Merge::free);
    // By volume the pull to the middle of the edge is fainter in double precision.
    EXPECT_NEAR(length(Vec3d(found.r) + mesh.r[edge.u] - expected.r), 0, 2e-2) << h;
    EXPECT_NEAR(found.cost, expected.cost, 1e-3 * expected.cost + 1e-5) << h;
    ++count;
  });
  EXPECT_GT(count, 1000);
}

TEST_P(EdgeCostBy, OfManyIsThatOfEach) {
  const CollapseMesh mesh(noisy_plane(10, 0.05), {});
  const Terms terms(mesh, GetParam());
  EdgeCosts costs(GetParam());
  std::map<std::uint32_t, float> found;
  const auto finish = [&] {
    costs.finish([&](const EdgeCosts::Edge& edge, float cost, float square) {
      found[edge.h] = cost;
      EXPECT_EQ(edge.u, mesh.topology.origin(edge.h));
      EXPECT_EQ(edge.v, mesh.topology.target(edge.h));
      EXPECT_FLOAT_EQ(square, static_cast<float>(mesh.squared_length(edge.h)));
    });
  };
  std::size_t count = 0;
  for_each_inner_edge(mesh, [&](std::uint32_t h) {
    const Edge edge(mesh, h);
    costs.add({h, edge.u, edge.v}, lanes(edge.along), terms.of[edge.u], terms.of[edge.v],
              lanes(edge.a), lanes(edge.b));
    ++count;
    if (costs.is_full()) finish();
  });
  finish();
  ASSERT_GT(count, std::size_t{EdgeCosts::capacity});
  EXPECT_EQ(found.size(), count);
  for (const auto& [h, cost] : found) {
    const Edge edge(mesh, h);
    EXPECT_EQ(cost, placed(GetParam(), terms, edge).cost);
  }
}

INSTANTIATE_TEST_SUITE_P(Measures, EdgeCostBy, testing::Values(Measure::volume, Measure::distance));

TEST(EdgeCost, OfAPlaneRanksShortEdgesFirst) {
  const CollapseMesh mesh(noisy_plane(6, 0), {});
  const Terms terms(mesh);
  for_each_inner_edge(mesh, [&](std::uint32_t h) {
    const Edge edge(mesh, h);
    const FloatPlaced found = placed(Measure::distance, terms, edge);
    EXPECT_NEAR(found.r.z, 0, 1e-6F);
    const float square = dot(edge.along, edge.along);
    EXPECT_NEAR(found.cost, 1e-10F * square * square, 1e-11F);
  });
}

}  // namespace
}  // namespace scarp
