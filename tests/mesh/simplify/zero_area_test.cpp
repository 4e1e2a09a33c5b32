#include "mesh/simplify/zero_area.h"

#include <gtest/gtest.h>

#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

std::size_t without_area(const TriMesh& mesh) {
  std::size_t count = 0;
  for (const double area : facet_areas(mesh)) count += area > 1e-7 ? 0 : 1;
  return count;
}

double total_area(const TriMesh& mesh) {
  double sum = 0;
  for (const double area : facet_areas(mesh)) sum += area;
  return sum;
}

/// Splits triangle f at a place on its first edge; the old edge and the new vertex make a facet
/// without area.
void add_facet_without_area(TriMesh& mesh, std::size_t f, float t) {
  const Triangle old = mesh.triangles[f];
  const auto v = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back((1 - t) * mesh.vertices[old[0]] + t * mesh.vertices[old[1]]);
  mesh.triangles[f] = {old[0], v, old[2]};
  mesh.triangles.push_back({v, old[1], old[2]});
  mesh.triangles.push_back({old[0], old[1], v});
}

TEST(ZeroArea, NeedlesAreCollapsedAndCapsTurned) {
  const TriMesh plane = noisy_plane(8, 0);
  for (const float t : {0.0F, 0.5F}) {
    TriMesh mesh = plane;
    add_facet_without_area(mesh, 50, t);
    ASSERT_GT(without_area(mesh), 0U);
    CollapseMesh work(mesh, {});
    remove_zero_area(work, 1e-3);
    const TriMesh result = work.extract();
    EXPECT_EQ(without_area(result), 0U) << "at " << t;
    EXPECT_NEAR(total_area(result), 64, 1e-4);
    for (const Vec3f& n : facet_normals(result)) EXPECT_GT(n.z, 0.99F);
    // The needle's vertex is gone, the cap's belongs to the neighbour now.
    EXPECT_EQ(result.vertices.size(), plane.vertices.size() + (t == 0 ? 0 : 1));
  }
}

TEST(ZeroArea, NothingMovesFurtherThanItMay) {
  TriMesh mesh = noisy_plane(8, 0);
  add_facet_without_area(mesh, 50, 1e-5F);
  CollapseMesh kept(mesh, {});
  EXPECT_EQ(remove_zero_area(kept, 1e-6), 0);
  EXPECT_EQ(kept.live_vertices, mesh.vertices.size());
  CollapseMesh work(mesh, {});
  EXPECT_NEAR(remove_zero_area(work, 1e-3), 1e-5, 1e-6);
  EXPECT_LT(work.live_vertices, mesh.vertices.size());
}

TEST(ZeroArea, NeedlesOnPeriodicSidesGoInPairs) {
  // An edge of hardly any length in the outline, on both sides.
  TriMesh mesh = noisy_plane(8, 0);
  const std::size_t facet_count = mesh.triangles.size();
  for (const float side : {0.0F, 8.0F}) {
    for (std::size_t f = 0; f < facet_count; ++f) {
      for (int i = 0; i < 3; ++i) {
        const Triangle t = mesh.triangles[f];
        const Vec3f a = mesh.vertices[t[i]];
        const Vec3f b = mesh.vertices[t[(i + 1) % 3]];
        if (a.x != side || b.x != side || std::min(a.y, b.y) != 3) continue;
        const auto v = static_cast<std::uint32_t>(mesh.vertices.size());
        mesh.vertices.push_back((a.y < b.y ? a : b) + Vec3f{0, 1e-6F, 0});
        const std::uint32_t low = a.y < b.y ? t[i] : t[(i + 1) % 3];
        const std::uint32_t tip = t[(i + 2) % 3];
        Triangle needle{low, v, tip};
        if (a.y > b.y) needle = {v, low, tip};
        for (std::uint32_t& w : mesh.triangles[f]) w = w == low ? v : w;
        mesh.triangles.push_back(needle);
      }
    }
  }
  ASSERT_EQ(mesh.triangles.size(), facet_count + 2);
  CollapseMesh work(
      mesh,
      {.lower = {0, 0}, .upper = {8, 8}, .boundary = {Boundary::periodic, Boundary::reflective}});
  remove_zero_area(work, 1e-3);
  const TriMesh result = work.extract();
  EXPECT_EQ(result.triangles.size(), facet_count);
  EXPECT_EQ(work.live_vertices, result.vertices.size());
  EXPECT_EQ(without_area(result), 0U);
  EXPECT_NEAR(total_area(result), 64, 1e-4);
}

TEST(ZeroArea, GoodMeshesStayAsTheyAre) {
  const TriMesh plane = noisy_plane(8, 0.05);
  CollapseMesh work(plane, {});
  remove_zero_area(work, 1e-3);
  EXPECT_EQ(work.extract().triangles, plane.triangles);
}

}  // namespace
}  // namespace scarp
