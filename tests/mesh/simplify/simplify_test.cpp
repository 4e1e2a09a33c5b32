#include "mesh/simplify/simplify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "core/error.h"
#include "core/parallel.h"
#include "mesh/distance.h"
#include "mesh/sides.h"
#include "tests/mesh/generated_surface.h"
#include "tests/mesh/quality.h"
#include "tests/mesh/self_intersections.h"

namespace scarp {
namespace {

using testing::HasSubstr;

void expect_sound(const TriMesh& result, const TriMesh& input, const Sides& sides) {
  const Defects defects = find_defects(result, input, sides);
  EXPECT_EQ(defects.non_manifold_edges, 0U);
  EXPECT_EQ(defects.zero_area, 0U);
  EXPECT_EQ(defects.flipped, 0U);
  EXPECT_EQ(defects.off_plane, 0U);
  EXPECT_EQ(defects.lost_corners, 0U);
}

/// A wide trench with vertical walls: what the default recipe simplifies.
TriMesh trench(const Grid& grid) {
  const double middle = 0.5 * grid.cells[0];
  return polygonised(grid, [=](Vec3d r) {
    const double wall = std::abs(r.x - middle) - 0.2 * grid.cells[0] - 0.13;
    return std::max(r.z - (grid.cells[2] - 3.27), -std::max(wall, 3.31 - r.z));
  });
}

struct SharedSurfaces {
  Grid via_grid{.cells = {113, 87, 62}, .noise = 0.006, .seed = 4};
  Grid trench_grid{.cells = {75, 72, 100}, .noise = 0.006, .seed = 5};
  TriMesh via = polygonised(via_grid, via_array(113, 87, 46));
  TriMesh trenches = polygonised(trench_grid, deep_trenches(75, 84));
};

const SharedSurfaces& surfaces() {
  static const SharedSurfaces shared;
  return shared;
}

/// The two reductions of the published comparison, on surfaces like those.
struct Reduction {
  const TriMesh& mesh;
  Sides sides;
  double remove;
};

std::vector<Reduction> published_reductions() {
  return {{surfaces().via, surfaces().via_grid.sides(), 0.78},
          {surfaces().trenches, surfaces().trench_grid.sides(), 0.52}};
}

struct MethodCase {
  SimplifyMethod method;
  PlacementMethod placement;
  const char* name;
};

class EveryMethod : public testing::TestWithParam<MethodCase> {
 protected:
  SimplifyOptions options(const Sides& sides) const {
    return {.method = GetParam().method, .placement = GetParam().placement, .sides = sides};
  }
};

TEST_P(EveryMethod, ReachesTheNumberOfVerticesWithoutADefect) {
  for (const Reduction& reduction : published_reductions()) {
    SimplifyOptions wanted = options(reduction.sides);
    wanted.remove = reduction.remove;
    const SimplifyResult result = simplify(reduction.mesh, wanted);
    EXPECT_EQ(result.stopped_by, "vertices");
    const auto count = static_cast<double>(reduction.mesh.vertices.size());
    EXPECT_EQ(result.mesh.vertices.size(),
              static_cast<std::size_t>(std::ceil((1 - reduction.remove) * count)));
    expect_sound(result.mesh, reduction.mesh, reduction.sides);
  }
}

TEST_P(EveryMethod, HoldsTheBoundInBothDirections) {
  const Grid& grid = surfaces().via_grid;
  const TriMesh& mesh = surfaces().via;
  SimplifyOptions wanted = options(grid.sides());
  wanted.max_error = 0.05;
  const SimplifyResult result = simplify(mesh, wanted);
  EXPECT_EQ(result.stopped_by, "max_error");
  const SurfaceDistance measured = surface_distance(mesh, result.mesh, 0.5);
  EXPECT_LE(measured.symmetric_max, result.proven_distance);
  EXPECT_LE(result.proven_distance, 0.05);
  EXPECT_LE(result.max_distance, measured.forward.max);
  EXPECT_LE(result.reverse_max_distance, result.proven_distance);
  EXPECT_GT(result.max_distance, 0.005);
  expect_sound(result.mesh, mesh, grid.sides());
  EXPECT_LT(result.mesh.vertices.size(), 0.6 * mesh.vertices.size());
}

/// Where few points are left to say where the surface is, the moves for better shapes must not draw
/// vertices off it: single ones were .1 spacings away.
TEST(Curvature, LeavesNoVertexFarFromTheSurfaceWhereHalfOfThemGo) {
  const TriMesh& mesh = surfaces().via;
  SimplifyOptions wanted{.method = SimplifyMethod::curvature};
  wanted.sides = surfaces().via_grid.sides();
  wanted.remove = 0.5;
  const SimplifyResult result = simplify(mesh, wanted);
  EXPECT_LE(surface_distance(mesh, result.mesh).reverse.max, 0.03);
}

TEST_P(EveryMethod, IsTheSameOnAnyNumberOfThreadsAndTheSecondTime) {
  const Grid& grid = surfaces().trench_grid;
  const TriMesh& mesh = surfaces().trenches;
  const auto on_threads = [&](int threads) {
    const ThreadLimit limit(threads);
    SimplifyOptions wanted = options(grid.sides());
    wanted.max_error = 0.1;
    return simplify(mesh, wanted);
  };
  const SimplifyResult one = on_threads(1);
  for (const int threads : {2, 3, 8}) {
    const SimplifyResult more = on_threads(threads);
    EXPECT_EQ(one.mesh.vertices, more.mesh.vertices);
    EXPECT_EQ(one.mesh.triangles, more.mesh.triangles);
    EXPECT_EQ(one.max_distance, more.max_distance);
    EXPECT_EQ(one.reverse_max_distance, more.reverse_max_distance);
  }
}

/// The outline on one side of the domain: its edges as their two places on the side.
using Outline = std::set<std::array<float, 4>>;

Outline outline(const TriMesh& mesh, int axis, double position) {
  std::map<std::array<std::uint32_t, 2>, int> facets;
  for (const Triangle& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t a = t[i];
      const std::uint32_t b = t[(i + 1) % 3];
      const bool on_side = mesh.vertices[a][axis] == position && mesh.vertices[b][axis] == position;
      if (on_side) ++facets[{std::min(a, b), std::max(a, b)}];
    }
  }
  Outline edges;
  for (const auto& [edge, count] : facets) {
    if (count > 1) continue;
    const Vec3f& a = mesh.vertices[edge[0]];
    const Vec3f& b = mesh.vertices[edge[1]];
    const std::array<float, 2> first{a[1 - axis], a.z};
    const std::array<float, 2> last{b[1 - axis], b.z};
    const auto& [low, high] = std::minmax(first, last);
    edges.insert({low[0], low[1], high[0], high[1]});
  }
  return edges;
}

/// The sides are copies of each other bit for bit, and coarser than before.
void expect_congruent_sides(const TriMesh& result, const TriMesh& input, const Grid& grid,
                            double most_left) {
  for (int axis = 0; axis < 2; ++axis) {
    const Outline before = outline(input, axis, 0);
    const Outline lower = outline(result, axis, 0);
    EXPECT_EQ(lower, outline(result, axis, grid.cells[axis]));
    EXPECT_LT(lower.size(), most_left * before.size());
    EXPECT_GT(lower.size(), 2U);
  }
}

TEST_P(EveryMethod, KeepsPeriodicSidesCongruentAndMakesThemCoarser) {
  const Grid grid{.cells = {60, 50, 30}, .noise = 0.006, .seed = 6, .periodic = true};
  const TriMesh mesh = polygonised(grid, periodic_landscape(60, 50, 14));
  SimplifyOptions wanted = options(grid.sides());
  wanted.spacing = 1;
  wanted.remove = 0.7;
  const SimplifyResult by_count = simplify(mesh, wanted);
  EXPECT_EQ(by_count.stopped_by, "vertices");
  expect_congruent_sides(by_count.mesh, mesh, grid, 0.7);
  expect_sound(by_count.mesh, mesh, grid.sides());

  wanted.remove.reset();
  wanted.max_error = 0.1;
  const SimplifyResult bounded = simplify(mesh, wanted);
  expect_congruent_sides(bounded.mesh, mesh, grid, 0.7);
  expect_sound(bounded.mesh, mesh, grid.sides());
  EXPECT_LE(surface_distance(mesh, bounded.mesh, 0.2).symmetric_max, 0.1);
}

// Narrow strips: along their short sides nothing is left but the corners.
TEST_P(EveryMethod, KeepsTheCornersOfNarrowPeriodicDomains) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const Grid grid{.cells = {12, 3, 12}, .noise = 0.005, .seed = seed, .periodic = true};
    const TriMesh mesh = polygonised(grid, [](Vec3d r) { return r.z - 8.4; });
    SimplifyOptions wanted = options(grid.sides());
    wanted.spacing = 1;
    wanted.max_error = 0.1;
    const TriMesh simple = simplify(mesh, wanted).mesh;
    double area = 0;
    for (std::size_t f = 0; f < simple.triangles.size(); ++f) area += area_vector(simple, f).z;
    EXPECT_NEAR(area, 12 * 3, 1e-3) << "seed " << seed;
  }
}

TEST_P(EveryMethod, KeepsSidesOfEachKindWhereOnlyOneAxisIsPeriodic) {
  const Grid grid{.cells = {60, 50, 30}, .noise = 0.006, .seed = 6, .periodic = true};
  const TriMesh mesh = polygonised(grid, periodic_landscape(60, 50, 14));
  for (const int periodic : {0, 1}) {
    SimplifyOptions wanted = options(grid.sides());
    wanted.sides.boundary[1 - periodic] = Boundary::reflective;
    wanted.spacing = 1;
    wanted.max_error = 0.1;
    const SimplifyResult result = simplify(mesh, wanted);
    const Outline before = outline(mesh, periodic, 0);
    const Outline lower = outline(result.mesh, periodic, 0);
    EXPECT_EQ(lower, outline(result.mesh, periodic, grid.cells[periodic]));
    EXPECT_LT(lower.size(), 0.7 * before.size());
    // The other sides, which were copies too, are simplified each by itself.
    EXPECT_NE(outline(result.mesh, 1 - periodic, 0),
              outline(result.mesh, 1 - periodic, grid.cells[1 - periodic]));
    expect_sound(result.mesh, mesh, wanted.sides);
    EXPECT_LE(surface_distance(mesh, result.mesh, 0.2).symmetric_max, 0.1);
  }
}

TEST_P(EveryMethod, HasTheSamePeriodicSidesOnAnyNumberOfThreads) {
  const Grid grid{.cells = {150, 120, 40}, .noise = 0.006, .seed = 7, .periodic = true};
  const TriMesh mesh = polygonised(grid, periodic_landscape(150, 120, 22));
  const auto on_threads = [&](int threads) {
    const ThreadLimit limit(threads);
    SimplifyOptions wanted = options(grid.sides());
    wanted.spacing = 1;
    wanted.remove = 0.7;
    wanted.measure = false;
    return simplify(mesh, wanted).mesh;
  };
  const TriMesh one = on_threads(1);
  expect_congruent_sides(one, mesh, grid, 0.6);
  for (const int threads : {2, 3, 8}) {
    const TriMesh more = on_threads(threads);
    EXPECT_EQ(one.vertices, more.vertices);
    EXPECT_EQ(one.triangles, more.triangles);
  }
}

// A wall just inside of a side: placed where the quadrics say, vertices would end up beyond it.
TEST_P(EveryMethod, LeavesNothingBeyondTheSides) {
  const Grid grid{.cells = {20, 60, 30}, .noise = 0.02, .seed = 6};
  const TriMesh mesh = polygonised(grid, [](Vec3d r) {
    return std::max(r.z - 20.3, 0.3 + 0.25 * std::sin(0.6 * r.y) * std::sin(0.5 * r.z) - r.x);
  });
  for (const double removed : {0.8, 0.95}) {
    SimplifyOptions wanted = options(grid.sides());
    wanted.spacing = 1;
    wanted.remove = removed;
    const SimplifyResult result = simplify(mesh, wanted);
    EXPECT_EQ(find_defects(result.mesh, mesh, grid.sides()).off_plane, 0U) << removed;
  }
}

TEST_P(EveryMethod, DoesNotPassOneSheetThroughAnotherToReachANumber) {
  const TriMesh mesh = wavy_film(30, 0.1F);
  for (const double removed : {0.5, 0.9, 0.98}) {
    SimplifyOptions wanted = options(sides_of(mesh));
    wanted.spacing = 1;
    wanted.remove = removed;
    const SimplifyResult result = simplify(mesh, wanted);
    EXPECT_EQ(self_intersections(result.mesh), 0U) << removed;
    EXPECT_LT(result.mesh.vertices.size(), 0.6 * mesh.vertices.size()) << removed;
    const bool is_reached =
        result.mesh.vertices.size() <= std::ceil((1 - removed) * mesh.vertices.size());
    EXPECT_EQ(result.stopped_by, is_reached ? "vertices" : "self_intersections") << removed;
  }
}

TEST_P(EveryMethod, LeavesLoneTrianglesAlone) {
  // Its last attempts have pieces of a single facet, around whose edges there is nothing.
  const Grid grid{.cells = {40, 40, 20}, .noise = 0.1, .seed = 5};
  const TriMesh mesh = polygonised(grid, random_landscape(grid.cells, 3));
  SimplifyOptions wanted = options(sides_of(mesh));
  wanted.spacing = 1;
  wanted.remove = 0.95;
  expect_sound(simplify(mesh, wanted).mesh, mesh, sides_of(mesh));
}

INSTANTIATE_TEST_SUITE_P(
    Methods, EveryMethod,
    testing::Values(
        MethodCase{SimplifyMethod::curvature, PlacementMethod::lindstrom_turk, "curvature"},
        MethodCase{SimplifyMethod::paper, PlacementMethod::lindstrom_turk, "paper"},
        MethodCase{SimplifyMethod::lindstrom_turk, PlacementMethod::lindstrom_turk, "lt"},
        MethodCase{SimplifyMethod::length, PlacementMethod::lindstrom_turk, "length"},
        MethodCase{SimplifyMethod::paper, PlacementMethod::garland_heckbert, "paper_gh"},
        MethodCase{SimplifyMethod::lindstrom_turk, PlacementMethod::garland_heckbert, "gh"}),
    [](const auto& tested) { return tested.param.name; });

TEST(Simplify, PaperIsAtLeastAFifthCloserThanShortestEdgeFirst) {
  for (const Reduction& reduction : published_reductions()) {
    const auto distance = [&reduction](SimplifyMethod method) {
      const SimplifyResult result = simplify(reduction.mesh, {.method = method,
                                                              .sides = reduction.sides,
                                                              .remove = reduction.remove,
                                                              .measure = false});
      return surface_distance(reduction.mesh, result.mesh).forward;
    };
    const DistanceStatistics paper = distance(SimplifyMethod::paper);
    const DistanceStatistics length = distance(SimplifyMethod::length);
    EXPECT_LT(paper.mean, 0.8 * length.mean);
    EXPECT_LT(paper.max, 0.8 * length.max);
  }
}

TEST(Simplify, CurvatureIsFarCloserThanLindstromTurkAtNoWorseAngles) {
  for (const Reduction& reduction : published_reductions()) {
    const auto simplified = [&reduction](SimplifyMethod method) {
      return simplify(reduction.mesh, {.method = method,
                                       .sides = reduction.sides,
                                       .spacing = 1,
                                       .remove = reduction.remove,
                                       .measure = false});
    };
    const SimplifyResult curvature = simplified(SimplifyMethod::curvature);
    const SimplifyResult reference = simplified(SimplifyMethod::lindstrom_turk);
    const SurfaceDistance distance = surface_distance(reduction.mesh, curvature.mesh);
    const SurfaceDistance expected = surface_distance(reduction.mesh, reference.mesh);
    EXPECT_LT(distance.forward.mean, 0.8 * expected.forward.mean);
    EXPECT_LT(distance.forward.max, 0.7 * expected.forward.max);
    EXPECT_GT(angle_statistics(curvature.mesh).mean_minimum,
              angle_statistics(reference.mesh).mean_minimum - 0.1);
    // What was tracked is what is measured, but for points whose facet is not the nearest.
    EXPECT_GE(curvature.max_distance, distance.forward.max - 1e-6);
    EXPECT_LT(curvature.max_distance, 1.2 * distance.forward.max);
  }
}

TEST(Simplify, AGreaterShapeWeightMakesBetterAngles) {
  const Grid& grid = surfaces().via_grid;
  const auto angle = [&grid](double weight) {
    const SimplifyResult result = simplify(surfaces().via, {.method = SimplifyMethod::curvature,
                                                            .sides = grid.sides(),
                                                            .spacing = 1,
                                                            .remove = 0.78,
                                                            .shape_weight = weight});
    return angle_statistics(result.mesh).mean_minimum;
  };
  EXPECT_GT(angle(3e-5), angle(0) + 2);
}

TEST(Simplify, CurvatureKeepsToTheLongestEdge) {
  const Grid& grid = surfaces().via_grid;
  const SimplifyResult result = simplify(surfaces().via, {.method = SimplifyMethod::curvature,
                                                          .sides = grid.sides(),
                                                          .spacing = 1,
                                                          .max_error = 100,
                                                          .l_max = 2});
  EXPECT_EQ(result.stopped_by, "sizes");
  float longest = 0;
  for (const Triangle& t : result.mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      const Vec3f e = result.mesh.vertices[t[i]] - result.mesh.vertices[t[(i + 1) % 3]];
      longest = std::max(longest, length(e));
    }
  }
  EXPECT_GT(longest, 3);
  EXPECT_LT(longest, 2 * 2 * 1.2) << "twice the size, and a little by the sweeps";
}

TEST(Simplify, OfATrenchWithDefaultsRemovesMostFacets) {
  const Grid grid{.cells = {60, 40, 50}};
  const TriMesh mesh = trench(grid);
  const SimplifyResult result = simplify(
      mesh, {.sides = grid.sides(), .spacing = 1, .max_error = 0.1, .l0 = 0.6, .l_max = 8});
  EXPECT_LT(result.mesh.triangles.size(), 0.4 * mesh.triangles.size());
  EXPECT_LE(result.max_distance, 0.1);
  expect_sound(result.mesh, mesh, grid.sides());
}

TEST(Simplify, CurvatureFollowsEveryVertexOverFlatWalls) {
  const Grid grid{.cells = {60, 40, 50}};
  const TriMesh mesh = trench(grid);
  const SimplifyResult result = simplify(mesh, {.method = SimplifyMethod::curvature,
                                                .sides = grid.sides(),
                                                .spacing = 1,
                                                .max_error = 0.1,
                                                .l_max = 8,
                                                .measure = false});
  EXPECT_LT(result.mesh.triangles.size(), 0.05 * mesh.triangles.size());
  EXPECT_NEAR(result.max_distance, surface_distance(mesh, result.mesh).forward.max, 1e-4);
  expect_sound(result.mesh, mesh, grid.sides());
}

TEST(Simplify, ReachesANumberOfVerticesWithinHalfASpacingIfItCan) {
  const TriMesh& mesh = surfaces().via;
  const auto proven = [&mesh](double remove) {
    const SimplifyResult result = simplify(mesh, {.method = SimplifyMethod::length,
                                                  .sides = surfaces().via_grid.sides(),
                                                  .spacing = 1,
                                                  .remove = remove});
    EXPECT_EQ(result.stopped_by, "vertices");
    EXPECT_LE(surface_distance(mesh, result.mesh).symmetric_max, result.proven_distance);
    return result.proven_distance;
  };
  EXPECT_LE(proven(0.5), 0.5);
  EXPECT_GT(proven(0.95), 0.5);
}

TEST(Simplify, OfAPlaneLeavesNoErrorAndFewFacets) {
  const TriMesh mesh = noisy_plane(20, 0);
  for (const SimplifyMethod method : {SimplifyMethod::curvature, SimplifyMethod::paper}) {
    const SimplifyResult result = simplify(
        mesh, {.method = method, .sides = sides_of(mesh), .spacing = 1, .max_error = 1e-4});
    EXPECT_LE(result.mesh.vertices.size(), 12U);
    EXPECT_LT(result.max_distance, 1e-5);
    expect_sound(result.mesh, mesh, sides_of(mesh));
  }
}

TEST(Simplify, OfASphereKeepsItsVolume) {
  const TriMesh mesh = octahedral_sphere(20, 20);
  const auto volume = [](const TriMesh& m) {
    double sum = 0;
    for (std::size_t f = 0; f < m.triangles.size(); ++f) {
      sum += dot(area_vector(m, f), corners(m, f)[0]) / 3;
    }
    return sum;
  };
  const SimplifyResult result =
      simplify(mesh, {.method = SimplifyMethod::lindstrom_turk, .vertices = 200});
  EXPECT_EQ(result.mesh.vertices.size(), 200U);
  EXPECT_NEAR(volume(result.mesh), volume(mesh), 1e-5 * volume(mesh));
}

TEST(Simplify, KeepsBordersBetweenMaterials) {
  // Three layers in the walls of a trench, cut by facets.
  const Grid grid{.cells = {40, 30, 40}};
  TriMesh mesh = trench(grid);
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto p = corners(mesh, f);
    const double z = (p[0].z + p[1].z + p[2].z) / 3;
    mesh.materials.push_back(z < 12.5 ? 1 : z < 24.5 ? 2 : 3);
  }
  const SimplifyResult result =
      simplify(mesh, {.sides = grid.sides(), .spacing = 1, .max_error = 0.1});
  ASSERT_EQ(result.mesh.materials.size(), result.mesh.triangles.size());
  expect_sound(result.mesh, mesh, grid.sides());
  EXPECT_LT(result.mesh.triangles.size(), 0.4 * mesh.triangles.size());
  // The part of each material is where it was: within the bound of its own facets.
  for (const MaterialId material : {1, 2, 3}) {
    const auto part = [material](const TriMesh& whole) {
      TriMesh m{whole.vertices, {}, {}};
      for (std::size_t f = 0; f < whole.triangles.size(); ++f) {
        if (whole.materials[f] == material) m.triangles.push_back(whole.triangles[f]);
      }
      return m;
    };
    EXPECT_LE(surface_distance(part(mesh), part(result.mesh), 0.2).symmetric_max, 0.15);
  }
}

TEST(Simplify, SizesAloneStopIt) {
  const Grid& grid = surfaces().via_grid;
  const TriMesh& mesh = surfaces().via;
  const SimplifyResult length =
      simplify(mesh, {.method = SimplifyMethod::length, .sides = grid.sides(), .l0 = 1.5});
  EXPECT_EQ(length.stopped_by, "sizes");
  std::size_t shorter = 0;
  for (const Triangle& t : length.mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      const Vec3f e = length.mesh.vertices[t[i]] - length.mesh.vertices[t[(i + 1) % 3]];
      shorter += dot(e, e) < 1.5F * 1.5F ? 1 : 0;
    }
  }
  // Those that are left are needed for the shape or the topology.
  EXPECT_LT(shorter, 0.02 * 3 * length.mesh.triangles.size());

  const SimplifyResult paper = simplify(mesh, {.method = SimplifyMethod::paper,
                                               .sides = grid.sides(),
                                               .spacing = 1,
                                               .max_error = 100,
                                               .l0 = 0.6,
                                               .l_max = 2});
  EXPECT_EQ(paper.stopped_by, "sizes");
}

TEST(Simplify, L0OfZeroKeepsTheFeatures) {
  const Grid& grid = surfaces().via_grid;
  const TriMesh& mesh = surfaces().via;
  const SimplifyResult result = simplify(mesh, {.method = SimplifyMethod::paper,
                                                .sides = grid.sides(),
                                                .spacing = 1,
                                                .max_error = 100,
                                                .l0 = 0,
                                                .l_max = 2});
  EXPECT_EQ(result.stopped_by, "sizes");
  EXPECT_LT(result.mesh.vertices.size(), 0.8 * mesh.vertices.size());
  const SimplifyResult counted = simplify(mesh, {.method = SimplifyMethod::paper,
                                                 .sides = grid.sides(),
                                                 .spacing = 1,
                                                 .remove = 0.9,
                                                 .l0 = 0});
  EXPECT_EQ(counted.stopped_by, "vertices") << "l0 is raised where the sizes do not allow it";
}

TEST(Simplify, L0AboveLMaxRaisesIt) {
  const Grid& grid = surfaces().via_grid;
  const TriMesh& mesh = surfaces().via;
  const auto with_l_max = [&](double l_max) {
    return simplify(mesh, {.method = SimplifyMethod::paper,
                           .sides = grid.sides(),
                           .max_error = 1,
                           .l0 = 2,
                           .l_max = l_max})
        .mesh;
  };
  EXPECT_EQ(with_l_max(0.1).vertices, with_l_max(2).vertices);
}

TEST(Simplify, SizesWithoutAGridComeFromTheMesh) {
  // The same surface in nm and in um: the same mesh, scaled. Scaling by a power of two is exact.
  const TriMesh& mesh = surfaces().via;
  TriMesh scaled = mesh;
  for (Vec3f& r : scaled.vertices) r = 1024.0F * r;
  const TriMesh a = simplify(mesh, {.sides = sides_of(mesh)}).mesh;
  const TriMesh b = simplify(scaled, {.sides = sides_of(scaled)}).mesh;
  ASSERT_EQ(a.triangles, b.triangles);
  for (std::size_t v = 0; v < a.vertices.size(); ++v) {
    ASSERT_EQ(1024.0F * a.vertices[v], b.vertices[v]);
  }
  EXPECT_LT(a.vertices.size(), 0.5 * mesh.vertices.size());
}

TEST(Simplify, CallersCurvatureAndSizeLimitAreUsed) {
  const Grid& grid = surfaces().via_grid;
  const TriMesh& mesh = surfaces().via;
  const std::vector<float> curved(mesh.vertices.size(), 1);
  const SimplifyResult all_features = simplify(mesh, {.method = SimplifyMethod::paper,
                                                      .sides = grid.sides(),
                                                      .spacing = 1,
                                                      .l0 = 0,
                                                      .curvature = curved});
  EXPECT_EQ(all_features.mesh.vertices.size(), mesh.vertices.size());

  std::vector<float> limit(mesh.vertices.size());
  for (std::size_t v = 0; v < limit.size(); ++v) limit[v] = mesh.vertices[v].x < 50 ? 0.0F : 1e9F;
  const SimplifyResult half = simplify(
      mesh,
      {.method = SimplifyMethod::paper, .sides = grid.sides(), .spacing = 1, .size_limit = limit});
  // Those on the left stay where they are, all of them; others may come over.
  const auto sorted = [](const TriMesh& m, float end) {
    std::vector<std::array<float, 3>> places;
    for (const Vec3f& r : m.vertices) {
      if (r.x < end) places.push_back({r.x, r.y, r.z});
    }
    std::sort(places.begin(), places.end());
    return places;
  };
  const auto before = sorted(mesh, 50);
  const auto after = sorted(half.mesh, 51);
  EXPECT_TRUE(std::includes(after.begin(), after.end(), before.begin(), before.end()));
  EXPECT_EQ(sorted(half.mesh, 49), sorted(mesh, 49));
  EXPECT_LT(half.mesh.vertices.size(), 0.8 * mesh.vertices.size());
}

TEST(Simplify, ZeroAreaAndRepeatedTrianglesOfTheInputAreGone) {
  TriMesh mesh = noisy_plane(10, 0.01);
  // A needle: an edge of length zero put into the middle of an edge. A cap: a vertex on an edge.
  for (std::size_t kind = 0; kind < 2; ++kind) {
    const Triangle t = mesh.triangles[40 + 50 * kind];
    const Vec3f a = mesh.vertices[t[0]];
    const Vec3f b = mesh.vertices[t[1]];
    const auto v = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(kind == 0 ? a : 0.5F * (a + b));
    // The triangle keeps its own edge; a new one without area fills the gap to its neighbour.
    mesh.triangles[40 + 50 * kind] = {t[0], v, t[2]};
    mesh.triangles.push_back({v, t[1], t[2]});
    mesh.triangles.push_back({t[0], t[1], v});
  }
  mesh.triangles.push_back(mesh.triangles[3]);
  const SimplifyResult result =
      simplify(mesh, {.sides = sides_of(mesh), .spacing = 1, .remove = 0});
  expect_sound(result.mesh, mesh, sides_of(mesh));
  EXPECT_LT(result.max_distance, 1e-5);
}

// A surface that bends so little that many of its vertices may go within the bound, but none within
// a fifth of it. Removing the facet without area would move a vertex by four fifths of it.
TEST(Simplify, RemovingWhatHasNoAreaTakesAtMostHalfOfTheBound) {
  constexpr double max_error = 1.1e-3;
  TriMesh mesh = noisy_plane(16, 0);
  for (Vec3f& r : mesh.vertices) r.z += (r.x * r.x + r.y * r.y) / 2000;
  const auto vertices_left = [&] {
    return simplify(mesh, {.method = SimplifyMethod::lindstrom_turk,
                           .sides = sides_of(mesh),
                           .spacing = 1,
                           .max_error = max_error})
        .mesh.vertices.size();
  };
  const std::size_t without = vertices_left();
  EXPECT_LT(without, 0.75 * mesh.vertices.size());
  const Triangle t = mesh.triangles[200];
  const auto v = static_cast<std::uint32_t>(mesh.vertices.size());
  const Vec3f along = mesh.vertices[t[1]] - mesh.vertices[t[0]];
  const auto moved = static_cast<float>(0.8 * max_error);
  mesh.vertices.push_back(mesh.vertices[t[0]] + moved / length(along) * along);
  mesh.triangles[200] = {t[0], v, t[2]};
  mesh.triangles.push_back({v, t[1], t[2]});
  mesh.triangles.push_back({t[0], t[1], v});
  EXPECT_LT(vertices_left(), without + 12);
}

/// Two shells that are a little apart, and elsewhere two spheres that pass through each other.
TriMesh shells_and_crossing_spheres() {
  TriMesh mesh;
  const auto add = [&mesh](const TriMesh& part, bool inside_out) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (Triangle t : part.triangles) {
      if (inside_out) std::swap(t[0], t[1]);
      mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
  };
  add(octahedral_sphere(1.04, 12), true);
  add(octahedral_sphere(1, 12), false);
  add(octahedral_sphere(1, 30, {5, 0, 0}), false);
  add(octahedral_sphere(1, 30, {6.5, 0.1, 0.2}), false);
  return mesh;
}

TEST(Simplify, CrossingsOfTheInputAllowNoOthers) {
  const TriMesh mesh = shells_and_crossing_spheres();
  ASSERT_GT(self_intersections(mesh), 20U);
  for (const SimplifyMethod method : {SimplifyMethod::curvature, SimplifyMethod::lindstrom_turk}) {
    for (const double bound : {0.1, 0.15, 0.2, 0.25, 0.3}) {
      const SimplifyResult result =
          simplify(mesh, {.method = method, .spacing = 0.2, .max_error = bound});
      TriMesh shells = result.mesh;
      shells.triangles.clear();
      for (const Triangle& t : result.mesh.triangles) {
        if (result.mesh.vertices[t[0]].x < 2) shells.triangles.push_back(t);
      }
      EXPECT_EQ(self_intersections(shells), 0U) << bound;
    }
  }
}

// In single precision the ranks of edges on long slivers are far off.
TEST(Simplify, StretchedMeshesAreReducedLikeOthers) {
  TriMesh mesh = octahedral_sphere(1, 12);
  for (Vec3f& r : mesh.vertices) r.x *= 1000;
  for (const std::size_t wanted : {250U, 242U, 150U}) {
    const SimplifyResult result = simplify(mesh, {.vertices = wanted});
    EXPECT_EQ(result.mesh.vertices.size(), wanted);
  }
}

}  // namespace
}  // namespace scarp
