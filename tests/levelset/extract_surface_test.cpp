#include "levelset/extract_surface.h"

#include <gtest/gtest.h>

#include "levelset/cell_cases.h"
#include "surfaces.h"

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
    const CellCase& how = cell_case(mask);
    std::array<int, 12> seen{};
    for (std::size_t n = 0; n < how.loops.size(); ++n) {
      EXPECT_EQ(how.triangles[n].size() + 2, how.loops[n].size()) << "case " << mask;
      for (const int edge : how.loops[n]) {
        ++seen[edge];
      }
    }
    for (int edge = 0; edge < 12; ++edge) {
      const int a = edge_corner(edge);
      const int b = a | (1 << (edge / 4));
      EXPECT_EQ(seen[edge], ((mask >> a) & 1) != ((mask >> b) & 1) ? 1 : 0) << "case " << mask;
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

}  // namespace
}  // namespace scarp
