#include "levelset/start/mesh_solid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>

#include "levelset/grid/welded.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/start/shapes.h"
#include "levelset/surface/extract_surface.h"

namespace scarp {
namespace {

using testing::HasSubstr;

const Frame domain{.spacing = 1, .cells = {40, 40}};

/// A box, twelve triangles that face outwards.
TriMesh box_mesh(Vec3f lower, Vec3f upper) {
  TriMesh mesh;
  for (int n = 0; n < 8; ++n) {
    mesh.vertices.push_back({(n & 1) != 0 ? upper.x : lower.x, (n & 2) != 0 ? upper.y : lower.y,
                             (n & 4) != 0 ? upper.z : lower.z});
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

/// A surface z(x, y) over a square, corners not shared between triangles.
template <class Height>
TriMesh patch(float half, int count, const Height& height) {
  TriMesh mesh;
  const auto corner = [&](int i, int j) {
    const float x = half * (2.0F * static_cast<float>(i) / static_cast<float>(count) - 1);
    const float y = half * (2.0F * static_cast<float>(j) / static_cast<float>(count) - 1);
    mesh.vertices.push_back({x, y, height(x, y)});
    return static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  };
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      mesh.triangles.push_back({corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)});
      mesh.triangles.push_back({corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)});
    }
  }
  return mesh;
}

void turn_over(TriMesh& mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[0], t[1]);
}

TEST(MeshSolid, ABoxHasItsSignedDistanceEverywhere) {
  const MeshSolid solid(box_mesh({-6, -7, 2}, {6, 7, 12}));
  const Vec3d half{6, 7, 5};
  for (double x = -12; x <= 12; x += 1.7) {
    for (double y = -12; y <= 12; y += 1.3) {
      for (double z = -4; z <= 18; z += 1.1) {
        const Vec3d q{std::abs(x) - half.x, std::abs(y) - half.y, std::abs(z - 7) - half.z};
        const Vec3d out{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
        const double exact = length(out) + std::min(0.0, std::max({q.x, q.y, q.z}));
        EXPECT_NEAR(solid({x, y, z}).value, exact, 1e-9) << x << ' ' << y << ' ' << z;
      }
    }
  }
}

TriMesh together(const TriMesh& a, const TriMesh& b) {
  TriMesh both = a;
  const auto count = static_cast<std::uint32_t>(a.vertices.size());
  both.vertices.insert(both.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const Triangle& t : b.triangles) {
    both.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
  }
  return both;
}

/// The exact sign, whatever the order of the bodies in the file.
void expect_solid_where(const std::vector<TriMesh>& bodies, const std::function<bool(Vec3d)>& in) {
  std::vector<std::size_t> order(bodies.size());
  std::iota(order.begin(), order.end(), 0);
  do {
    TriMesh mesh;
    for (const std::size_t n : order) mesh = together(mesh, bodies[n]);
    ASSERT_EQ(mesh_fault(domain, welded(mesh)), std::nullopt);
    const MeshSolid solid(welded(mesh));
    for (double x = -14.1; x <= 14; x += 1.5) {
      for (double y = -14.2; y <= 14; y += 1.9) {
        for (double z = -2.3; z <= 18; z += 1.13) {
          ASSERT_EQ(solid({x, y, z}).value < 0, in({x, y, z})) << x << ' ' << y << ' ' << z;
        }
      }
    }
  } while (std::next_permutation(order.begin(), order.end()));
}

/// Whether r lies within a cube around (0, 0, 8).
bool in_cube(Vec3d r, double half) {
  return std::max({std::abs(r.x), std::abs(r.y), std::abs(r.z - 8)}) < half;
}

TriMesh cube(float half) { return box_mesh({-half, -half, 8 - half}, {half, half, 8 + half}); }

TriMesh hollow(float half) {
  TriMesh mesh = cube(half);
  turn_over(mesh);
  return mesh;
}

TEST(MeshSolid, BodiesOfOneFileMayOverlapAndContainEachOther) {
  // Inside one body the surface of another means nothing.
  expect_solid_where({cube(8), cube(4), cube(2)}, [](Vec3d r) { return in_cube(r, 8); });
  const Vec3f shift{6, 0, 0};
  TriMesh moved = cube(4);
  for (Vec3f& r : moved.vertices) r += shift;
  expect_solid_where({cube(5), moved},
                     [&](Vec3d r) { return in_cube(r, 5) || in_cube(r - Vec3d(shift), 4); });
}

TEST(MeshSolid, ABodyInsideOutIsACavityOfTheSmallestAroundIt) {
  expect_solid_where({cube(8), hollow(6), cube(4), hollow(3)}, [](Vec3d r) {
    return in_cube(r, 8) && !in_cube(r, 6) ? true : in_cube(r, 4) && !in_cube(r, 3);
  });
  TriMesh beside = cube(2);
  for (Vec3f& r : beside.vertices) r.x += 9;
  EXPECT_THAT(mesh_fault(domain, welded(together(hollow(4), beside))).value_or("none"),
              HasSubstr("no other body is all around it"));
}

TEST(MeshSolid, DistancesToSeveralBodiesAreThoseToTheirUnion) {
  const Vec3f shift{0, 0, 12};
  TriMesh above = cube(4);
  for (Vec3f& r : above.vertices) r += shift;
  const MeshSolid solid(welded(together(cube(5), above)));
  EXPECT_NEAR(solid({0, 0, 0}).value, 3, 1e-9);
  EXPECT_NEAR(solid({0, 0, 14.5}).value, 1.5, 1e-9);
  EXPECT_NEAR(solid({0, 0, 17}).value, -1, 1e-9);
  EXPECT_NEAR(solid({0, 8, 25}).value, std::hypot(4, 1), 1e-9);
  const MeshSolid shell(welded(together(hollow(3), cube(6))));
  EXPECT_NEAR(shell({0, 0, 8}).value, 3, 1e-9);
  EXPECT_NEAR(shell({0, 4, 8}).value, -1, 1e-9);
  EXPECT_NEAR(shell({0, 5.5, 8}).value, -0.5, 1e-9);
}

TEST(MeshSolid, FaultsNameThePlace) {
  const auto fault = [](const TriMesh& mesh) {
    return mesh_fault(domain, welded(mesh)).value_or("none");
  };
  const TriMesh closed = box_mesh({-6, -7, 2}, {6, 7, 12});
  EXPECT_EQ(fault(closed), "none");
  TriMesh over = closed;
  turn_over(over);
  EXPECT_THAT(fault(over), HasSubstr("inside out"));
  TriMesh open = closed;
  open.triangles.pop_back();
  EXPECT_THAT(fault(open), HasSubstr("is open inside the domain: the edge from (6, "));
  TriMesh mixed = closed;
  std::swap(mixed.triangles[3][0], mixed.triangles[3][1]);
  EXPECT_THAT(fault(mixed), HasSubstr("oriented differently"));

  const auto flat = [](float, float) { return 3.0F; };
  EXPECT_EQ(fault(patch(20, 4, flat)), "none");
  EXPECT_EQ(fault(patch(25, 4, flat)), "none");
  EXPECT_THAT(fault(patch(15, 4, flat)), HasSubstr("open inside the domain"));
  TriMesh down = patch(20, 4, flat);
  turn_over(down);
  EXPECT_THAT(fault(down), HasSubstr("faces down"));
  // However small the domain is.
  for (Vec3f& r : down.vertices) r = 0.01F * r;
  EXPECT_THAT(mesh_fault({.spacing = 0.01, .cells = {40, 40}}, welded(down)).value_or("none"),
              HasSubstr("faces down"));
  EXPECT_THAT(fault({}), HasSubstr("no triangle"));
  EXPECT_THAT(fault(together(patch(20, 4, flat), closed)), HasSubstr("is open and in pieces"));
}

// A prism with a notch whose caps cover the notch as well, with a triangle that is turned over
// there: closed, and every edge in order.
TEST(MeshSolid, FoldsAreNamed) {
  TriMesh prism;
  for (const float z : {-1.0F, 4.0F})
    for (const auto& [x, y] :
         {std::pair{-5.0F, -5.0F}, {5.0F, -5.0F}, {5.0F, 5.0F}, {0.0F, -4.0F}, {-5.0F, 5.0F}})
      prism.vertices.push_back({x, y, z});
  prism.triangles = {{2, 1, 0}, {4, 2, 0}, {4, 3, 2}, {5, 6, 7}, {5, 7, 9}, {7, 8, 9}};
  for (std::uint32_t n = 0; n < 5; ++n) {
    const std::uint32_t next = (n + 1) % 5;
    prism.triangles.push_back({n, next, next + 5});
    prism.triangles.push_back({n, next + 5, n + 5});
  }
  EXPECT_THAT(mesh_fault(domain, prism).value_or("none"), HasSubstr("is folded at ("));
  prism.triangles[0] = {3, 1, 0};
  prism.triangles[1] = {4, 3, 0};
  prism.triangles[2] = {3, 2, 1};
  prism.triangles[3] = {5, 6, 8};
  prism.triangles[4] = {5, 8, 9};
  prism.triangles[5] = {6, 7, 8};
  EXPECT_EQ(mesh_fault(domain, prism), std::nullopt);
}

TEST(MeshSolid, ThicknessIsThatOfAPlateHoweverItLies) {
  TriMesh plate = box_mesh({-9, -9, 0}, {9, 9, 1.5F});
  EXPECT_NEAR(thickness(plate), 1.5, 1e-9);
  for (Vec3f& r : plate.vertices) r = {0.6F * r.x - 0.8F * r.z, r.y, 0.8F * r.x + 0.6F * r.z};
  EXPECT_NEAR(thickness(plate), 1.5, 1e-5);
}

TriMesh as_soup(const TriMesh& mesh) {
  TriMesh soup;
  for (const Triangle& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.vertices.size());
    for (const std::uint32_t v : t) soup.vertices.push_back(mesh.vertices[v]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

double volume_above_zero(const std::vector<Shape>& shapes) {
  double volume = 0;
  for (const double v : material_volumes(build_layers(domain, shapes))) volume += v;
  return volume;
}

TEST(MeshShape, ABodyIsAddedOrCutOut) {
  const auto body =
      std::make_shared<const TriMesh>(box_mesh({-6.2F, -7.3F, -5.4F}, {6.2F, 7.3F, 8.6F}));
  EXPECT_NEAR(volume_above_zero({WaferShape{}, MeshShape{.mesh = body, .material = 1}}),
              12.4 * 14.6 * 8.6, 20);
  EXPECT_NEAR(volume_above_zero({WaferShape{}, MeshShape{.mesh = body}}), -12.4 * 14.6 * 5.4, 20);
}

/// Boxes that touch: a face, a part of a face, an edge; with vertices in common or not.
struct TouchingBoxes {
  const char* what;
  std::vector<TriMesh> boxes;
  double volume;
};

std::vector<TouchingBoxes> touching_boxes() {
  TriMesh mirrored = box_mesh({-8, -4, 2}, {0, 4, 10});
  for (Vec3f& r : mirrored.vertices) r.x = -r.x;  // the diagonals of its faces run the other way
  turn_over(mirrored);
  return {
      {"a face", {box_mesh({-8, -4, 2}, {0, 4, 10}), box_mesh({0, -4, 2}, {8, 4, 10})}, 1024},
      {"a face that is cut otherwise", {box_mesh({-8, -4, 2}, {0, 4, 10}), mirrored}, 1024},
      {"half a face", {box_mesh({-8, -4, 2}, {0, 4, 10}), box_mesh({0, -4, 2}, {8, 4, 6})}, 768},
      {"the middle of a face",
       {box_mesh({-8, -4, 2}, {0, 4, 10}), box_mesh({0, -2, 4}, {8, 2, 8})},
       640},
      {"two faces of a corner",
       {box_mesh({-8, -8, 2}, {0, 0, 10}), box_mesh({0, -8, 2}, {8, 0, 10}),
        box_mesh({-8, 0, 2}, {0, 8, 10})},
       1536},
      {"an edge", {box_mesh({-8, -8, 2}, {0, 0, 10}), box_mesh({0, 0, 2}, {8, 8, 10})}, 1024}};
}

TEST(MeshShape, BodiesThatTouchAreOneBody) {
  for (const TouchingBoxes& touching : touching_boxes()) {
    TriMesh mesh;
    for (const TriMesh& box : touching.boxes) mesh = together(mesh, box);
    for (const TriMesh& file : {mesh, as_soup(mesh), welded(mesh), as_soup(welded(mesh))}) {
      ASSERT_EQ(mesh_fault(domain, welded(file)).value_or("none"), "none") << touching.what;
      EXPECT_EQ(separate_parts(welded(file)).size(), touching.boxes.size()) << touching.what;
      const auto body = std::make_shared<const TriMesh>(file);
      // All planes lie on nodes: what is dilated there is the same for each.
      const std::vector<Shape> added{WaferShape{}, MeshShape{.mesh = body, .material = 1}};
      EXPECT_NEAR(volume_above_zero(added), touching.volume, 12) << touching.what;
      TriMesh buried = file;
      for (Vec3f& r : buried.vertices) r.z -= 20;
      const auto cut = std::make_shared<const TriMesh>(buried);
      EXPECT_NEAR(volume_above_zero({WaferShape{}, MeshShape{.mesh = cut}}), -touching.volume, 12)
          << touching.what;
    }
  }
}

std::vector<std::string> idle(const std::vector<Shape>& shapes, const Frame& frame = domain) {
  std::vector<std::string> messages;
  for (const ShapeProblem& each : idle_bodies(frame, shapes)) messages.push_back(each.message);
  return messages;
}

TEST(MeshShape, ABodyThatAddsNothingIsNamed) {
  const auto body = [](Vec3f lower, Vec3f upper) {
    return std::make_shared<const TriMesh>(box_mesh(lower, upper));
  };
  const auto add = [&](Vec3f lower, Vec3f upper) {
    return Shape{MeshShape{.mesh = body(lower, upper), .material = 1}};
  };
  const auto cut = [&](Vec3f lower, Vec3f upper) {
    return Shape{MeshShape{.mesh = body(lower, upper)}};
  };
  const Shape wafer = WaferShape{};
  const Vec3f low{-4, -4, -8};
  EXPECT_THAT(
      idle({wafer, add(low, {4, 4, 0})}),
      testing::ElementsAre(HasSubstr("the body around (0, 0, -4) nm lies wholly in solid")));
  EXPECT_THAT(idle({wafer, add(low, {4, 4, 0.5F})}), testing::IsEmpty());
  // After a cut of the same it does add something, and in a trench that it fills.
  EXPECT_THAT(idle({wafer, cut(low, {4, 4, 0}), add(low, {4, 4, 0})}), testing::IsEmpty());
  EXPECT_THAT(idle({wafer, cut({-4, -4, -7}, {4, 4, -1}), add(low, {4, 4, 0})}),
              testing::IsEmpty());
  // Two bodies of a file, one of them idle; beyond a periodic side there is the same solid.
  const TriMesh two = together(box_mesh(low, {4, 4, -1}), box_mesh({8, 8, -1}, {12, 12, 6}));
  EXPECT_THAT(idle({wafer, MeshShape{.mesh = std::make_shared<const TriMesh>(two), .material = 1}}),
              testing::ElementsAre(HasSubstr("the body around (0, 0, -4.5) nm")));
  Frame periodic = domain;
  periodic.boundary = {Boundary::periodic, Boundary::periodic};
  EXPECT_THAT(
      idle({wafer, cut({-20, -4, -8}, {-16, 4, 0}), add({18, -4, -8}, {24, 4, 0})}, periodic),
      testing::IsEmpty());
  EXPECT_THAT(idle({wafer, cut({-20, -4, -8}, {-16, 4, 0}), add({18, -4, -8}, {24, 4, 0})}),
              testing::SizeIs(1));
  EXPECT_THAT(idle({wafer, cut({-4, -4, 2}, {4, 4, 6})}),
              testing::ElementsAre(HasSubstr("wholly in the open and cuts nothing")));
  EXPECT_THAT(idle({wafer, add({-2, -2, 0}, {2, 2, 4}), cut({-4, -4, 0}, {4, 4, 6})}),
              testing::IsEmpty());
}

TEST(MeshShape, APatchIsFilledBelowOrCutAbove) {
  const auto wave = [](float x, float y) { return 3 * std::cos(x / 6) * std::cos(y / 7); };
  const auto surface = std::make_shared<const TriMesh>(
      patch(22, 60, [&](float x, float y) { return 6.0F + wave(x, y); }));
  const auto dish = std::make_shared<const TriMesh>(
      patch(22, 60, [&](float x, float y) { return -6.0F + wave(x, y); }));
  const double mean = 3 * (6 * std::sin(20 / 6.0) / 20) * (7 * std::sin(20 / 7.0) / 20);
  EXPECT_NEAR(volume_above_zero({WaferShape{}, MeshShape{.mesh = surface, .material = 1}}),
              1600 * (6 + mean), 10);
  EXPECT_NEAR(volume_above_zero({WaferShape{}, MeshShape{.mesh = dish}}), 1600 * (-6 + mean), 10);
}

}  // namespace
}  // namespace scarp
