// Whole surfaces that move: trenches and holes under deposition and etching, against exact answers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <string>

#include "core/parallel.h"
#include "levelset/grid/band.h"
#include "levelset/motion/advect.h"
#include "levelset/motion/extend.h"
#include "levelset/operations/layer_steps.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/extract_surface.h"
#include "surfaces.h"
#include "tests/levelset/cross_sections.h"
#include "tests/levelset/speeds.h"

namespace scarp {
namespace {

constexpr double pi = std::numbers::pi;

Shape plain_trench(double width, double depth, double centre = 0) {
  TrenchShape shape{.width = width, .centre = centre};
  shape.cut.depth = depth;
  return shape;
}

Shape hole(double radius, double depth) {
  HoleShape shape{.radius = radius};
  shape.cut.depth = depth;
  return shape;
}

constexpr double extent = 128;
constexpr double width = 60;
constexpr double depth = 60;
constexpr double thickness = 12;

/// Relative error of the volume of a film on a trench (2D) or a hole.
double film_error(bool round, double spacing, Scheme scheme) {
  const int cells = static_cast<int>(std::lround(extent / spacing));
  Frame frame{.spacing = spacing, .cells = {cells, round ? cells : 1}};
  frame.two_dimensional = !round;
  Layers layers =
      build_layers(frame, std::vector<Shape>{WaferShape{}, round ? hole(width / 2, depth)
                                                                 : plain_trench(width, depth)});
  add_layer(layers, 1);
  move(
      layers, thickness, 0.5 * spacing, [](Vec3d, MaterialId) { return 1.0; }, scheme);

  const double t = thickness;
  const double radius = width / 2;
  const double exact =
      round ? (extent * extent - pi * radius * radius) * t +
                  2 * pi * (radius - 4 * t / (3 * pi)) * pi * t * t / 4 +
                  pi * (radius * radius * depth - std::pow(radius - t, 2) * (depth - t))
            : spacing * ((extent - width) * t + pi / 2 * t * t + width * depth -
                         (width - 2 * t) * (depth - t));
  const double error = std::abs(material_volumes(layers)[1] / exact - 1);
  std::printf("| film in a %s | scheme %d | spacing %.1f nm | error %.3f %% |\n",
              round ? "hole" : "trench", static_cast<int>(scheme), spacing, 100 * error);
  return error;
}

/// What is asserted of a film with one scheme: the order, and the relative error at the fine
/// spacing.
struct FilmLimits {
  Scheme scheme;
  double order;
  double error;
};

TEST(Film, VolumeOnATrenchConverges) {
  for (const auto& [scheme, order, error] :
       {FilmLimits{Scheme::first_order, 0.8, 0.006}, FilmLimits{Scheme::eno2, 0.8, 0.001},
        FilmLimits{Scheme::weno5, 0.8, 0.0002}}) {
    const double coarse = film_error(false, 2, scheme);
    const double fine = film_error(false, 0.5, scheme);
    EXPECT_GT(std::log2(coarse / fine) / 2, order) << static_cast<int>(scheme);
    EXPECT_LT(fine, error) << static_cast<int>(scheme);
  }
}

TEST(Film, OfTwelveCellsHasTheRightVolume) {
  EXPECT_LT(film_error(false, 1, Scheme::first_order), 0.012);
  EXPECT_LT(film_error(false, 1, Scheme::eno2), 0.002);
  EXPECT_LT(film_error(false, 1, Scheme::weno5), 0.0004);
}

TEST(SlowFilm, VolumeOnAHoleConverges) {
  // At 4 nm the hole is 7 spacings in radius and errors of edge and wall cancel: no order there.
  for (const auto& [scheme, order, error] :
       {FilmLimits{Scheme::first_order, 0.7, 0.006}, FilmLimits{Scheme::eno2, 0.8, 0.001},
        FilmLimits{Scheme::weno5, 0.7, 0.0006}}) {
    const double middle = film_error(true, 2, scheme);
    const double fine = film_error(true, 1, scheme);
    EXPECT_GT(std::log2(middle / fine), order) << static_cast<int>(scheme);
    EXPECT_LT(fine, error) << static_cast<int>(scheme);
  }
}

TEST(Trench, ClosesAtHalfItsWidth) {
  Frame frame{.spacing = 1, .cells = {60, 1}};
  frame.two_dimensional = true;
  for (const double offset : {0.0, 0.3}) {
    Layers layers =
        build_layers(frame, std::vector<Shape>{WaferShape{}, plain_trench(20 + offset, 30)});
    const double dt = 0.5;
    double t = 0;
    const auto open = [&] { return layers.top().distance({0, 0, -5}) > 0; };
    while (open() && t < 20) {
      advect(layers, prescribe_speeds(layers, [](Vec3d, MaterialId) { return 1.0; }), dt);
      t += dt;
    }
    EXPECT_NEAR(t, (20 + offset) / 2, dt + 1) << offset;
  }
}

TEST(Edge, ConvexRoundsToAnArcAndConcaveStaysSharp) {
  Frame frame{.spacing = 1, .cells = {60, 1}};
  frame.two_dimensional = true;
  for (const double offset : {0.0, 0.3, 0.7}) {
    const double half = 15 + offset;
    Layers layers =
        build_layers(frame, std::vector<Shape>{WaferShape{}, plain_trench(2 * half, 20.4)});
    move(layers, 8, 0.5, [](Vec3d, MaterialId) { return 1.0; });
    const TriMesh mesh = extract_surface(layers);
    double nearest = 1e300;
    for (const Vec3f& v : mesh.vertices) {
      if (std::abs(v.x) < half && v.z > 0) {
        EXPECT_NEAR(std::hypot(std::abs(v.x) - half, v.z), 8, 0.25)
            << offset << " " << v.x << " " << v.z;
      }
      nearest = std::min(nearest, std::hypot(v.x - (half - 8), v.z + 20.4 - 8));
    }
    EXPECT_LT(nearest, 0.15);
  }
}

TEST(Edge, EtchingRoundsTheConcaveAndKeepsTheConvexSharp) {
  Frame frame{.spacing = 1, .cells = {80, 1}};
  frame.two_dimensional = true;
  Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{}, plain_trench(30.6, 20.4)});
  move(layers, 8, 0.5, [](Vec3d, MaterialId) { return -1.0; });
  const TriMesh mesh = extract_surface(layers);
  double nearest = 1e300;
  for (const Vec3f& v : mesh.vertices) {
    if (v.x > 15.3 && v.z < -20.4) {
      EXPECT_NEAR(std::hypot(v.x - 15.3, v.z + 20.4), 8, 0.25) << v.x << " " << v.z;
    }
    nearest = std::min(nearest, std::hypot(v.x - 23.3, v.z + 8));
  }
  EXPECT_LT(nearest, 0.15);
}

// Films from both walls of a slot meet in a notch. Etched at once, it goes down at the etch rate:
// it is the point nearest to all that lies below.
TEST(Notch, OfTwoFilmsThatHaveMetGoesDownAtTheEtchRate) {
  constexpr double half = 10.2;
  constexpr double film = 14;
  for (const Scheme scheme : {Scheme::eno2, Scheme::weno5}) {
    Frame frame{.spacing = 1, .cells = {120, 1}};
    frame.two_dimensional = true;
    Layers layers =
        build_layers(frame, std::vector<Shape>{WaferShape{}, plain_trench(2 * half, 40)});
    move(
        layers, film, 0.4, [](Vec3d, MaterialId) { return 1.0; }, scheme);
    const double notch = std::sqrt(film * film - half * half);
    move(
        layers, 8, 0.4, [](Vec3d, MaterialId) { return -1.0; }, scheme);
    const auto height = cross_section(layers, 1, 0)[0].front().points;
    const auto middle = std::min_element(
        height.begin(), height.end(),
        [](const auto& a, const auto& b) { return std::abs(a[0]) < std::abs(b[0]); });
    EXPECT_NEAR((*middle)[1], notch - 8, 0.6) << static_cast<int>(scheme);
  }
}

TEST(Mask, MouthIsStillSharpAfterTwentyTimeSteps) {
  for (const double offset : {0.0, 0.2, 0.45, 0.8}) {
    Frame frame{.spacing = 1, .cells = {60, 1}};
    frame.two_dimensional = true;
    Layers layers = build_layers(
        frame, std::vector<Shape>{WaferShape{.material = 0},
                                  MaskShape{.material = 1,
                                            .thickness = 6.4 + 0.5 * offset,
                                            .outline = SlotOutline{.width = 16 + 2 * offset}}});
    move(layers, 10, 0.5, [](Vec3d, MaterialId material) { return material == 0 ? -1.0 : 0.0; });
    double nearest = 1e300;
    for (const Vec3f& v : extract_surface(layers).vertices) {
      nearest = std::min(nearest, std::hypot(v.x - 8 - offset, v.z - 6.4 - 0.5 * offset));
    }
    EXPECT_LT(nearest, 0.1) << offset;
  }
}

/// Vertices on the surface of the topmost layer.
std::set<std::array<float, 3>> vertices_on_top_layer(const Layers& layers) {
  const TriMesh mesh = extract_surface(layers);
  std::vector<bool> other(mesh.vertices.size(), false);
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    for (const std::uint32_t v : mesh.triangles[f]) {
      other[v] = other[v] || mesh.materials[f] != layers.stack.back().material;
    }
  }
  std::set<std::array<float, 3>> found;
  for (std::size_t v = 0; v < other.size(); ++v) {
    if (!other[v]) {
      found.insert({mesh.vertices[v].x, mesh.vertices[v].y, mesh.vertices[v].z});
    }
  }
  return found;
}

TEST(Mask, KeepsEveryVertexWhileItIsUndercut) {
  for (const double height : {0.0, 2.3}) {
    const Frame frame{.spacing = 1, .cells = {48, 8}};
    Layers layers = build_layers(
        frame,
        std::vector<Shape>{
            WaferShape{.material = 0}, LayerShape{.material = 0, .thickness = height + 1e-3},
            MaskShape{.material = 1, .thickness = 6.4, .outline = SlotOutline{.width = 12.6}}});
    const double before = material_volumes(layers)[1];
    const auto vertices = vertices_on_top_layer(layers);
    move(layers, 10, 0.5, [](Vec3d, MaterialId material) { return material == 0 ? -1.0 : 0.0; });

    const auto after = vertices_on_top_layer(layers);
    EXPECT_TRUE(std::includes(after.begin(), after.end(), vertices.begin(), vertices.end()));
    EXPECT_NEAR(material_volumes(layers)[1], before, 0.01 * before);
    // Undercut and depth are both 10.
    EXPECT_NEAR(layers.top().distance({0, 0, height - 10}), 0, 0.1);
    EXPECT_NEAR(layers.top().distance({6.3 + 10, 0, height - 1}), 0, 0.3);
  }
}

/// How far the etched corner below the edge of a mask lies from its circle about that edge, by the
/// angle below the mask, in spacings. The mask's foot is at the given height, its edge at x = edge.
std::vector<double> undercut_errors(double edge, double foot, double radius) {
  Frame frame{.spacing = 1, .cells = {64, 1}};
  frame.two_dimensional = true;
  Layers layers = build_layers(
      frame,
      std::vector<Shape>{
          WaferShape{.material = 0}, LayerShape{.material = 0, .thickness = foot + 1e-9},
          MaskShape{.material = 1, .thickness = 5, .outline = SlotOutline{.width = 2 * edge}}});
  constexpr double dt = 0.4;
  for (double time = 0; time < radius - 1e-9; time += dt) {
    const OpenGas gas = open_gas(layers);
    const TriMesh mesh = extract_surface(layers, gas);
    const std::vector<CornerSpeeds> speeds{CornerSpeeds(mesh.triangles.size(), {-1, -1, -1}),
                                           CornerSpeeds(mesh.triangles.size(), {0, 0, 0})};
    const SpeedField field = extend_speeds(layers, gas, mesh, speeds, dt);
    advect(layers, field, dt);
  }
  std::vector<double> errors;
  for (double angle = 5; angle < 90; angle += 10) {
    const double c = std::cos(angle * pi / 180);
    const double s = std::sin(angle * pi / 180);
    errors.push_back(layers.top().distance({edge + radius * c, 0, foot - radius * s}));
  }
  return errors;
}

// Next to the edge no surface tells solid below the mask how fast it is etched but the one that
// arrives: with an edge on a node half a spacing was lost.
TEST(Mask, UndercutIsAQuarterCircleWhereverItsEdgeLies) {
  for (const double offset : {0.0, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99}) {
    for (const double error : undercut_errors(8 + offset, 0, 14)) {
      EXPECT_NEAR(error, 0, 0.22) << offset;
    }
    const std::vector<double> between_nodes = undercut_errors(8 + offset, 0.4, 14);
    const double sum = std::accumulate(between_nodes.begin(), between_nodes.end(), 0.0);
    EXPECT_NEAR(sum / static_cast<double>(between_nodes.size()), 0, 0.4) << offset;
  }
}

// What hangs below the mask goes as fast as it is etched: half a spacing of it was left in every
// other column of nodes.
TEST(Mask, AnUndercutLaysItsUndersideBare) {
  for (const double foot : {20.3, 20.55, 20.8}) {
    Frame frame{.spacing = 1, .cells = {60, 1}};
    frame.two_dimensional = true;
    Layers layers = build_layers(
        frame, std::vector<Shape>{
                   WaferShape{.material = 0}, LayerShape{.material = 1, .thickness = foot},
                   MaskShape{.material = 2, .thickness = 5, .outline = SlotOutline{.width = 15}}});
    for (double time = 0; time < 17; time += 0.4) {
      const OpenGas gas = open_gas(layers);
      const TriMesh mesh = extract_surface(layers, gas);
      const CornerSpeeds still(mesh.triangles.size(), {0, 0, 0});
      const CornerSpeeds etch(mesh.triangles.size(), {-1, -1, -1});
      const std::vector<CornerSpeeds> speeds{still, etch, still};
      advect(layers, extend_speeds(layers, gas, mesh, speeds, 0.4), 0.4);
    }
    for (double x = 9; x < 20; x += 0.5)
      EXPECT_NEAR(layers.top().distance({x, 0, foot}), 0, 0.25) << foot << " " << x;
  }
}

/// A film below a mask whose edge runs along y: how far the wall that a beam from above leaves in
/// the film lies from the plane below that edge, at most. The film's top, on which the mask stands,
/// has the given slope and is at the given height at the middle of the edge. Units: spacings.
double wall_roughness(double edge, double foot, Vec3d slope) {
  constexpr double etched = 6;
  constexpr double far = 100;
  const auto top = [&](const Vec3d& r) { return foot + slope.x * (r.x - edge) + slope.y * r.y; };
  const auto film = std::make_shared<TriMesh>();
  for (const double x : {-far, far})
    for (const double y : {-far, far}) film->vertices.push_back(Vec3f(Vec3d{x, y, top({x, y, 0})}));
  film->triangles = {{0, 2, 3}, {0, 3, 1}};
  constexpr double beyond = 10;
  Layers layers = build_layers(
      {.spacing = 1, .cells = {24, 14}},
      std::vector<Shape>{
          WaferShape{.material = 0}, MeshShape{.mesh = film, .material = 1},
          MaskShape{.material = 2,
                    .thickness = 4,
                    .outline = SlotOutline{.width = 2 * (beyond - edge), .centre = beyond}}});
  const AngularFactor beam = CosineResponse({0, 0, -1});
  constexpr double dt = 0.4;
  for (double time = 0; time < etched - 1e-9; time += dt) {
    const OpenGas gas = open_gas(layers);
    const TriMesh mesh = extract_surface(layers, gas);
    const CornerSpeeds still(mesh.triangles.size(), {0, 0, 0});
    CornerSpeeds speed;
    for (const Vec3f& n : facet_normals(mesh)) {
      const float each = -beam.value(n);
      speed.push_back({each, each, each});
    }
    const LayerSpeeds stays{.speed = still, .parts = {still, still}};
    const LayerSpeeds goes{.speed = speed,
                           .parts = {still, CornerSpeeds(mesh.triangles.size(), {-1, -1, -1})}};
    FacetTree facets(mesh);
    advect(layers,
           extend_speeds(layers, gas, facets, std::vector{stays, goes, stays}, {&beam, 1}, dt,
                         close_facets),
           dt);
  }
  double roughest = 0;
  const double corner = 2.5 + std::abs(slope.x) + std::abs(slope.y);  // blunt next to the floor
  for (const Vec3f& vertex : extract_surface(layers).vertices) {
    const Vec3d r(vertex);
    const bool is_of_wall = r.z < top({edge, r.y, 0}) + 0.01 && r.z > top(r) - etched + corner &&
                            std::abs(r.x - edge) < 2 && std::abs(r.y) < 4;
    if (is_of_wall) roughest = std::max(roughest, std::abs(r.x - edge));
  }
  return roughest;
}

// Gas just above the film knew the film, and kept that distance for the one to the wall: the wall
// was rough by up to a spacing unless the film's top was at a height of nodes all along the edge.
TEST(Mask, StandsOverASmoothWallWhereverItsFootAndEdgeLie) {
  for (const double edge : {0.0, 0.25, 0.5, 0.75}) {
    for (const double foot : {20.0, 20.03, 20.4, 20.7})
      EXPECT_LT(wall_roughness(edge, foot, {}), 0.02) << edge << " " << foot;
    EXPECT_LT(wall_roughness(edge, 20, {0, 0.6, 0}), 0.02) << edge;
    EXPECT_LT(wall_roughness(edge, 20, {-0.3, 0, 0}), 0.02) << edge;
  }
}

// Where the film's top rises away from the mask, the wedge between is thinner than the grid holds:
// the mask's wall goes on from above, and its underside is none. It was rough by half a spacing.
TEST(Mask, StandsOverAWallBesideAFilmThatRises) {
  for (const double edge : {0.0, 0.25, 0.5, 0.75})
    for (const double foot : {20.35, 20.85})
      EXPECT_LT(wall_roughness(edge, foot, {1, 0, 0}), 0.3) << edge << " " << foot;
}

/// The highest vertex of the surface.
double highest(const Layers& layers) { return bounding_box(extract_surface(layers)).upper.z; }

// A film goes in thickness / rate wherever its surface lies between two nodes, and leaves nothing.
TEST(Mask, IsStrippedInTimeFromWhatStandsStill) {
  const auto speed = [](Vec3d, MaterialId material) { return material == 1 ? -1.0 : 0.0; };
  for (const double film : {4.0, 5.3, 5.7}) {
    Frame frame{.spacing = 1, .cells = {60, 1}};
    frame.two_dimensional = true;
    Layers layers = build_layers(
        frame, std::vector<Shape>{WaferShape{}, MaskShape{.material = 1,
                                                          .thickness = film,
                                                          .outline = SlotOutline{.width = 20}}});
    const auto etch = [&](double time) {
      const auto steps = static_cast<int>(std::ceil(time / 0.4));
      const double dt = time / steps;
      for (int step = 0; step < steps; ++step) {
        advect(layers, prescribe_speeds(layers, speed, dt), dt);
      }
    };
    etch(film - 0.5);
    EXPECT_NEAR(highest(layers), 0.5, 0.02) << film;
    etch(0.7);
    EXPECT_NEAR(highest(layers), 0, 0.02) << film;
  }
}

/// What went as residue, and what is left of a film of the given thickness over half a slope of 45
/// degrees that stands still, while the film hardly moves. Units: spacings.
struct Residue {
  double removed = 0;
  double left = 0;  ///< mean thickness over that half
};

Residue residue_of(double thickness, bool two_dimensional) {
  Frame frame{.spacing = 2, .cells = {40, two_dimensional ? 1 : 12}};
  frame.two_dimensional = two_dimensional;
  const auto slope = [](Vec3d r) { return (r.z - r.x - 0.7) / std::numbers::sqrt2; };
  Layers layers = single_layer(frame, slope, -40, 42);
  const auto film = [&](Vec3d r) { return slope(r) - (r.x > 0.5 ? 2 * thickness : 0); };
  layers.stack.push_back({1, LevelSet(frame, film, -40, 42)});
  Residue residue;
  for (int step = 0; step < 60; ++step) {
    const SpeedField field = prescribe_speeds(
        layers, [](Vec3d, MaterialId material) { return material == 1 ? -1e-6 : 0; }, 1);
    residue.removed += advect(layers, field, 1) / 8;
  }
  for (double x = 1; x < 40; x += 2) {
    const Vec3d r{x, 0, x + 0.7};
    residue.left += (layers.stack[0].phi.distance(r) - layers.top().distance(r)) / 2 / 20;
  }
  return residue;
}

// Where its edge is, both ends of an edge of the grid hold what is left of a film: below a
// twentieth of a spacing it goes, node by node, and is counted; above it stays.
TEST(Film, ResiduesBesideWhatStandsStillGoAndAreCounted) {
  for (const bool two_dimensional : {true, false}) {
    const double area = 20 * std::numbers::sqrt2 * (two_dimensional ? 1 : 12);
    const Residue thin = residue_of(0.04, two_dimensional);
    // Either end of the film lies within half a node.
    EXPECT_NEAR(thin.removed, 0.04 * area, 0.06 * 0.04 * area);
    EXPECT_NEAR(thin.left, 0, 1e-3);
    const Residue thick = residue_of(0.06, two_dimensional);
    EXPECT_LT(thick.removed, 0.03 * 0.06 * area);
    EXPECT_NEAR(thick.left, 0.06, 0.05 * 0.06);
  }
}

// From corners too, convex ones where the film is bared from the side and concave ones where both
// walls are near.
TEST(Film, IsStrippedFromACornerThatStandsStillWithoutARest) {
  const auto speed = [](Vec3d, MaterialId material) { return material == 1 ? -1.0 : 0.0; };
  for (const double taper : {0.0, 0.1, -0.1, -0.3}) {
    for (const double offset : {0.0, 0.37, 0.74}) {
      Frame frame{.spacing = 1, .cells = {60, 1}};
      frame.two_dimensional = true;
      TrenchShape shape{.width = 24 + offset};
      shape.cut = {.depth = 20, .taper = taper};
      Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{}, shape});
      add_layer(layers, 1);
      coat(layers, 5.3);
      for (int step = 0; step < 25; ++step) {
        advect(layers, prescribe_speeds(layers, speed, 0.4), 0.4);
      }
      // The tips of acute corners are smaller than a cell: there extraction has its error.
      EXPECT_LT(std::abs(material_volumes(layers)[1]), 0.6) << taper << " " << offset;
      EXPECT_NEAR(highest(layers), 0, 0.02) << taper << " " << offset;
    }
  }
}

class EveryScheme : public testing::TestWithParam<Scheme> {};

INSTANTIATE_TEST_SUITE_P(Schemes, EveryScheme,
                         testing::Values(Scheme::first_order, Scheme::eno2, Scheme::weno5));

TEST_P(EveryScheme, KeepsMirroredGeometryMirroredBitForBit) {
  const Frame frame{.spacing = 0.7, .cells = {33, 20}};
  Layers layers = build_layers(
      frame,
      std::vector<Shape>{
          WaferShape{.material = 0}, hole(6.1, 9.3),
          MaskShape{.material = 1, .thickness = 3, .outline = RectangleOutline{.size = {9, 7.7}}}});
  for (int step = 0; step < 12; ++step) {
    const SpeedField field = prescribe_speeds(layers, [](Vec3d r, MaterialId material) {
      return (material == 0 ? -1.0 : 0.3) * (1 + 0.05 * r.x * r.x + 0.02 * r.y * r.y);
    });
    advect(layers, field, stable_time_step(layers, field, 0.5), GetParam());
  }
  for (const Layer& layer : layers.stack) {
    for (int i = 0; i <= 33; ++i) {
      for (int j = 0; j <= 20; ++j) {
        for (int k = -40; k < 20; ++k) {
          ASSERT_EQ(layer.phi.node(i, j, k), layer.phi.node(33 - i, j, k));
          ASSERT_EQ(layer.phi.node(i, j, k), layer.phi.node(i, 20 - j, k));
        }
      }
    }
  }
}

TEST(Symmetry, ShiftByALeafOfAPeriodicDomainChangesNothing) {
  const Frame frame{
      .spacing = 1, .cells = {40, 24}, .boundary = {Boundary::periodic, Boundary::periodic}};
  const auto run = [&](double shift) {
    Layers layers = single_layer(
        frame,
        [&](Vec3d r) {
          const double x = std::remainder(r.x - shift, 40);
          return std::max(r.z - 0.3, 9.2 - std::sqrt(x * x + r.y * r.y + r.z * r.z));
        },
        -14, 6);
    move(layers, 4, 0.5, [&](Vec3d r, MaterialId) {
      return std::abs(std::remainder(r.x - shift, 40)) < 7 ? 1.0 : -0.5;
    });
    return layers;
  };
  const Layers a = run(0);
  const Layers b = run(8);
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 24; ++j) {
      for (int k = -20; k < 12; ++k) {
        ASSERT_EQ(a.top().node(i, j, k), b.top().node(i + 8, j, k));
      }
    }
  }
}

/// Etches a hole through a mask and a film, with speeds that vary along the facets.
std::uint64_t hash_of_etched_hole(int threads, Scheme scheme) {
  const ThreadLimit limit(threads);
  const Frame frame{
      .spacing = 0.9, .cells = {50, 40}, .boundary = {Boundary::reflective, Boundary::periodic}};
  Layers layers = build_layers(
      frame,
      std::vector<Shape>{
          WaferShape{.material = 0}, LayerShape{.material = 1, .thickness = 5.3}, hole(9.2, 9),
          MaskShape{.material = 2, .thickness = 6, .outline = CircleOutline{.radius = 11.3}}});
  for (int step = 0; step < 8; ++step) {
    const OpenGas gas = open_gas(layers);
    const TriMesh mesh = extract_surface(layers, gas);
    std::vector<CornerSpeeds> speeds;
    for (const Layer& layer : layers.stack) {
      const auto slowness = static_cast<float>(layer.material);
      CornerSpeeds& of_layer = speeds.emplace_back();
      for (const Triangle& t : mesh.triangles) {
        std::array<float, 3> corners{};
        for (int c = 0; c < 3 && layer.material != 2; ++c) {
          corners[c] = -1.0F - 0.02F * slowness * mesh.vertices[t[c]].z;
        }
        of_layer.push_back(corners);
      }
    }
    const double dt = stable_time_step(layers, speeds, 0.5);
    advect(layers, extend_speeds(layers, gas, mesh, speeds, dt), dt, scheme);
  }
  return hash(layers);
}

TEST_P(EveryScheme, GivesTheSameBitsForAnyNumberOfThreads) {
  EXPECT_EQ(hash_of_etched_hole(1, GetParam()), hash_of_etched_hole(2, GetParam()));
}

TEST(TwoDimensions, BothRowsOfNodesAreEqual) {
  Frame frame{.spacing = 1, .cells = {40, 1}};
  frame.two_dimensional = true;
  Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{}, plain_trench(13.7, 20)});
  for (int step = 0; step < 8; ++step) {
    const OpenGas gas = open_gas(layers);
    const TriMesh mesh = extract_surface(layers, gas);
    std::vector<std::array<float, 3>> speeds;
    for (const Triangle& t : mesh.triangles) {
      speeds.push_back({1.0F + 0.01F * mesh.vertices[t[0]].z, 1.0F + 0.01F * mesh.vertices[t[1]].z,
                        1.0F + 0.01F * mesh.vertices[t[2]].z});
    }
    const SpeedField field = extend_speeds(layers, gas, mesh, speeds);
    advect(layers, field, stable_time_step(layers, field, 0.5));
  }
  for (int i = 0; i <= 40; ++i) {
    for (int k = -30; k < 10; ++k) {
      ASSERT_EQ(layers.top().node(i, 0, k), layers.top().node(i, 1, k));
    }
  }
}

}  // namespace
}  // namespace scarp
