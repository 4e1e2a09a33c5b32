#include "mesh/surface_fault.h"

#include <gtest/gtest.h>

#include <limits>
#include <utility>

namespace scarp {
namespace {

// A square of 2 with a roof over it, open at the sides.
constexpr Sides sides{.lower = {-1, -1}, .upper = {1, 1}};

TriMesh tent() {
  return {.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {0, 0, 1}},
          .triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}},
          .materials = {}};
}

std::string fault_of(const TriMesh& mesh, const Sides& of = sides) {
  const auto fault = surface_fault(mesh, of);
  return fault ? fault->text : "none";
}

TEST(SurfaceFault, ThereIsNoneWhereAMeshEndsOnTheSides) { EXPECT_EQ(fault_of(tent()), "none"); }

TEST(SurfaceFault, EdgesAreOpenOffTheSides) {
  EXPECT_EQ(fault_of(tent(), {.lower = {-1, -1}, .upper = {1, 2}}),
            "the facets of an edge do not close the surface");
}

TEST(SurfaceFault, AHoleIsFoundWithItsPlace) {
  TriMesh mesh = tent();
  mesh.triangles.pop_back();
  const auto fault = surface_fault(mesh, sides);
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->text, "the facets of an edge do not close the surface");
  EXPECT_EQ(fault->r.x, -0.5);
  EXPECT_EQ(fault->r.z, 0.5);
}

TEST(SurfaceFault, FacetsHaveToAgreeAboutTheOutside) {
  TriMesh mesh = tent();
  std::swap(mesh.triangles[2][0], mesh.triangles[2][1]);
  EXPECT_EQ(fault_of(mesh), "the facets of an edge do not close the surface");
}

TEST(SurfaceFault, FacetsHaveAnArea) {
  TriMesh mesh = tent();
  mesh.vertices[4] = {0, -1, 0};
  EXPECT_EQ(fault_of(mesh), "a facet has no area");
  mesh.vertices[4] = {0, -0.999F, 0};
  EXPECT_EQ(fault_of(mesh), "none");
}

TEST(SurfaceFault, VerticesAreFinite) {
  TriMesh mesh = tent();
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
    mesh.vertices[4].y = bad;
    EXPECT_EQ(fault_of(mesh), "a vertex is not finite");
  }
}

}  // namespace
}  // namespace scarp
