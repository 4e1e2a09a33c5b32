#include "levelset/mesh_solid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "levelset/cross_section.h"
#include "levelset/extract_surface.h"
#include "levelset/shapes.h"

namespace scarp {
namespace {

using testing::HasSubstr;

const Frame frame{.spacing = 1, .cells = {40, 40}};

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

TEST(MeshSolid, FaultsNameThePlace) {
  const auto fault = [](TriMesh mesh) { return mesh_fault(frame, welded(mesh)).value_or("none"); };
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
  EXPECT_THAT(fault({}), HasSubstr("no triangle"));
}

double volume_above_zero(const std::vector<Shape>& shapes) {
  double volume = 0;
  for (const double v : material_volumes(build_layers(frame, shapes))) volume += v;
  return volume;
}

TEST(MeshShape, ABodyIsAddedOrCutOut) {
  const auto body =
      std::make_shared<const TriMesh>(box_mesh({-6.2F, -7.3F, -5.4F}, {6.2F, 7.3F, 8.6F}));
  EXPECT_NEAR(volume_above_zero({WaferShape{}, MeshShape{.mesh = body, .material = 1}}),
              12.4 * 14.6 * 8.6, 20);
  EXPECT_NEAR(volume_above_zero({WaferShape{}, MeshShape{.mesh = body}}), -12.4 * 14.6 * 5.4, 20);
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
