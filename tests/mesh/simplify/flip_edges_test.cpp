#include "mesh/simplify/flip_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "mesh/simplify/facet_shape.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

/// A height field over a square of cells x cells, each cut along its diagonal.
template <class Height>
TriMesh field(int cells, const Height& height) {
  TriMesh mesh;
  const auto at = [&](int x, int y) { return static_cast<std::uint32_t>(y * (cells + 1) + x); };
  for (int y = 0; y <= cells; ++y) {
    for (int x = 0; x <= cells; ++x) {
      const auto a = static_cast<float>(x);
      const auto b = static_cast<float>(y);
      mesh.vertices.push_back({a, b, height(a, b)});
    }
  }
  for (int y = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) {
      mesh.triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      mesh.triangles.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  }
  return mesh;
}

/// What flips of a mesh need, with the vertices of the mesh as its points.
struct Flips {
  explicit Flips(const TriMesh& input, const Sides& sides = {}) : mesh(input, sides) {}

  /// Returns the proven distance between the mesh before and after.
  double run(double shape_weight, double l_max = infinite, double max_error = infinite) {
    const LargeVector<Vec3d> reference = mesh.normals;
    const EdgeSizes sizes{.field = {}, .limit = {}, .l_max = l_max};
    CollapseChecks limits(mesh, {max_error}, 1);
    for (int pass = 0; pass < 3; ++pass) {
      flip_edges(mesh, limits, points, sizes, shape_weight, reference, pass);
    }
    return limits.proven_error(mesh.topology);
  }

  double lowest_shape() const {
    double worst = 0;
    for (std::uint32_t f = 0; f < mesh.topology.facet_count(); ++f) {
      const auto corner = [&](std::uint32_t i) { return mesh.r[mesh.topology.origin(3 * f + i)]; };
      worst = std::max(worst, facet_shape(corner(0), corner(1), corner(2), mesh.normals[f]));
    }
    return worst;
  }

  static constexpr double infinite = std::numeric_limits<double>::infinity();

  CollapseMesh mesh;
  TrackedPoints points{mesh};
  CollapseChecks checks{mesh, {}, 1};
};

/// Sheared by one cell: the cut along the other diagonal has equal angles of 45 degrees.
TriMesh sheared_plane() {
  TriMesh mesh = field(8, [](float, float) { return 0.0F; });
  for (Vec3f& r : mesh.vertices) r.x += r.y;
  return mesh;
}

TEST(FlipEdges, GiveAShearedPlaneItsBestShapes) {
  Flips flips(sheared_plane());
  const double before = flips.lowest_shape();
  flips.run(1e-3);
  // Two edges of 1 and one of sqrt 2: 1 - sqrt 3 / 2 of what has equal sides.
  EXPECT_NEAR(flips.lowest_shape(), 1 - std::sqrt(3.0) / 2, 1e-6);
  EXPECT_GT(before, 0.4);
  for (std::uint32_t f = 0; f < flips.mesh.topology.facet_count(); ++f) {
    const Vec3d n = flips.mesh.normal_of(f);
    EXPECT_EQ(n, flips.mesh.normals[f]);
    EXPECT_NEAR(n.z, 1, 1e-6);
  }
}

TEST(FlipEdges, MayMakeLongEdgesShorterThoughNotShortEnough) {
  Flips flips(sheared_plane());
  flips.run(1e-3, 0.1);
  EXPECT_NEAR(flips.lowest_shape(), 1 - std::sqrt(3.0) / 2, 1e-6);
}

TEST(FlipEdges, ChangeNothingThatIsGoodAlready) {
  Flips flips(noisy_plane(20, 0.05));
  const TriMesh before = flips.mesh.extract();
  flips.run(0);
  EXPECT_EQ(flips.mesh.extract().triangles, before.triangles);
}

/// A roof of four facets around a point in the middle of its ridge, 4 long from vertex 0 to 1.
TriMesh roof() {
  return {{{-2, 0, 0}, {2, 0, 0}, {0, 1, -0.2F}, {0, -1, -0.2F}, {0, 0, 0}},
          {{4, 1, 2}, {0, 4, 2}, {1, 4, 3}, {4, 0, 3}},
          {}};
}

/// The roof without the point on its ridge, which is still to be followed, and with the edge turned
/// across; then what flips make of it.
class FlipEdgesOfARoof : public testing::Test {
 protected:
  FlipEdgesOfARoof() {
    EXPECT_TRUE(flips.checks.gather(flips.mesh, half_edge(0, 4), flips.mesh.r[0]));
    EXPECT_TRUE(flips.checks.keeps_surface(flips.mesh, half_edge(0, 4)));
    take_over();
    flips.mesh.collapse(half_edge(0, 4), flips.mesh.r[0]);
    EXPECT_TRUE(has_ridge());
    const LargeVector<Vec3d> reference = flips.mesh.normals;
    flips.checks.gather_flip(flips.mesh, half_edge(0, 1));
    EXPECT_TRUE(flips.checks.may_flip(flips.mesh, half_edge(0, 1), reference));
    take_over();
    flips.mesh.topology.flip(half_edge(0, 1));
    EXPECT_FALSE(has_ridge());
    EXPECT_NEAR(distance(), 0.2 / std::sqrt(1.01), 1e-6);
  }

  bool has_ridge() const { return half_edge(0, 1) != HalfEdges::none; }
  double distance() const { return flips.points.largest(flips.mesh); }

  Flips flips{roof()};

 private:
  std::uint32_t half_edge(std::uint32_t from, std::uint32_t to) const {
    std::uint32_t found = HalfEdges::none;
    flips.mesh.topology.for_each_outgoing(from, [&](std::uint32_t h) {
      if (flips.mesh.topology.target(h) == to) found = h;
    });
    return found;
  }

  void take_over() {
    flips.points.move(flips.checks.star(), flips.checks.fan(flips.mesh));
    const Star& star = flips.checks.star();
    for (int i = 0; i < star.count; ++i) {
      flips.mesh.normals[star.facet[i]] = flips.checks.normals()[i];
    }
  }
};

TEST_F(FlipEdgesOfARoof, PutTheEdgeAlongTheRidge) {
  flips.run(0, 2);
  EXPECT_TRUE(has_ridge());
  EXPECT_NEAR(distance(), 0, 1e-6);
}

TEST_F(FlipEdgesOfARoof, MakeNoEdgeLongerThanTwiceItsLimit) {
  flips.run(0, 1.99);
  EXPECT_FALSE(has_ridge());
}

TEST_F(FlipEdgesOfARoof, KeepTheBound) {
  // The ridge lies .2 above the edge across.
  flips.run(0, Flips::infinite, 0.199);
  EXPECT_FALSE(has_ridge());
  EXPECT_NEAR(flips.run(0, Flips::infinite, 0.201), 0.2, 1e-6);
  EXPECT_TRUE(has_ridge());
}

/// A roof of two facets whose ridge, 4 long, runs from vertex 0 to 1.
Flips two_facets(float height) {
  return Flips(
      {{{-2, 0, 0}, {2, 0, 0}, {0, 1, -height}, {0, -1, -height}}, {{0, 1, 2}, {1, 0, 3}}, {}});
}

/// Whether the edge of half edge 0 may be flipped, as far as the facets around it say.
bool may_flip(Flips& flips) {
  const LargeVector<Vec3d> reference = flips.mesh.normals;
  flips.checks.gather_flip(flips.mesh, 0);
  return flips.checks.may_flip(flips.mesh, 0, reference);
}
bool may_flip(Flips&& flips) { return may_flip(flips); }

TEST(FlipEdges, TurnFacetsByLessThan30Degrees) {
  // From (0, 1, 1 / height) to (1, 0, 2 / height), in directions.
  const auto cosine = [](double height) {
    return 2 / (std::sqrt(1 + height * height) * std::sqrt(4 + height * height));
  };
  constexpr double lowest = 0.87;
  EXPECT_GT(cosine(0.49), lowest);
  EXPECT_TRUE(may_flip(two_facets(0.49F)));
  EXPECT_LT(cosine(0.5), lowest);
  EXPECT_FALSE(may_flip(two_facets(0.5F)));
}

TEST(FlipEdges, KeepFacetsFacingWhereTheInputDid) {
  const auto tilted = [](double angle) {
    Flips flips = two_facets(0);
    CollapseMesh& mesh = flips.mesh;
    for (Vec3d& r : mesh.r) r = {r.x, std::cos(angle) * r.y, std::sin(angle) * r.y};
    for (std::uint32_t f = 0; f < mesh.normals.size(); ++f) mesh.normals[f] = mesh.normal_of(f);
    return flips;
  };
  EXPECT_TRUE(may_flip(tilted(0.6)));
  EXPECT_FALSE(may_flip(tilted(0.75)));
}

TEST(FlipEdges, MakeNoFacetThatIsTooThin) {
  const auto kite = [](float x) {
    return Flips({{{-x, 0, 0}, {2, 0, 0}, {0, 1, 0}, {0, -1, 0}}, {{0, 1, 2}, {1, 0, 3}}, {}});
  };
  EXPECT_TRUE(may_flip(kite(0.01F)));
  EXPECT_FALSE(may_flip(kite(0.001F)));
}

TEST(FlipEdges, MakeNoFoldWithTheFacetsAround) {
  constexpr float height = 0.49F;
  TriMesh mesh{
      {{-2, 0, 0}, {2, 0, 0}, {0, 1, -height}, {0, -1, -height}}, {{0, 1, 2}, {1, 0, 3}}, {}};
  EXPECT_TRUE(may_flip(Flips(mesh)));
  // A third facet at the edge from 1 to 2, along n: at 96 degrees to facet 0, but at 111 to the
  // facet that gets that edge.
  const Vec3f n{0.9F, 1.8F - 0.9F * height, -0.9F};
  const Vec3f e = mesh.vertices[1] - mesh.vertices[2];
  mesh.vertices.push_back(mesh.vertices[1] + 0.3F * cross(n, e));
  mesh.triangles.push_back({2, 1, 4});
  EXPECT_FALSE(may_flip(Flips(mesh)));
}

TEST(FlipEdges, KeepBordersOfMaterialsAndTheBoundary) {
  TriMesh mesh = sheared_plane();
  mesh.materials.resize(mesh.triangles.size());
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) mesh.materials[f] = f % 2 == 0 ? 0 : 1;
  Flips flips(mesh);
  flips.run(1e-3);
  // All diagonals lie between two materials; no flip of the other edges is better.
  EXPECT_EQ(flips.mesh.extract().triangles, mesh.triangles);
}

}  // namespace
}  // namespace scarp
