#include "mesh/files/region_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/system/atomic_file.h"
#include "core/system/read_file.h"
#include "core/system/temporary_folder.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;

constexpr int nothing = RegionMesh::nothing;

/// A tetrahedron on each side of a triangle.
RegionMesh two_tetrahedra() {
  RegionMesh mesh;
  mesh.lower = {0, 0, -1};
  mesh.upper = {1, 1, 1};
  mesh.regions = {{.name = "Si"},
                  {.name = "SiO2"},
                  {.kind = MeshRegion::Kind::gas, .name = "gas", .is_meshed = false}};
  mesh.bodies = {{0}, {1}, {2}};
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.1, 0.1, -1}, {0.1, 0.1, 1}};
  const auto add = [&](const Triangle& corners, std::array<int, 2> bodies) {
    mesh.facets.push_back({.corners = corners, .bodies = bodies});
  };
  add({0, 1, 2}, {0, 1});
  for (const Triangle t : {Triangle{0, 2, 3}, Triangle{2, 1, 3}, Triangle{1, 0, 3}})
    add(t, {0, nothing});
  mesh.facets[1].side = 0;
  mesh.facets[2].side = 4;
  mesh.facets[3].side = 2;
  for (const Triangle t : {Triangle{2, 0, 4}, Triangle{1, 2, 4}, Triangle{0, 1, 4}}) add(t, {1, 2});
  return mesh;
}

const std::vector<BodyTet> tets{{.corners = {3, 0, 1, 2}, .body = 0},
                                {.corners = {0, 1, 2, 4}, .body = 1}};

class RegionFile : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
};

TEST_F(RegionFile, GroupsAreNamedAfterWhatTheyAreBetween) {
  const NamedMesh named = named_mesh(two_tetrahedra());
  std::vector<std::string> names;
  for (const ElementGroup& group : named.groups) names.push_back(group.name);
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("Si_SiO2", "Si_x_min", "Si_bottom", "Si_y_min",
                                                     "SiO2_gas"));
  EXPECT_FALSE(named.is_filled());
}

// Its facets fill the regions, and its interfaces are lines.
TEST_F(RegionFile, AFlatMeshHasLinesBetweenItsRegions) {
  RegionMesh mesh;
  mesh.is_flat = true;
  mesh.regions = {{.name = "Si"}, {.name = "SiO2"}};
  mesh.bodies = {{0}, {1}};
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}};
  mesh.facets = {{.corners = {0, 1, 2}, .bodies = {0, nothing}, .layer = 0},
                 {.corners = {0, 2, 3}, .bodies = {1, nothing}, .layer = 1}};
  const NamedMesh named = named_mesh(mesh);
  std::map<std::string, int> dimensions;
  std::map<std::string, std::size_t> corners;
  for (const ElementGroup& group : named.groups) {
    dimensions[group.name] = group.dimension;
    corners[group.name] = group.corners.size();
  }
  EXPECT_EQ(dimensions["Si"], 2);
  EXPECT_EQ(dimensions["SiO2"], 2);
  EXPECT_EQ(dimensions["Si_SiO2"], 1);
  EXPECT_EQ(corners["Si_SiO2"], 2U);
}

TEST_F(RegionFile, AFilledMeshComesBack) {
  const RegionMesh mesh = two_tetrahedra();
  const NamedMesh filled = filled_mesh(mesh, mesh.vertices, tets);
  EXPECT_TRUE(filled.is_filled());
  write_msh(folder_ / "filled.msh", filled);
  const ReadTets read = read_gmsh_tets(folder_ / "filled.msh");
  EXPECT_EQ(read.vertices, mesh.vertices);
  ASSERT_EQ(read.tets.size(), 2U);
  EXPECT_EQ(read.tets[0].corners, tets[0].corners);
  EXPECT_EQ(read.tets[1].body, 1);
}

TEST_F(RegionFile, ClosedSurfacesHaveTheirVolumesBesideThem) {
  write_msh(folder_ / "device.msh", named_mesh(two_tetrahedra()));
  const std::string msh = read_file(folder_ / "device.msh");
  EXPECT_THAT(msh, HasSubstr("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"));
  EXPECT_THAT(msh, HasSubstr("3 1 \"Si\"\n3 2 \"SiO2\"\n"));
  EXPECT_THAT(msh, HasSubstr("\n0 0 5 0\n"));
  const std::string volumes = read_file(folder_ / "device.msh.opt");
  EXPECT_THAT(volumes, HasSubstr("Surface Loop(2) = {-"));
  EXPECT_THAT(volumes, HasSubstr("Physical Volume(\"Si\", 1) = {1};"));
  EXPECT_THROW(read_gmsh_tets(folder_ / "device.msh"), InputError);
}

TEST_F(RegionFile, TetgenGetsAPointInEachRegion) {
  write_smesh(folder_ / "device.smesh", two_tetrahedra());
  const std::string smesh = read_file(folder_ / "device.smesh");
  EXPECT_THAT(smesh, HasSubstr("# region 1: Si\n# region 2: SiO2\n"));
  EXPECT_THAT(smesh, HasSubstr("\n5 3 0 0\n1 0 0 0\n2 1 0 0\n"));
  EXPECT_THAT(smesh, HasSubstr("\n7 1\n3 "));
  const std::string end = smesh.substr(smesh.rfind("\n0\n"));  // no holes
  EXPECT_THAT(end, ::testing::MatchesRegex("\n0\n2\n1 [^\n]* 1 -1\n2 [^\n]* 2 -1\n"));
}

TEST_F(RegionFile, WhatTetgenLeavesIsRead) {
  write_file(folder_ / "a.node", "5 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 -1\n5 0 0 1\n");
  write_file(folder_ / "a.ele", "2 4 1\n1 1 2 3 4 1\n2 1 2 3 5 2\n");
  const ReadTets read = read_tetgen_tets(folder_ / "a");
  EXPECT_EQ(read.vertices.size(), 5U);
  ASSERT_EQ(read.tets.size(), 2U);
  EXPECT_EQ(read.tets[1].corners, (std::array<std::uint32_t, 4>{0, 1, 2, 4}));
  EXPECT_EQ(read.tets[1].body, 1);
  write_file(folder_ / "a.ele", "1 4 1\n1 1 2 3 9 1\n");
  EXPECT_THROW(read_tetgen_tets(folder_ / "a"), InputError);
  write_file(folder_ / "a.ele", "1 4 0\n1 1 2 3 4\n");
  EXPECT_THROW(read_tetgen_tets(folder_ / "a"), InputError);
}

TEST_F(RegionFile, AnUnstructuredGridNamesItsRegions) {
  const RegionMesh mesh = two_tetrahedra();
  write_vtu(folder_ / "surface.vtu", named_mesh(mesh));
  const std::string surface = read_file(folder_ / "surface.vtu");
  EXPECT_THAT(surface, HasSubstr("NumberOfPoints=\"5\" NumberOfCells=\"7\""));
  EXPECT_THAT(surface, HasSubstr("Name=\"region_in_front\""));
  EXPECT_THAT(surface,
              HasSubstr("Name=\"region_names\" NumberOfTuples=\"3\" format=\"ascii\"> 83 105 0 "));
  write_vtu(folder_ / "filled.vtu", filled_mesh(mesh, mesh.vertices, tets));
  const std::string filled = read_file(folder_ / "filled.vtu");
  EXPECT_THAT(filled, HasSubstr("NumberOfPoints=\"5\" NumberOfCells=\"2\""));
  EXPECT_THAT(filled, HasSubstr("Name=\"region\""));
}

}  // namespace
}  // namespace scarp
