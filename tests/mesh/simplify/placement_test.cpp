#include "mesh/simplify/placement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

/// Signed volume between a closed mesh and the origin.
double volume(const CollapseMesh& mesh) {
  double sum = 0;
  for (std::uint32_t f = 0; f < mesh.topology.facet_count(); ++f) {
    if (!mesh.topology.alive(f)) continue;
    sum += dot(mesh.normal_of(f), mesh.r[mesh.topology.origin(3 * f)]) / 6;
  }
  return sum;
}

std::uint32_t half_edge(const CollapseMesh& mesh, std::uint32_t from, std::uint32_t to) {
  std::uint32_t found = HalfEdges::none;
  mesh.topology.for_each_outgoing(from, [&](std::uint32_t h) {
    if (mesh.topology.target(h) == to) found = h;
  });
  return found;
}

double squared_volumes_around(const CollapseMesh& mesh, std::uint32_t h, Vec3d r) {
  std::set<std::uint32_t> facets;  // each once, those of the edge too
  for (const std::uint32_t v : {mesh.topology.origin(h), mesh.topology.target(h)}) {
    mesh.topology.for_each_outgoing(v,
                                    [&](std::uint32_t g) { facets.insert(HalfEdges::facet(g)); });
  }
  double sum = 0;
  for (const std::uint32_t f : facets) {
    const double volume = dot(mesh.normals[f], r - mesh.r[mesh.topology.origin(3 * f)]);
    sum += volume * volume;
  }
  return sum;
}

TEST(LindstromTurk, KeepsTheVolume) {
  CollapseMesh mesh(octahedral_sphere(10, 6), {});
  const double before = volume(mesh);
  const LindstromTurkPlacement placement(mesh);
  for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); h += 11) {
    CollapseMesh copy = mesh;
    const Placed placed = placement.place(mesh, h, Merge::free);
    const std::uint32_t u = copy.topology.origin(h);
    copy.topology.collapse(h);
    copy.r[u] = placed.r;
    EXPECT_NEAR(volume(copy), before, 1e-4) << "half edge " << h;  // float places
    EXPECT_GT(placed.cost, 0);
  }
}

TEST(LindstromTurk, CostsTheSumOfTheSquaredVolumesOfTheFacetsAround) {
  const CollapseMesh mesh(octahedral_sphere(10, 6), {});
  const LindstromTurkPlacement placement(mesh);
  for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); h += 17) {
    const Placed placed = placement.place(mesh, h, Merge::free);
    const double sum = squared_volumes_around(mesh, h, placed.r);
    EXPECT_NEAR(placed.cost, sum, 1e-6 * sum);
  }
}

TEST(LindstromTurk, StaysInAPlaneNearTheMiddleOfTheEdge) {
  const CollapseMesh mesh(noisy_plane(8, 0), {});
  const LindstromTurkPlacement placement(mesh);
  for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); ++h) {
    const std::uint32_t u = mesh.topology.origin(h);
    const std::uint32_t v = mesh.topology.target(h);
    if (mesh.topology.on_boundary(u) || mesh.topology.on_boundary(v)) continue;
    const Placed placed = placement.place(mesh, h, Merge::free);
    EXPECT_NEAR(length(placed.r - 0.5 * (mesh.r[u] + mesh.r[v])), 0, 1e-6);
    EXPECT_NEAR(placed.cost, 1e-10 * std::pow(mesh.squared_length(h), 3), 1e-15);
  }
}

class CornerPlacement : public testing::Test {
 protected:
  /// A box's corner at 0 with the vertex next to it, on the ridge along -x.
  CornerPlacement() : mesh_(corner(), {}), edge_(half_edge(mesh_, 0, 1)) {}

  static TriMesh corner() {
    return {
        {{0, 0, 0},
         {-1, 0, 0},
         {-2, 0, 0},
         {0, -2, 0},
         {-2, -2, 0},
         {0, 0, -2},
         {-2, 0, -2},
         {0, -2, -2}},
        {{0, 1, 3}, {1, 4, 3}, {1, 2, 4}, {0, 5, 1}, {1, 5, 6}, {1, 6, 2}, {0, 3, 7}, {0, 7, 5}},
        {}};
  }

  CollapseMesh mesh_;
  std::uint32_t edge_;
};

TEST_F(CornerPlacement, LindstromTurkKeepsASharpCorner) {
  const Placed placed = LindstromTurkPlacement(mesh_).place(mesh_, edge_, Merge::free);
  EXPECT_NEAR(length(placed.r - mesh_.r[0]), 0, 1e-4);
  EXPECT_NEAR(placed.cost, 0, 1e-8);
}

TEST_F(CornerPlacement, GarlandHeckbertKeepsASharpCorner) {
  const Placed placed = GarlandHeckbertPlacement(mesh_).place(mesh_, edge_, Merge::free);
  EXPECT_NEAR(length(placed.r - mesh_.r[0]), 0, 1e-4);
}

TEST_F(CornerPlacement, RulesChooseAmongTheEnds) {
  const LindstromTurkPlacement placement(mesh_);
  EXPECT_EQ(placement.place(mesh_, edge_, Merge::onto_origin).r, mesh_.r[0]);
  EXPECT_EQ(placement.place(mesh_, edge_, Merge::onto_target).r, mesh_.r[1]);
  EXPECT_EQ(placement.place(mesh_, edge_, Merge::onto_either).r, mesh_.r[0])
      << "the corner costs 0";
}

TEST(LindstromTurk, CostsTheAreaUnderTheOutlineOnASideToo) {
  const Grid grid{.cells = {12, 12, 12}, .noise = 0.05};
  const CollapseMesh mesh(polygonised(grid, random_landscape(grid.cells, 5)), grid.sides());
  const LindstromTurkPlacement placement(mesh);
  int on_side = 0;
  for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); ++h) {
    const std::uint32_t u = mesh.topology.origin(h);
    if (mesh.sides[u] == 0 || mesh.sides[mesh.topology.target(h)] != 0 ||
        merge_rule(mesh, h) != Merge::free) {
      continue;
    }
    ++on_side;
    const Placed placed = placement.place(mesh, h, Merge::free);
    double areas = 0;  // squares of twice the areas
    mesh.topology.for_each_neighbour(u, [&](std::uint32_t w) {
      const bool on_outline = half_edge(mesh, u, w) == HalfEdges::none ||
                              mesh.topology.opposite(half_edge(mesh, u, w)) == HalfEdges::none;
      const Vec3d area = cross(placed.r - mesh.r[u], mesh.r[w] - mesh.r[u]);
      areas += on_outline ? dot(area, area) : 0;
    });
    // Six times the volume of a prism over an area is three times its height times twice the area.
    const double height = 0.5 * std::sqrt(mesh.squared_length(h));
    const double sum = squared_volumes_around(mesh, h, placed.r) + 9 * height * height * areas;
    EXPECT_NEAR(placed.cost, sum, 1e-6 * sum + 1e-9);
  }
  EXPECT_GT(on_side, 20);
}

/// The same periodic surface, its origin elsewhere: what lies on a side of the one is inside the
/// other.
struct PeriodicSurface {
  static constexpr int shift = 7;
  Grid grid{.cells = {24, 24, 24}, .periodic = true};
  Shape shape = periodic_landscape(24, 24, 8);
  CollapseMesh cut{polygonised(grid, shape), grid.sides()};
  CollapseMesh whole{polygonised(grid,
                                 [this](Vec3d r) {
                                   return shape({r.x - shift, r.y, r.z});
                                 }),
                     grid.sides()};

  /// The vertex of the whole surface for one of the cut one.
  std::uint32_t inside(std::uint32_t v) const {
    const Vec3d place = cut.r[v] + cut.centre + Vec3d{shift, 0, 0};
    for (std::uint32_t w = 0; w < whole.r.size(); ++w) {
      if (length(whole.r[w] + whole.centre - place) < 1e-3) return w;
    }
    return HalfEdges::none;
  }
};

template <class PlacementOf>
void expect_twin_edges_to_be_placed_as_inside(const PeriodicSurface& surface,
                                              const PlacementOf& placement_of) {
  const auto at_sides = placement_of(surface.cut);
  const auto inside = placement_of(surface.whole);
  int compared = 0;
  for (std::uint32_t h = 0; h < surface.cut.topology.half_edge_count(); ++h) {
    const std::uint32_t u = surface.cut.topology.origin(h);
    const std::uint32_t v = surface.cut.topology.target(h);
    if (merge_rule(surface.cut, h) != Merge::free || surface.cut.sides[u] != 1 ||
        surface.cut.twin_edge(h) == HalfEdges::none) {
      continue;
    }
    const std::uint32_t g = half_edge(surface.whole, surface.inside(u), surface.inside(v));
    ASSERT_NE(g, HalfEdges::none);
    ++compared;
    // Only the ends are places that both may take.
    const Placed a = at_sides.place(surface.cut, h, Merge::onto_target);
    const Placed b = inside.place(surface.whole, g, Merge::onto_target);
    EXPECT_NEAR(a.cost, b.cost, 1e-4 * b.cost + 1e-6);
    const Placed free = at_sides.place(surface.cut, h, Merge::free);
    EXPECT_LE(free.cost, a.cost + 1e-6);
    EXPECT_EQ(free.r.x, surface.cut.r[u].x);
  }
  EXPECT_GT(compared, 20);
}

TEST(Placement, OfTwinEdgesCostsWhatTheSameEdgeCostsInside) {
  const PeriodicSurface surface;
  expect_twin_edges_to_be_placed_as_inside(
      surface, [](const CollapseMesh& mesh) { return LindstromTurkPlacement(mesh); });
  expect_twin_edges_to_be_placed_as_inside(surface, [](const CollapseMesh& mesh) {
    return LindstromTurkPlacement(mesh, LindstromTurkPlacement::Measure::distance);
  });
  expect_twin_edges_to_be_placed_as_inside(
      surface, [](const CollapseMesh& mesh) { return GarlandHeckbertPlacement(mesh); });
}

TEST(Placement, StaysOnTheSideOfTheDomain) {
  const Grid grid{.cells = {12, 12, 12}, .noise = 0.05};
  const TriMesh input = polygonised(grid, random_landscape(grid.cells, 5));
  const CollapseMesh mesh(input, grid.sides());
  const LindstromTurkPlacement placement(mesh);
  int on_side = 0;
  for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); ++h) {
    const Merge rule = merge_rule(mesh, h);
    const SideMask mask = mesh.sides[mesh.topology.origin(h)] | mesh.sides[mesh.topology.target(h)];
    if (rule == Merge::forbidden || mask == 0) continue;
    ++on_side;
    const Vec3d r = placement.place(mesh, h, rule).r + mesh.centre;
    for (int axis = 0; axis < 2; ++axis) {
      if (fixes(mask, axis)) {
        EXPECT_EQ(r[axis], mask >> (2 * axis) & 1 ? 0 : 12);
      }
    }
  }
  EXPECT_GT(on_side, 40);
}

}  // namespace
}  // namespace scarp
