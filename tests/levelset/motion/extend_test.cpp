#include "levelset/motion/extend.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/grid/band.h"
#include "levelset/motion/advect.h"
#include "levelset/surface/extract_surface.h"
#include "levelset/surface/facet_shares.h"
#include "tests/levelset/speeds.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

float speed_at(const Layers& layers, const SpeedField& field, int i, int j, int k) {
  const int leaf = layers.top().band().find(i >> 3, j >> 3, k >> 3);
  return field.speed[static_cast<std::size_t>(leaf) * leaf_size +
                     static_cast<std::size_t>(leaf_offset(i, j, k))];
}

CornerSpeeds corner_speeds(const TriMesh& mesh, const std::function<float(Vec3f)>& speed) {
  CornerSpeeds speeds;
  for (const Triangle& t : mesh.triangles) {
    speeds.push_back(
        {speed(mesh.vertices[t[0]]), speed(mesh.vertices[t[1]]), speed(mesh.vertices[t[2]])});
  }
  return speeds;
}

TEST(Extend, LinearSpeedsOnAPlaneAreExactInTheWholeBand) {
  const Frame frame{.spacing = 2, .cells = {20, 16}};
  const Layers layers = single_layer(
      frame, [](Vec3d r) { return r.z - 0.7; }, -10, 10);
  const TriMesh mesh = extract_surface(layers);
  const SpeedField field =
      extend_speeds(layers, open_gas(layers), mesh,
                    corner_speeds(mesh, [](Vec3f r) { return 1 + 0.02F * r.x - 0.03F * r.y; }));
  for (int i = 0; i <= 20; ++i) {
    for (int j = 0; j <= 16; ++j) {
      for (int k = -3; k <= 4; ++k) {
        EXPECT_NEAR(speed_at(layers, field, i, j, k),
                    1 + 0.02 * frame.node_position(0, i) - 0.03 * frame.node_position(1, j), 1e-5);
      }
    }
  }
  EXPECT_NEAR(max_speed(layers, field), 1 + 0.4 + 0.48, 1e-5);
}

TEST(Extend, SphereWithSpeedOneGrowsAsPrescribed) {
  const Frame frame{.spacing = 1, .cells = {40, 40}};
  Layers layers = single_layer(
      frame, [](Vec3d r) { return length(r) - 10; }, -10, 10);
  for (int step = 0; step < 8; ++step) {
    const TriMesh mesh = extract_surface(layers);
    advect(layers,
           extend_speeds(layers, open_gas(layers), mesh,
                         corner_speeds(mesh, [](Vec3f) { return 1.0F; })),
           0.5);
  }
  for (const Vec3f& v : extract_surface(layers).vertices) {
    EXPECT_NEAR(length(Vec3d(v)), 14, 0.1);
  }
}

TEST(Extend, TheTwoSidesOfAThinWallKeepTheirOwnSpeeds) {
  // A wall 1.3 spacings thick between two trenches: etched from the left only.
  const Frame frame{.spacing = 1, .cells = {40, 8}};
  const Layers layers = single_layer(
      frame,
      [](Vec3d r) {
        const double wall = std::abs(r.x - 0.2) - 0.65;
        return std::max(r.z - 10.2, std::min(wall, r.z + 20.2));
      },
      -30, 20);
  const TriMesh mesh = extract_surface(layers);
  const SpeedField field =
      extend_speeds(layers, open_gas(layers), mesh,
                    corner_speeds(mesh, [](Vec3f r) { return r.x < 0.2F ? -1.0F : 0.0F; }));
  for (int k = -12; k < 6; ++k) {
    EXPECT_EQ(speed_at(layers, field, 18, 3, k), -1) << k;  // gas on the left
    EXPECT_EQ(speed_at(layers, field, 21, 3, k), 0) << k;   // gas on the right
    EXPECT_EQ(speed_at(layers, field, 23, 3, k), 0) << k;
  }
}

// The gradient at a node in a wall is its distance from the middle, in spacings. The facets are
// those of a surface that has moved on since: the left one is nearer to the node.
TEST(Extend, NearTheMiddleOfAWallNodesAskTheNearerSide) {
  const Frame frame{.spacing = 1, .cells = {40, 8}};
  const auto speed_beside_middle = [&](double distance) {
    const Layers layers = single_layer(
        frame,
        [=](Vec3d r) {
          return std::max(r.z - 10.2, std::min(std::abs(r.x + distance) - 0.65, r.z + 20.2));
        },
        -30, 20);
    constexpr float left = -0.3F;
    constexpr float right = 0.6F;
    TriMesh mesh;
    mesh.vertices = {{left, -4, -15},  {left, 4, -15},  {left, 4, 8},  {left, -4, 8},
                     {right, -4, -15}, {right, 4, -15}, {right, 4, 8}, {right, -4, 8}};
    mesh.triangles = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}};
    const CornerSpeeds speeds{{-1, -1, -1}, {-1, -1, -1}, {-2, -2, -2}, {-2, -2, -2}};
    return speed_at(layers, extend_speeds(layers, open_gas(layers), mesh, speeds), 20, 3, -4);
  };
  EXPECT_EQ(speed_beside_middle(0.45), -1);
  EXPECT_EQ(speed_beside_middle(0.55), -2);
}

// In the middle of a gap both walls are as near.
TEST(Extend, MidwayBetweenWallsIsTheMeanOfTheirSpeeds) {
  const Frame frame{.spacing = 1, .cells = {40, 8}};
  for (const bool mirrored : {false, true}) {
    const Layers layers = single_layer(
        frame,
        [](Vec3d r) { return std::max(r.z - 6.2, std::min(2.4 - std::abs(r.x), r.z + 14.2)); }, -20,
        12);
    const TriMesh mesh = extract_surface(layers);
    const SpeedField field = extend_speeds(
        layers, open_gas(layers), mesh,
        corner_speeds(mesh, [&](Vec3f r) { return (r.x < 0) != mirrored ? 1.0F : 3.0F; }));
    EXPECT_EQ(speed_at(layers, field, 19, 3, -4), mirrored ? 3 : 1);
    EXPECT_EQ(speed_at(layers, field, 20, 3, -4), 2);
    EXPECT_EQ(speed_at(layers, field, 21, 3, -4), mirrored ? 1 : 3);
  }
}

// Beyond a corner, where no neighbour is nearer to the surface and two are as near; of speeds that
// are as large the one that etches.
TEST(Extend, BeyondACornerIsTheFasterOfBothSides) {
  const Frame frame{.spacing = 1, .cells = {30, 16}};
  const auto speed_beyond = [&](float above, float beside) {
    const Layers layers = single_layer(
        frame, [](Vec3d r) { return std::max(r.z, r.x) - 0.5; }, -10, 8);
    TriMesh mesh;
    mesh.vertices = {{-15, -8, 0.5F}, {0.5F, -8, 0.5F}, {0.5F, 8, 0.5F},
                     {-15, 8, 0.5F},  {0.5F, -8, -10},  {0.5F, 8, -10}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}};
    const CornerSpeeds speeds{{above, above, above},
                              {above, above, above},
                              {beside, beside, beside},
                              {beside, beside, beside}};
    return speed_at(layers, extend_speeds(layers, open_gas(layers), mesh, speeds), 16, 8, 1);
  };
  EXPECT_EQ(speed_beyond(1, -3), -3);
  EXPECT_EQ(speed_beyond(4, -3), 4);
  EXPECT_EQ(speed_beyond(2, -2), -2);
  EXPECT_EQ(speed_beyond(-2, 2), -2);
}

// A thin wall on a periodic side: one of its faces is as near as the image of the other. The first
// one of the mesh answers.
TEST(Extend, OfAFacetAndAnImageThatAreAsNearTheFirstAnswers) {
  const Frame frame{
      .spacing = 1, .cells = {20, 8}, .boundary = {Boundary::periodic, Boundary::reflective}};
  const Layers layers = single_layer(
      frame,
      [](Vec3d r) {
        return std::max(r.z - 10.2, std::min(std::abs(std::abs(r.x) - 10) - 0.65, r.z + 20.2));
      },
      -30, 20);
  constexpr float face = 9.35F;
  for (const bool reversed : {false, true}) {
    TriMesh mesh;
    mesh.vertices = {{face, -4, -15},  {face, 4, -15},  {face, 4, 8},  {face, -4, 8},
                     {-face, -4, -15}, {-face, 4, -15}, {-face, 4, 8}, {-face, -4, 8}};
    mesh.triangles = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}};
    CornerSpeeds speeds{{-1, -1, -1}, {-1, -1, -1}, {-2, -2, -2}, {-2, -2, -2}};
    if (reversed) {
      std::ranges::reverse(mesh.triangles);
      std::ranges::reverse(speeds);
    }
    const SpeedField field = extend_speeds(layers, open_gas(layers), mesh, speeds);
    EXPECT_EQ(speed_at(layers, field, 0, 3, -4), reversed ? -2 : -1);
  }
}

TEST(Extend, LooksAcrossPeriodicSides) {
  const Frame frame{
      .spacing = 1, .cells = {20, 12}, .boundary = {Boundary::periodic, Boundary::periodic}};
  // Half a trench at either side; only the facets left of the middle are given.
  TrenchShape trench{.width = 9.1, .centre = -10};
  trench.cut.depth = 12;
  const Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{}, trench});
  const TriMesh mesh = extract_surface(layers);
  TriMesh left = mesh;
  left.triangles.clear();
  for (const Triangle& t : mesh.triangles) {
    if (mesh.vertices[t[0]].x < -2 && mesh.vertices[t[1]].x < -2 && mesh.vertices[t[2]].x < -2) {
      left.triangles.push_back(t);
    }
  }
  const SpeedField field = extend_speeds(layers, open_gas(layers), left,
                                         corner_speeds(left, [](Vec3f) { return 1.0F; }));
  EXPECT_EQ(speed_at(layers, field, 19, 3, -11), 1);  // bottom, next to the right side
  EXPECT_EQ(speed_at(layers, field, 15, 3, -11), 0);  // further away: its facets are missing
}

TEST(Extend, NothingMovesInAClosedVoid) {
  const Frame frame{.spacing = 1, .cells = {40, 40}};
  const Layers layers = single_layer(
      frame,
      [](Vec3d r) {
        return std::max(r.z - 0.2, 6.3 - length(r - Vec3d{0, 0, -9.2}));
      },
      -24, 4);
  const OpenGas gas = open_gas(layers);
  const TriMesh mesh = extract_surface(layers, gas);
  const SpeedField field =
      extend_speeds(layers, gas, mesh, corner_speeds(mesh, [](Vec3f) { return 1.0F; }));
  // Below the wafer's surface by 1, above the void's top by 1.9; then beside it.
  EXPECT_EQ(speed_at(layers, field, 20, 20, 0), 1);
  EXPECT_EQ(speed_at(layers, field, 20, 20, -3), 0);
  EXPECT_EQ(speed_at(layers, field, 27, 20, -9), 0);
  EXPECT_EQ(speed_at(layers, field, 26, 20, -9), 0);
}

/// A trench with slanted walls and a ridge in it, whose floors have grown and whose walls have not;
/// periodic.
Layers grown_trench(double distance) {
  const Frame frame{.spacing = 1, .cells = {40, 24}, .boundary = {Boundary::periodic, {}}};
  return single_layer(
      frame,
      [=](Vec3d r) {
        const double opening = 9.37 + 0.2 * r.z + std::sin(0.4 * r.y) - std::abs(r.x);
        const double floor = r.z + 10.6 - distance;
        const double trench = std::max(r.z - 0.3 - distance, std::min(opening, floor));
        const double ridge = std::max(std::abs(r.x + 0.1 * r.z) - 1.6, r.z + 3.1 - distance);
        return std::min(trench, ridge);
      },
      -20, 8);
}

// As the surface moves past nodes their gradients turn, and facets as near as others or that faced
// away before come to answer.
TEST(Extend, FacetsThatAreKeptChangeNoSpeed) {
  const TriMesh mesh = extract_surface(grown_trench(0));
  // Another one on each facet: it shows which of them answered.
  LayerSpeeds speeds{.speed = CornerSpeeds(mesh.triangles.size())};
  for (std::size_t f = 0; f < speeds.speed.size(); ++f)
    speeds.speed[f].fill(1 + static_cast<float>(f));
  FacetTree kept(mesh);
  for (const double distance : {0.0, 0.3, 0.7, 1.1, 1.4, 1.1, 0.2}) {
    const Layers layers = grown_trench(distance);
    const auto speeds_from = [&](FacetTree& facets) {
      return extend_speeds(layers, open_gas(layers), facets, {&speeds, 1}, {}, 0.1, 2).speed;
    };
    FacetTree anew(mesh);
    EXPECT_TRUE(speeds_from(kept) == speeds_from(anew)) << distance;
    EXPECT_TRUE(speeds_from(kept) == speeds_from(anew)) << distance;
  }
}

// A floor that has sunk below the facets left walls behind it, whose nodes are as near to the old
// floor as to the old walls.
TEST(Extend, WallsThatAFloorLeavesBehindMoveAsTheWalls) {
  const Frame frame{.spacing = 1, .cells = {30, 16}};
  const auto trench = [&](double depth) {
    return single_layer(
        frame,
        [=](Vec3d r) { return std::max(r.z - 0.3, std::min(7.37 - std::abs(r.x), r.z + depth)); },
        -20, 8);
  };
  TriMesh mesh = extract_surface(trench(9.41));
  const Layers layers = trench(10.6);
  const auto field_of = [&] {
    LayerSpeeds speeds;
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
      const float speed = normalized(area_vector(mesh, f)).z > 0.7 ? -1.0F : -0.1F;
      speeds.speed.push_back({speed, speed, speed});
    }
    FacetTree facets(mesh);
    return extend_speeds(layers, open_gas(layers), facets, {&speeds, 1}, {}, 0.1, 2);
  };
  const SpeedField field = field_of();
  // Columns 15 - 7 and 15 + 7 lie in the gas.
  EXPECT_EQ(speed_at(layers, field, 22, 8, -11), -1);
  EXPECT_EQ(speed_at(layers, field, 8, 8, -11), -1);
  EXPECT_EQ(speed_at(layers, field, 23, 8, -10), -0.1F);
  EXPECT_EQ(speed_at(layers, field, 7, 8, -10), -0.1F);
  std::ranges::reverse(mesh.triangles);
  std::ranges::reverse(mesh.materials);
  EXPECT_EQ(field_of().speed, field.speed);
}

// Of a step drawn along the nodes, which lies .001 beside them, simplified to two sides: which one
// is nearer to the nodes of its edge is chance.
TEST(Extend, NodesAtAnEdgeTakeTheMeanOfItsSides) {
  const Frame frame{.spacing = 1, .cells = {30, 16}};
  const auto speed_at_edge = [&](float above, float beside, bool reversed) {
    const Layers layers = single_layer(
        frame, [=](Vec3d r) { return std::max(r.z - above, r.x - beside); }, -10, 8);
    TriMesh mesh;
    mesh.vertices = {{-15, -8, above}, {beside, -8, above}, {beside, 8, above},
                     {-15, 8, above},  {beside, -8, -10},   {beside, 8, -10}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}};
    CornerSpeeds speeds{{1, 1, 1}, {1, 1, 1}, {2, 2, 2}, {2, 2, 2}};
    if (reversed) {
      std::ranges::reverse(mesh.triangles);
      std::ranges::reverse(speeds);
    }
    return speed_at(layers, extend_speeds(layers, open_gas(layers), mesh, speeds), 15, 8, 0);
  };
  for (const bool reversed : {false, true}) {
    EXPECT_NEAR(speed_at_edge(0.001F, 0.001F, reversed), 1.5, 0.001);
    EXPECT_NEAR(speed_at_edge(0.001F, 0.00101F, reversed), 1.5, 0.01);
    EXPECT_NEAR(speed_at_edge(0.00101F, 0.001F, reversed), 1.5, 0.01);
    EXPECT_EQ(speed_at_edge(0.2F, 0.3F, reversed), 1);
    EXPECT_EQ(speed_at_edge(0.3F, 0.2F, reversed), 2);
  }
}

// Of a step, and of a floor with a wall.
TEST(Extend, NodesAtAnEdgeFollowTheSideThatLeads) {
  const Frame frame{.spacing = 1, .cells = {30, 16}};
  constexpr float at = 0.001F;
  const auto speed_at_edge = [&](bool stands_out, float level, float steep) {
    const Layers layers = single_layer(
        frame,
        [=](Vec3d r) {
          return stands_out ? std::max(r.z - at, r.x - at) : std::min(r.z - at, at - r.x);
        },
        -10, 10);
    TriMesh mesh;
    mesh.vertices = {{-15, -8, at}, {at, -8, at}, {at, 8, at}, {-15, 8, at}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    if (stands_out) {
      mesh.vertices.insert(mesh.vertices.end(), {{at, -8, -10}, {at, 8, -10}});
      mesh.triangles.insert(mesh.triangles.end(), {{1, 4, 5}, {1, 5, 2}});
    } else {
      mesh.vertices.insert(mesh.vertices.end(), {{at, -8, 10}, {at, 8, 10}});
      mesh.triangles.insert(mesh.triangles.end(), {{1, 4, 5}, {1, 5, 2}});
    }
    const CornerSpeeds speeds{
        {level, level, level}, {level, level, level}, {steep, steep, steep}, {steep, steep, steep}};
    return speed_at(layers, extend_speeds(layers, open_gas(layers), mesh, speeds), 15, 8, 0);
  };
  EXPECT_EQ(speed_at_edge(true, -1, 0), -1);
  EXPECT_EQ(speed_at_edge(true, -1, -3), -3);
  EXPECT_EQ(speed_at_edge(true, -1, 1), -1);
  EXPECT_NEAR(speed_at_edge(true, 1, 3), 2, 0.01);
  EXPECT_EQ(speed_at_edge(false, 1, 0), 1);
  EXPECT_EQ(speed_at_edge(false, 1, 3), 3);
  EXPECT_EQ(speed_at_edge(false, -1, 1), 1);
  EXPECT_NEAR(speed_at_edge(false, -1, -3), -2, 0.2);
}

// Mirror images of each other have the same speed, whichever is found first, but other parts.
TEST(FacetShares, OfSidesThatAreAsFastNoneLeads) {
  TriMesh mesh;
  mesh.vertices = {{-4, -4, 0}, {0, -4, 0}, {0, 4, 0}, {0, -4, -4}};
  mesh.triangles = {{0, 1, 2}, {1, 3, 2}};
  std::vector<FacetShare> sides(2);
  sides[0].point.triangle = 0;
  sides[1].point.triangle = 1;
  const auto leading = [&](const std::array<float, 2>& speeds) {
    return leading_side(mesh, sides, speeds);
  };
  EXPECT_EQ(leading({-1, -1}), std::nullopt);
  EXPECT_EQ(leading({-1, -2}), 1U);
  EXPECT_EQ(leading({-2, 1}), 0U);
  EXPECT_EQ(leading({1, 2}), std::nullopt);
}

// The top of a step drawn along the nodes is etched, its side is not.
TEST(Extend, ATopThatIsEtchedLeavesNoFence) {
  const Frame frame{.spacing = 1, .cells = {30, 16}};
  Layers layers = single_layer(
      frame, [](Vec3d r) { return std::max(r.z, r.x - 0.001); }, -20, 8);
  constexpr double dt = 0.3;
  constexpr int moves = 30;
  for (int move = 0; move < moves; ++move) {
    const TriMesh mesh = extract_surface(layers);
    CornerSpeeds speeds;
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
      const float speed = normalized(area_vector(mesh, f)).z > 0.7 ? -1.0F : 0.0F;
      speeds.push_back({speed, speed, speed});
    }
    advect(layers, extend_speeds(layers, open_gas(layers), mesh, speeds), dt, Scheme::eno2);
  }
  const Box box = bounding_box(extract_surface(layers));
  EXPECT_NEAR(box.upper.z, -moves * dt, 0.1);
}

// The side beyond the periodic side of the domain as well.
TEST(Extend, NodesAtAnEdgeAcrossAPeriodicSideTakeTheMeanOfItsSides) {
  const Frame frame{
      .spacing = 1, .cells = {30, 16}, .boundary = {Boundary::periodic, Boundary::reflective}};
  constexpr float above = 0.001F;
  constexpr float left = 14.999F;  // of a bar that goes on to x = 0 beyond the side
  const Layers layers = single_layer(
      frame,
      [](Vec3d r) {
        const double from_middle = std::remainder(r.x + 7.4995, 30);
        return std::max(r.z - 0.001, std::abs(from_middle) - 7.5005);
      },
      -10, 8);
  TriMesh mesh;
  mesh.vertices = {{-15, -8, above}, {0.001F, -8, above}, {0.001F, 8, above}, {-15, 8, above},
                   {left, -8, -10},  {left, 8, -10},      {left, 8, above},   {left, -8, above}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 7, 6}, {4, 6, 5}};
  const LayerSpeeds speeds{.speed = {{1, 1, 1}, {1, 1, 1}, {2, 2, 2}, {2, 2, 2}}};
  FacetTree facets(mesh);
  // As well when it is asked again, of facets that answered before.
  for (int move = 0; move < 2; ++move) {
    const SpeedField field =
        extend_speeds(layers, open_gas(layers), facets, {&speeds, 1}, {}, 0.1, close_facets);
    EXPECT_NEAR(speed_at(layers, field, 0, 8, 0), 1.5, 0.01);
  }
}

TEST(FacetShares, SidesCountOnceByTheirNearestFacet) {
  // A floor of two facets beside a wall of one, over the node at the origin.
  TriMesh mesh;
  mesh.vertices = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {0, 0, 4}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}};
  mesh.materials = {MaterialId{}, MaterialId{}, MaterialId{}};
  const auto shares = [&](Vec3d direction, double further) {
    std::vector<FacetShare> result(3);
    for (std::uint32_t f = 0; f < 3; ++f) {
      result[f].point.triangle = f;
      result[f].point.distance = 1 + (f == 2 ? further : 0);
    }
    share_out(mesh, direction, 0.1, result);
    std::array<double, 3> of_facets{};
    for (const FacetShare& each : result) of_facets[each.point.triangle] = each.share;
    return of_facets;
  };
  using Shares = std::array<double, 3>;
  EXPECT_EQ(shares({2, 0, 2}, 0), (Shares{0.5, 0, 0.5}));
  EXPECT_EQ(shares({0.2, 0, 2}, 0), (Shares{1, 0, 0}));
  EXPECT_EQ(shares({2, 0, 2}, 0.11), (Shares{1, 0, 0}));
  EXPECT_NEAR(shares({2, 0, 2}, 0.05)[2], 1.0 / 3, 1e-12);
  mesh.materials[2] = static_cast<MaterialId>(1);
  EXPECT_EQ(shares({2, 0, 2}, 0), (Shares{1, 0, 0}));
}

// Which marching cubes make where an edge lies close to a node; on a simplified mesh it is gone.
TEST(FacetShares, ANarrowBevelIsNoSide) {
  const auto shares = [](float bevel) {
    TriMesh mesh;
    mesh.vertices = {{bevel, 0, 0},   {90, 0, 0},  {90, 40, 0},   {0, 0, -bevel},
                     {0, 40, -bevel}, {0, 0, -90}, {bevel, 40, 0}};
    mesh.triangles = {{0, 6, 3}, {0, 1, 2}, {3, 4, 5}};
    std::vector<FacetShare> result(3);
    for (std::uint32_t f = 0; f < 3; ++f) {
      result[f].point.triangle = f;
      result[f].point.distance = f == 0 ? 0.07 : 0.1;
    }
    share_out(mesh, {-1, 0, 1}, 0.1, result);
    std::array<double, 3> of_facets{};
    for (const FacetShare& each : result) of_facets[each.point.triangle] = each.share;
    return of_facets;
  };
  using Shares = std::array<double, 3>;
  EXPECT_EQ(shares(0.1F), (Shares{0, 0.5, 0.5}));
  EXPECT_EQ(shares(9), (Shares{1, 0, 0}));
}

TEST(Extend, CarriesTheAmplitudesOfFactors) {
  const Frame frame{.spacing = 1, .cells = {20, 16}};
  const Layers layers = single_layer(
      frame, [](Vec3d r) { return r.z - 0.3; }, -10, 10);
  const TriMesh mesh = extract_surface(layers);
  const AngularFactor beam =
      BeamResponse(normalized(Vec3d{1, 0, -1}), [](double cosine) { return 2 * cosine; });
  const auto even = corner_speeds(mesh, [](Vec3f) { return -0.5F; });
  const auto rising = corner_speeds(mesh, [](Vec3f r) { return -1 - 0.02F * r.x; });
  const LayerSpeeds speeds{.speed = rising, .parts = {even, rising}};
  FacetTree facets(mesh);
  const SpeedField field =
      extend_speeds(layers, open_gas(layers), facets, {&speeds, 1}, {&beam, 1}, 0.1, close_facets);
  ASSERT_EQ(field.angular.size(), 1U);
  const SpeedField amplitude{.speed = field.angular[0].amplitude};
  for (int i = 0; i <= 20; ++i) {
    for (int k = -3; k <= 3; ++k) {
      EXPECT_EQ(speed_at(layers, field, i, 5, k), -0.5F);
      EXPECT_NEAR(speed_at(layers, amplitude, i, 5, k), -1 - 0.02 * (i - 10), 1e-5);
    }
  }
  // The sum over the axes of the derivatives of 2 |p| cos is 2 sqrt(2).
  const double limit = 0.5 + 1.2 * std::max(2.0, 2 * std::sqrt(2.0) / std::sqrt(3.0));
  EXPECT_NEAR(max_speed(layers, field), limit, 1e-3);
  EXPECT_NEAR(stable_time_step(layers, {&speeds, 1}, {&beam, 1}, 0.4), 0.4 / limit, 1e-4);
}

/// On a flat wafer under a film that is passed within 0.6 s: the isotropic part and the amplitude
/// of a beam, next to the surface.
struct PassedFilm {
  double isotropic = 0;
  double amplitude = 0;
  double max_speed = 0;
};

/// Shape: both parts of the wafer, then those of the film.
PassedFilm passed_film(double thickness, const std::array<std::array<float, 2>, 2>& parts) {
  const Layers layers =
      build_layers({.spacing = 1, .cells = {8, 8}},
                   std::vector<Shape>{WaferShape{.material = 0},
                                      LayerShape{.material = 1, .thickness = thickness}});
  const TriMesh mesh = extract_surface(layers);
  const AngularFactor beam = BeamResponse({0, 0, -1}, [](double cosine) { return cosine; });
  std::vector<LayerSpeeds> speeds;
  for (const auto& [isotropic, amplitude] : parts) {
    const auto everywhere = [&](float value) {
      return corner_speeds(mesh, [value](Vec3f) { return value; });
    };
    speeds.push_back({.speed = everywhere(isotropic + amplitude),
                      .parts = {everywhere(isotropic), everywhere(amplitude)}});
  }
  FacetTree facets(mesh);
  const SpeedField field =
      extend_speeds(layers, open_gas(layers), facets, speeds, {&beam, 1}, 0.6, close_facets);
  const SpeedField amplitude{.speed = field.angular[0].amplitude};
  return {speed_at(layers, field, 4, 4, 0), speed_at(layers, amplitude, 4, 4, 0),
          max_speed(layers, field)};
}

// 0.5 s through the film, 0.1 s at 4 below it.
TEST(Extend, ScalesAmplitudesWhereAFilmIsPassed) {
  const PassedFilm found = passed_film(0.5, {{{0, -4}, {0, -1}}});
  EXPECT_EQ(found.isotropic, 0);
  EXPECT_NEAR(found.amplitude, -(0.5 + 0.4) / 0.6, 0.02);
}

// A film that grows nearly as fast as ions take it off: 0.2 s through it, 0.4 s at 4 below it.
TEST(Extend, AddsToWhatCancelsWhereAFilmIsPassed) {
  const PassedFilm found = passed_film(0.01, {{{0, -4}, {1, -1.05F}}});
  EXPECT_NEAR(found.amplitude, -1.05, 1e-3);
  EXPECT_NEAR(found.isotropic + found.amplitude, -(0.01 + 1.6) / 0.6, 0.15);
  EXPECT_LT(found.max_speed, 5);
}

}  // namespace
}  // namespace scarp
