#include "levelset/metrology/region_surface.h"

#include <gtest/gtest.h>

#include <map>
#include <numbers>
#include <random>
#include <set>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/operations/layer_steps.h"
#include "tests/levelset/region_checks.h"
#include "tests/levelset/surfaces.h"
#include "tests/levelset/wafers.h"

namespace scarp {
namespace {

constexpr double bottom = -60;

/// Volumes of the regions of a mesh are those of the layers, within a part.
void expect_volumes_of(const Layers& layers, const RegionMesh& mesh, double part) {
  const std::vector<double> of_layers = material_volumes(layers);
  const std::vector<double> volumes = region_volumes(mesh);
  const double thickness = mesh.is_flat ? layers.frame.spacing : 1;
  for (std::size_t n = 0; n < mesh.regions.size(); ++n) {
    if (mesh.regions[n].kind != MeshRegion::Kind::material) continue;
    double wanted = n == 0 ? -mesh.lower[2] * layers.frame.sides().area() / thickness : 0;
    for (std::size_t k = 0; k < of_layers.size(); ++k)
      if (layers.stack[k].material == mesh.regions[n].material) wanted += of_layers[k] / thickness;
    EXPECT_NEAR(volumes[n], wanted, part * wanted) << "region " << n;
  }
}

Layers mask_on_wafer(const Frame& frame) {
  return build_layers(
      frame, std::vector<Shape>{WaferShape{}, MaskShape{.material = 1,
                                                        .thickness = 5.2,
                                                        .outlines = MaskShape::Outlines::resist,
                                                        .outline = CircleOutline{.radius = 7.3}}});
}

TEST(RegionSurface, AFlatStackHasExactVolumes) {
  Layers layers = build_layers({.spacing = 1, .cells = {12, 10}}, std::vector<Shape>{WaferShape{}});
  add_layer(layers, 1);
  coat(layers, 0.4);
  add_layer(layers, 2);
  coat(layers, 2.3);
  const RegionMesh cut = region_surface(layers, {.bottom = -5.5, .lid = 9.25});
  for (const RegionMesh& mesh : {cut, remeshed(layers, {.bottom = -5.5, .lid = 9.25}, 4)}) {
    expect_sound(mesh, 1);
    ASSERT_EQ(mesh.regions.size(), 4U);
    const std::vector<double> volumes = region_volumes(mesh);
    EXPECT_NEAR(volumes[0], 120 * (5.5 + dilation), 1e-3);
    EXPECT_NEAR(volumes[1], 120 * 0.4, 1e-3);
    EXPECT_NEAR(volumes[2], 120 * 2.3, 1e-3);
    EXPECT_NEAR(volumes[3], 120 * (9.25 - 2.7 - dilation), 1e-3);
    for (int side = 0; side < 4; ++side)
      EXPECT_NEAR(side_area(mesh, side), (side < 2 ? 10 : 12) * 14.75, 1e-9);
    EXPECT_NEAR(side_area(mesh, 4), 120, 1e-9);
    EXPECT_NEAR(side_area(mesh, 5), 120, 1e-9);
  }
}

TEST(RegionSurface, CoarseFacetsAreFew) {
  const Layers layers =
      build_layers({.spacing = 1, .cells = {20, 20}}, std::vector<Shape>{WaferShape{}});
  const std::size_t fine = remeshed(layers, {.bottom = -10}, 1).facets.size();
  const std::size_t coarse = remeshed(layers, {.bottom = -10}, 4).facets.size();
  EXPECT_LT(5 * coarse, fine);
}

TEST(RegionSurface, ASphereOfOneMaterialInAnother) {
  const Frame frame{.spacing = 1, .cells = {24, 24}};
  constexpr double radius = 7.3;
  const auto wafer_and_sphere = [](Vec3d r) {
    return std::min(r.z + 12.2, length(r - Vec3d{0.3, -0.2, 0.1}) - radius);
  };
  Layers layers{.frame = frame, .stack = {}};
  layers.stack.push_back({0, LevelSet(frame, wafer_and_sphere, -20, 20)});
  layers.stack.push_back({1, LevelSet(
                                 frame, [](Vec3d r) { return r.z - 11.4; }, -20, 20)});
  const RegionMesh mesh = remeshed(layers, {.bottom = -18});
  expect_sound(mesh, 1);
  ASSERT_EQ(mesh.bodies.size(), 4U);  // wafer, sphere, what is around it, gas
  const double ball = 4.0 / 3 * std::numbers::pi * radius * radius * radius;
  const std::vector<double> volumes = region_volumes(mesh);
  const double wafer = 24 * 24 * (18 - 12.2);
  // The surface of the layer has chords within its cells: 1 % of this ball.
  EXPECT_NEAR(volumes[0], wafer + ball, 0.015 * ball);
  EXPECT_NEAR(volumes[1], 24 * 24 * (11.4 + 12.2) - ball, 0.015 * ball);
  const std::vector<double> of_layers = material_volumes(layers);
  EXPECT_NEAR(volumes[1], of_layers[1], 0.002 * ball);
  for (const RegionMesh::Facet& facet : mesh.facets) {
    const auto [a, b, c] = corners(mesh, facet);
    const Vec3d centre = (a + b + c) / 3.0;
    if (facet.layer != 0 || centre.z < -11) continue;
    EXPECT_NEAR(length(centre - Vec3d{0.3, -0.2, 0.1}), radius, 0.1);
  }
}

// Three materials meet at the foot of a mask.
TEST(RegionSurface, ATripleLineIsACircle) {
  const Layers layers = mask_on_wafer({.spacing = 1, .cells = {24, 24}});
  const RegionMesh mesh = remeshed(layers, {.bottom = -10});
  expect_sound(mesh, 1);
  expect_volumes_of(layers, mesh, 0.005);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> facets_at;
  for (const RegionMesh::Facet& facet : mesh.facets)
    for (std::size_t n = 0; n < 3; ++n)
      if (facet.layer != RegionMesh::nothing)
        ++facets_at[std::minmax(facet.corners[n], facet.corners[(n + 1) % 3])];
  double around = 0;
  for (const auto& [edge, count] : facets_at) {
    if (count != 3) continue;
    const Vec3d a = mesh.vertices[edge.first];
    const Vec3d b = mesh.vertices[edge.second];
    around += length(b - a);
    EXPECT_NEAR(std::hypot(a.x, a.y), 7.3, 0.1);
    EXPECT_NEAR(a.z, 0, 0.1);
  }
  EXPECT_NEAR(around, 2 * std::numbers::pi * 7.3, 0.02 * 2 * std::numbers::pi * 7.3);
}

// The cut alone takes edges off by up to half a cell.
TEST(RegionSurface, EdgesOfATrenchAreSharp) {
  const Layers layers = build_layers(
      {.spacing = 1, .cells = {30, 12}},
      std::vector<Shape>{WaferShape{}, TrenchShape{.width = 13.4, .cut = {.depth = 14.6}}});
  const std::vector<TriMesh> surfaces = layer_surfaces(layers);
  const RegionQuality before = quality(region_surface(layers, {.bottom = -25}), surfaces, 1, 4);
  const RegionMesh mesh = remeshed(layers, {.bottom = -25}, 4);
  const RegionQuality after = quality(mesh, surfaces, 1, 4);
  expect_sound(mesh, 1);
  expect_volumes_of(layers, mesh, 1e-3);
  EXPECT_GT(before.max_distance, 0.2);
  EXPECT_LE(after.max_distance, 0.1);
  EXPECT_LE(after.reverse_max_distance, 0.1);
}

class Regions : public ::testing::TestWithParam<Boundary> {
 protected:
  Frame frame() const {
    return {.spacing = 1, .cells = {40, 24}, .boundary = {GetParam(), GetParam()}};
  }

  static void expect_mesh_of(const Layers& layers) {
    for (const double size : {1.0, 4.0}) {
      SCOPED_TRACE(size);
      const RegionMesh mesh = remeshed(layers, {.bottom = bottom, .lid = 20}, size);
      expect_sound(mesh, 1);
      expect_volumes_of(layers, mesh, 0.01);
      double sum = 0;
      for (const double volume : region_volumes(mesh)) sum += volume;
      EXPECT_NEAR(sum, layers.frame.sides().area() * (20 - bottom), 1e-6 * sum);
      const RegionQuality found = quality(mesh, layer_surfaces(layers), 1, size);
      EXPECT_EQ(found.thin_facets, 0U) << found.least_relative_altitude;
      EXPECT_LE(found.max_distance, 0.55);
      EXPECT_LE(found.max_plain_distance, 0.1);
      for (int axis = 0; axis < 2; ++axis)
        EXPECT_EQ(mesh.is_periodic[static_cast<std::size_t>(axis)] && sides_match(mesh, axis),
                  GetParam() == Boundary::periodic);
    }
  }
};
INSTANTIATE_TEST_SUITE_P(Sides, Regions,
                         ::testing::Values(Boundary::reflective, Boundary::periodic));

TEST_P(Regions, FilmsInATrenchThatTheSidesCut) {
  const Layers layers = trench_with_films(frame());
  expect_mesh_of(layers);
}

TEST_P(Regions, AMaskOverUndercutSilicon) {
  const Layers layers = mask_over_undercut_silicon(frame());
  expect_mesh_of(layers);
}

TEST_P(Regions, AVoidUnderAFilmThatHasClosed) {
  const Layers layers = void_under_a_film(frame());
  expect_mesh_of(layers);
  const RegionMesh mesh = region_surface(layers, {.bottom = bottom});
  ASSERT_EQ(mesh.regions.size(), 4U);
  EXPECT_EQ(mesh.regions[3].kind, MeshRegion::Kind::closed_void);
  EXPECT_FALSE(mesh.regions[3].is_meshed);
}

TEST_P(Regions, FilmsThatEndWhereTheyWereEtchedThrough) {
  const Layers layers = films_etched_through(frame());
  expect_mesh_of(layers);
  // The two films of one material are one region.
  EXPECT_EQ(region_surface(layers, {.bottom = bottom}).regions.size(), 4U);
}

/// Some films, features cut into them or put onto them, and films over all of that.
Layers random_stack(const Frame& frame, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  const auto below = [&](int count) {
    return static_cast<int>(engine() % static_cast<std::uint64_t>(count));
  };
  const auto between = [&](int lower, int upper) {
    return lower + below(64 * (upper - lower) + 1) / 64.0;
  };
  const auto material = [&] { return static_cast<MaterialId>(1 + below(3)); };
  std::vector<Shape> shapes{WaferShape{}};
  for (int films = below(3); films > 0; --films)
    shapes.emplace_back(LayerShape{.material = material(), .thickness = between(1, 5)});
  const double x = between(-8, 8);
  const double y = between(-4, 4);
  const Cut cut{.depth = between(3, 12), .taper = between(-1, 1) / 6};
  switch (below(3)) {
    case 0:
      shapes.emplace_back(TrenchShape{.width = between(4, 12), .centre = x, .cut = cut});
      break;
    case 1:
      shapes.emplace_back(HoleShape{.radius = between(3, 7), .centre = {x, y}, .cut = cut});
      break;
    default:
      shapes.emplace_back(
          MaskShape{.material = material(),
                    .thickness = between(2, 8),
                    .outlines = MaskShape::Outlines::resist,
                    .outline = CircleOutline{.radius = between(3, 7), .centre = {x, y}}});
  }
  if (!check_shapes(frame, shapes).empty()) shapes.pop_back();
  Layers layers = build_layers(frame, shapes);
  for (int films = 1 + below(2); films > 0; --films) {
    add_layer(layers, static_cast<MaterialId>(1 + below(4)));
    coat(layers, between(0, 3) + 0.25);
    if (below(3) == 0) planarise(layers, between(0, 3));
  }
  return layers;
}

TEST_P(Regions, RandomStacks) {
  const Frame small{.spacing = 1, .cells = {24, 14}, .boundary = {GetParam(), GetParam()}};
  int meshes_with_thin_facets = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    const Layers layers = random_stack(small, seed);
    const RegionMesh mesh = remeshed(layers, {.bottom = -30}, 4);
    // A few facets next to others that touch them on all sides cannot be mended.
    constexpr double exceptional_part = 0.05;
    expect_sound(mesh, 1, exceptional_part);
    const RegionQuality found = quality(mesh, layer_surfaces(layers), 1, 4);
    EXPECT_GE(found.least_relative_altitude, exceptional_part);
    EXPECT_LE(found.thin_facets, mesh.facets.size() / 200);
    meshes_with_thin_facets += found.thin_facets > 0 ? 1 : 0;
    EXPECT_LE(found.max_distance, 0.55);
    EXPECT_LE(found.max_plain_distance, 0.1);
    for (int axis = 0; axis < 2; ++axis)
      EXPECT_EQ(mesh.is_periodic[static_cast<std::size_t>(axis)] && sides_match(mesh, axis),
                GetParam() == Boundary::periodic);
  }
  EXPECT_LE(meshes_with_thin_facets, 1);
}

// Where the lining begins the surfaces of four layers lie within a few thousandths of a spacing.
TEST(RegionSurface, ALinedHoleThatEndsOnAFilm) {
  Layers layers =
      build_layers({.spacing = 1, .cells = {24, 16}},
                   std::vector<Shape>{WaferShape{}, StackShape{.layers = {{1, 2.3}, {2, 8}}},
                                      HoleShape{.radius = 5, .cut = {.depth = 8}}});
  add_layer(layers, 3);
  coat(layers, 1);
  planarise(layers, 10.3);
  const RegionMesh mesh = remeshed(layers, {.bottom = -6}, 4);
  expect_sound(mesh, 1);
  expect_volumes_of(layers, mesh, 0.01);
}

TEST(RegionSurface, FilmsTooThinAreLeftOut) {
  Layers layers = build_layers({.spacing = 1, .cells = {12, 10}}, std::vector<Shape>{WaferShape{}});
  add_layer(layers, 1);
  coat(layers, 0.7 * thinnest_meshed_film);
  const RegionMesh mesh = region_surface(layers, {.bottom = -5});
  expect_sound(mesh, 1);
  EXPECT_EQ(region_volumes(mesh)[1], 0);
}

TEST(RegionSurface, ASectionIsFlat) {
  Layers layers = build_layers(
      {.spacing = 1, .cells = {40, 1}, .two_dimensional = true},
      std::vector<Shape>{WaferShape{}, TrenchShape{.width = 14, .cut = {.depth = 20}}});
  add_layer(layers, 1);
  coat(layers, 2.5);
  for (const double size : {1.0, 4.0}) {
    const RegionMesh mesh = remeshed(layers, {.bottom = -40, .lid = 10}, size);
    EXPECT_TRUE(mesh.is_flat);
    expect_sound(mesh, 1);
    expect_volumes_of(layers, mesh, 0.005);
    const std::vector<double> areas = region_volumes(mesh);
    EXPECT_NEAR(areas[0] + areas[1] + areas[2], 40 * 50, 1e-9);
    EXPECT_LE(quality(mesh, layer_surfaces(layers), 1, size).max_distance, 0.1);
    for (const Vec3d& r : mesh.vertices) EXPECT_EQ(r.y, mesh.vertices.front().y);
  }
}

TEST(RegionSurface, MasksOfASectionMeetItInPoints) {
  for (const double width : {13.2, 13.9, 14.4, 14.8}) {
    SCOPED_TRACE(width);
    const Layers layers = build_layers(
        {.spacing = 1, .cells = {40, 1}, .two_dimensional = true},
        std::vector<Shape>{WaferShape{}, MaskShape{.material = 1,
                                                   .thickness = 6.3,
                                                   .outlines = MaskShape::Outlines::resist,
                                                   .outline = SlotOutline{.width = width}}});
    const RegionMesh mesh = remeshed(layers, {.bottom = -20});
    expect_sound(mesh, 1);
    std::map<std::uint32_t, std::set<int>> bodies;
    for (const RegionMesh::Facet& facet : mesh.facets)
      for (const std::uint32_t v : facet.corners) bodies[v].insert(facet.bodies[0]);
    std::vector<double> places;
    for (const auto& [v, around] : bodies) {
      if (around.size() < 3) continue;
      places.push_back(std::abs(mesh.vertices[v].x));
      EXPECT_NEAR(mesh.vertices[v].z, 0, 0.1);
      EXPECT_NEAR(places.back(), width / 2, 0.1);
    }
    EXPECT_EQ(places.size(), 2U);
  }
}

TEST(RegionSurface, ASectionAroundAnAxisIsItsHalf) {
  const Layers layers = build_layers(
      {.spacing = 1, .cells = {40, 1}, .two_dimensional = true, .axisymmetric = true},
      std::vector<Shape>{WaferShape{}, HoleShape{.radius = 7.2, .cut = {.depth = 20}}});
  const RegionMesh mesh = remeshed(layers, {.bottom = -40});
  expect_sound(mesh, 1);
  EXPECT_EQ(mesh.lower[0], 0);
  EXPECT_NEAR(region_volumes(mesh)[0], 20 * 40 - 7.2 * 20, 0.005 * 20 * 40);
}

TEST(RegionSurface, NodesAreTheSameWithAnyNumberOfThreads) {
  const Layers layers = mask_on_wafer({.spacing = 1, .cells = {24, 24}});
  std::vector<RegionMesh> meshes;
  for (const int threads : {1, 2})
    with_threads(threads, [&] { meshes.push_back(remeshed(layers, {.bottom = -10}, 4)); });
  EXPECT_EQ(meshes[0].vertices, meshes[1].vertices);
  ASSERT_EQ(meshes[0].facets.size(), meshes[1].facets.size());
  for (std::size_t f = 0; f < meshes[0].facets.size(); ++f)
    EXPECT_EQ(meshes[0].facets[f].corners, meshes[1].facets[f].corners);
}

TEST(RegionSurface, ABottomOrALidNearASurfaceIsRefused) {
  const Layers layers =
      build_layers({.spacing = 1, .cells = {10, 10}}, std::vector<Shape>{WaferShape{}});
  EXPECT_THROW(region_surface(layers, {.bottom = -0.5}), InputError);
  EXPECT_THROW(region_surface(layers, {.bottom = -5, .lid = 0.5}), InputError);
  EXPECT_NO_THROW(region_surface(layers, {.bottom = -1.1, .lid = 1.2}));
}

}  // namespace
}  // namespace scarp
