#include "levelset/surface/extract_surface.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/surface/cell_cases.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

void expect_no_faults(const TriMesh& mesh, const Frame& frame) {
  const MeshFaults found = faults(mesh, frame);
  EXPECT_EQ(found.non_manifold_edges, 0);
  EXPECT_EQ(found.boundary_off_sides, 0);
  EXPECT_EQ(found.zero_area, 0);
  EXPECT_EQ(found.unused_vertices, 0);
}

TEST(CellCases, EveryCutEdgeLiesOnOneLoopAndEveryLoopIsTriangulated) {
  for (int mask = 0; mask < 256; ++mask) {
    const CellCase& how = cell_cases()[mask];
    std::array<int, 12> seen{};
    for (int n = 0; n < how.loop_count; ++n) {
      const CellLoop& loop = how.loops[n];
      for (int e = 0; e < loop.edge_count; ++e) {
        ++seen[loop.edges[e]];
      }
      std::set<int> corners;
      for (int t = 0; t < loop.triangle_count(); ++t) {
        EXPECT_EQ(std::set<int>(loop.triangles[t].begin(), loop.triangles[t].end()).size(), 3U);
        corners.insert(loop.triangles[t].begin(), loop.triangles[t].end());
      }
      EXPECT_EQ(static_cast<int>(corners.size()), loop.edge_count) << "case " << mask;
    }
    for (int edge = 0; edge < 12; ++edge) {
      const int a = edge_corner(edge);
      const int b = a | (1 << (edge / 4));
      EXPECT_EQ(seen[edge], ((mask >> a) & 1) != ((mask >> b) & 1) ? 1 : 0) << "case " << mask;
    }
  }
}

using Corners = std::array<Vec3d, 3>;

/// Six times the volume of a tetrahedron, positive for d where the others run clockwise.
double orientation(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
  return dot(cross(b - a, c - a), d - a);
}

bool side_crosses(const Corners& sides, const Corners& facet) {
  const auto& [a, b, c] = facet;
  for (int n = 0; n < 3; ++n) {
    const Vec3d& from = sides[n];
    const Vec3d& to = sides[(n + 1) % 3];
    if (orientation(a, b, c, from) * orientation(a, b, c, to) >= 0) continue;
    const double ab = orientation(from, to, a, b);
    const double bc = orientation(from, to, b, c);
    const double ca = orientation(from, to, c, a);
    if ((ab > 0 && bc > 0 && ca > 0) || (ab < 0 && bc < 0 && ca < 0)) return true;
  }
  return false;
}

// Wherever the surface cuts the edges.
TEST(CellCases, LoopsOfACellDoNotCross) {
  RandomStream random({.seed = 1});
  for (int mask = 0; mask < 256; ++mask) {
    const CellCase& how = cell_cases()[mask];
    if (how.loop_count < 2) continue;
    for (int trial = 0; trial < 100; ++trial) {
      std::array<Vec3d, 12> cuts;
      for (int edge = 0; edge < 12; ++edge) {
        const int corner = edge_corner(edge);
        cuts[edge] = Vec3d{static_cast<double>(corner & 1), static_cast<double>(corner >> 1 & 1),
                           static_cast<double>(corner >> 2)};
        const double part = random.uniform();
        const bool is_near_node = random.uniform() < 0.5;
        cuts[edge][edge / 4] += is_near_node ? (part < 0.5 ? 1e-3 : 1 - 1e-3) : part;
      }
      std::vector<std::vector<Corners>> loops(static_cast<std::size_t>(how.loop_count));
      for (int n = 0; n < how.loop_count; ++n) {
        const CellLoop& loop = how.loops[n];
        for (int t = 0; t < loop.triangle_count(); ++t) {
          Corners facet;
          for (int c = 0; c < 3; ++c) facet[c] = cuts[loop.edges[loop.triangles[t][c]]];
          loops[n].push_back(facet);
        }
      }
      for (int n = 0; n < how.loop_count; ++n)
        for (int other = 0; other < how.loop_count; ++other)
          for (const Corners& sides : loops[n])
            for (const Corners& facet : loops[other])
              EXPECT_FALSE(n != other && side_crosses(sides, facet)) << "case " << mask;
    }
  }
}

TEST(MarchingCubes, SphereIsWatertight) {
  const Frame frame{.spacing = 0.5, .cells = {40, 44}};
  const Layers layers = single_layer(
      frame, [](Vec3d r) { return length(r) - 8.1; }, -9, 9);
  const TriMesh mesh = extract_surface(layers);

  expect_no_faults(mesh, frame);
  EXPECT_EQ(faults(mesh, frame).boundary_edges, 0);
  EXPECT_EQ(mesh.vertices.size() - mesh.triangles.size() / 2, 2U);  // V - E + F, E = 3 F / 2
  const double exact = 4.0 / 3 * std::numbers::pi * 8.1 * 8.1 * 8.1;
  EXPECT_NEAR(enclosed_volume(mesh), exact, 0.005 * exact);
}

TEST(MarchingCubes, TrenchEndsOnTheSides) {
  for (const Boundary boundary : {Boundary::reflective, Boundary::periodic}) {
    const Frame frame{.spacing = 1, .cells = {36, 13}, .boundary = {boundary, boundary}};
    TrenchShape trench{.width = 12.6, .centre = 1.2};
    trench.cut.depth = 15;
    const Layers layers = build_layers(frame, std::vector<Shape>{WaferShape{}, trench});
    const TriMesh mesh = extract_surface(layers);
    expect_no_faults(mesh, frame);
    EXPECT_GT(faults(mesh, frame).boundary_edges, 2 * 36);
    EXPECT_EQ(mesh.materials.size(), mesh.triangles.size());
  }
}

TEST(MarchingCubes, PeriodicSidesAreCongruent) {
  const Frame frame{
      .spacing = 1, .cells = {21, 30}, .boundary = {Boundary::periodic, Boundary::periodic}};
  const Layers layers = single_layer(
      frame,
      [](Vec3d r) {
        return 0.6 * (r.z - 2 * std::sin(2 * std::numbers::pi * (r.x / 21 + 0.1)) -
                      std::cos(2 * std::numbers::pi * r.y / 30));
      },
      -16, 16);
  const TriMesh mesh = extract_surface(layers);
  expect_no_faults(mesh, frame);
  const Sides sides = frame.sides();
  for (int axis = 0; axis < 2; ++axis) {
    std::array<std::multiset<std::pair<float, float>>, 2> points;
    for (const Vec3f& v : mesh.vertices) {
      if (v[axis] == static_cast<float>(sides.lower[axis])) {
        points[0].insert({v[1 - axis], v.z});
      }
      if (v[axis] == static_cast<float>(sides.upper[axis])) {
        points[1].insert({v[1 - axis], v.z});
      }
    }
    EXPECT_FALSE(points[0].empty());
    EXPECT_EQ(points[0], points[1]);
  }
}

/// Distance from a point to the nearest vertex, with y left out.
double nearest_vertex(const TriMesh& mesh, double x, double z) {
  double nearest = 1e300;
  for (const Vec3f& v : mesh.vertices) {
    nearest = std::min(nearest, std::hypot(v.x - x, v.z - z));
  }
  return nearest;
}

// phi at the nodes in the plate tells how far the block is: the plate was as thin on its free side.
TEST(SurfaceOfALayer, HasAPlateBesideABlockWhereItIs) {
  const Frame frame{.spacing = 1, .cells = {40, 2}};
  for (const double thickness : {0.2, 0.4, 0.65, 0.9}) {
    const double block = -0.15;  // its wall, right before a plane of nodes
    const auto below_top = [&](Vec3d r) { return std::max(r.x - block - thickness, r.z - 20); };
    Layers layers{.frame = frame, .stack = {}};
    layers.stack.push_back(
        {0, LevelSet(
                frame, [&](Vec3d r) { return std::min(r.z, std::max(block - r.x, below_top(r))); },
                -3, 23)});
    layers.stack.push_back(
        {1, LevelSet(
                frame, [&](Vec3d r) { return std::min(r.z, below_top(r)); }, -3, 23)});
    const std::vector<double> volumes = material_volumes(layers);
    EXPECT_NEAR(volumes[0] / 2, 20 * thickness, 0.5) << thickness;
    EXPECT_NEAR(volumes[1] / 2, 20 * (20 + block), 0.5) << thickness;
  }
}

TEST(Creases, MouthAndBottomOfATrenchAreSharpAtAnyOffset) {
  const Frame frame{.spacing = 1, .cells = {48, 6}};
  double mean_chamfer = 0;
  for (int n = 0; n < 16; ++n) {
    const double half = 8 + n / 16.0;
    const double top = 0.7 * n / 16.0 + 0.05;
    TrenchShape trench{.width = 2 * half};
    trench.cut.depth = 20.2;
    const Layers layers =
        build_layers(frame, std::vector<Shape>{WaferShape{}, LayerShape{0, top}, trench});
    const TriMesh mesh = extract_surface(layers);
    expect_no_faults(mesh, frame);
    for (const double z : {top, top - 20.2}) {
      const double chamfer = nearest_vertex(mesh, half - 1e-3, z + 1e-3);
      EXPECT_LT(chamfer, 0.12) << "half width " << half << ", z " << z;
      mean_chamfer += chamfer / 32;
    }
  }
  EXPECT_LT(mean_chamfer, 0.01);
}

TEST(Creases, MouthOfAHoleIsSharpAllAround) {
  const Frame frame{.spacing = 1, .cells = {48, 48}};
  HoleShape hole{.radius = 15.3};
  hole.cut.depth = 12.4;
  const Layers layers =
      build_layers(frame, std::vector<Shape>{WaferShape{}, LayerShape{0, 0.37}, hole});
  const TriMesh mesh = extract_surface(layers);
  expect_no_faults(mesh, frame);
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto [a, b, c] = corners(mesh, f);
    const Vec3d outward = layers.top().normal((a + b + c) / 3.0);
    EXPECT_GT(dot(normalized(area_vector(mesh, f)), outward), 0) << "facet " << f << " is flipped";
  }
  for (int n = 0; n < 90; ++n) {
    const double angle = n * std::numbers::pi / 45;
    // Crease vertices lie on grid faces: at most a spacing apart.
    double nearest = 1e300;
    for (const Vec3f& v : mesh.vertices) {
      if (std::hypot(v.x - 15.3 * std::cos(angle), v.y - 15.3 * std::sin(angle)) < 1) {
        nearest = std::min(nearest, std::hypot(std::hypot(v.x, v.y) - 15.3, v.z - 0.37));
      }
    }
    EXPECT_LT(nearest, 0.1) << "at " << n * 4 << " deg";
  }
}

TEST(Creases, CornersOfABoxAreVertices) {
  const Frame frame{.spacing = 1, .cells = {40, 40}};
  const MaskShape mask{.material = 1,
                       .thickness = 9.3,
                       .outlines = MaskShape::Outlines::resist,
                       .outline = RectangleOutline{.size = {17.4, 14.7}}};
  const TriMesh mesh = extract_surface(build_layers(frame, std::vector<Shape>{WaferShape{}, mask}));
  expect_no_faults(mesh, frame);
  for (const double x : {-8.7, 8.7}) {
    for (const double y : {-7.35, 7.35}) {
      // Not at the foot, where concave edges within a spacing hide the walls from each other.
      double nearest = 1e300;
      for (const Vec3f& v : mesh.vertices) {
        nearest = std::min(nearest, length(Vec3d(v) - Vec3d{x, y, 9.3}));
      }
      EXPECT_LT(nearest, 0.06) << x << " " << y;
    }
  }
}

TEST(Creases, RoughSurfacesStayManifold) {
  RandomStream random({.seed = 5});
  for (int n = 0; n < 20; ++n) {
    const Boundary boundary = n % 2 == 0 ? Boundary::reflective : Boundary::periodic;
    const Frame frame{.spacing = 1, .cells = {22, 17}, .boundary = {boundary, boundary}};
    struct Ball {
      Vec3d centre;
      double radius;
    };
    std::vector<Ball> balls(12);
    for (Ball& ball : balls) {
      ball.centre = {24 * random.uniform() - 12, 18 * random.uniform() - 9,
                     12 * random.uniform() - 6};
      ball.radius = 1 + 5 * random.uniform();
    }
    // Balls are cut out of the wafer and put on it in turn: edges, thin walls, islands, pinches.
    Layers layers = single_layer(
        frame,
        [&](Vec3d r) {
          double phi = r.z;
          for (std::size_t b = 0; b < balls.size(); ++b) {
            Vec3d from_centre = r - balls[b].centre;
            if (boundary == Boundary::periodic) {
              from_centre.x = std::remainder(from_centre.x, 22);
              from_centre.y = std::remainder(from_centre.y, 17);
            }
            const double ball = length(from_centre) - balls[b].radius;
            phi = b % 2 == 0 ? std::max(phi, -ball) : std::min(phi, ball);
          }
          return phi;
        },
        -14, 14);
    for (int step = 0; step < 3; ++step) {
      const TriMesh mesh = extract_surface(layers);
      expect_no_faults(mesh, frame);
      expect_no_faults(extract_surface(layers, open_gas(layers)), frame);
      move(layers, 0.5, 0.5, [&](Vec3d r, MaterialId) { return r.x > 0 ? 1.0 : -1.0; });
    }
  }
}

}  // namespace
}  // namespace scarp
