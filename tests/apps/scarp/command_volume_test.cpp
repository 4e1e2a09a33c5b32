#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "mesh/files/mesh_file.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;

class VolumeCommand : public Program {
 protected:
  void SetUp() override {
    write("trench.toml", lined_trench);
    const Outcome run = scarp("run " + path("trench.toml") + " -o " + path("run") + " --quiet");
    ASSERT_EQ(run.exit_code, 0) << run.messages;
  }

  Outcome volume(const std::string& more) const {
    return scarp("volume " + path("run") + " --bottom '-500 nm' --json -o " + more);
  }

  /// What the script prints, with the interpreter for which VTK or ParaView is packaged.
  std::string python(const std::string& script) const {
    write("script.py", script);
    const std::string line =
        "/usr/bin/python3 " + path("script.py") + " > " + path("printed.txt") + " 2>&1";
    static_cast<void>(std::system(line.c_str()));
    return read_file(path("printed.txt"));
  }

  bool has_module(const std::string& name) const {
    return python("import " + name + "\nprint('is there')") == "is there\n";
  }
};

// The film: around a trench of 200 nm by 300 nm, with quarter circles at its two upper edges.
constexpr double film_volume =
    100 * (200 * 25 + 2 * 300 * 25 + 150 * 25 + 2 * (3.14159265 / 4) * 25 * 25);
constexpr double silicon_volume = 100 * (400 * 500 - 200 * 300);

TEST_F(VolumeCommand, EachMaterialIsASolid) {
  const Outcome outcome = volume(path("wafer.stl"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
  const nlohmann::json bodies = json_of(outcome)["bodies"];
  ASSERT_EQ(bodies.size(), 2U);
  EXPECT_EQ(bodies[0]["material"], "Si");
  EXPECT_NEAR(bodies[0]["volume_nm3"], silicon_volume, 0.005 * silicon_volume);
  EXPECT_EQ(bodies[1]["file"], path("wafer_SiO2.stl"));
  EXPECT_NEAR(bodies[1]["volume_nm3"], film_volume, 0.005 * film_volume);
  EXPECT_EQ(read_mesh(path("wafer_SiO2.stl")).triangles.size(), bodies[1]["facets"]);
}

TEST_F(VolumeCommand, ABottomInTheTrenchIsRefused) {
  const Outcome outcome = scarp("volume " + path("run") + " --bottom '-200 nm'");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.messages, HasSubstr("--bottom: the bottom at -200 nm is not below"));
  EXPECT_EQ(volume(path("wafer.txt")).exit_code, 2);
}

// As a device or stress simulator would read it.
TEST_F(VolumeCommand, VtkReadsClosedSurfacesOfTheRightVolume) {
  if (!has_module("vtkmodules.vtkIOXML")) GTEST_SKIP() << "no VTK for Python (python3-vtk9)";
  for (const char* ending : {"stl", "obj", "vtp"})
    ASSERT_EQ(volume(path(std::string("wafer.") + ending)).exit_code, 0);
  const std::string printed = python(R"(
import sys
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader
from vtkmodules.vtkIOGeometry import vtkSTLReader, vtkOBJReader
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkFiltersCore import vtkMassProperties, vtkFeatureEdges, vtkTriangleFilter
readers = (('stl', vtkSTLReader()), ('obj', vtkOBJReader()),
           ('vtp', vtkXMLPolyDataReader()))
for ending, reader in readers:
    reader.SetFileName(')" + path("wafer_SiO2.") +
                                     R"(' + ending)
    surface = vtkGeometryFilter()
    surface.SetInputConnection(reader.GetOutputPort())
    edges = vtkFeatureEdges()
    edges.SetInputConnection(surface.GetOutputPort())
    edges.FeatureEdgesOff()
    edges.Update()
    mass = vtkMassProperties()
    mass.SetInputConnection(surface.GetOutputPort())
    mass.Update()
    print(ending, edges.GetOutput().GetNumberOfCells(), abs(mass.GetVolume() / )" +
                                     std::to_string(film_volume) + R"( - 1) < 0.005)
)");
  EXPECT_EQ(printed, "stl 0 True\nobj 0 True\nvtp 0 True\n");
}

TEST_F(VolumeCommand, VtkReadsRegionsOfOneMesh) {
  if (!has_module("vtkmodules.vtkIOXML")) GTEST_SKIP() << "no VTK for Python (python3-vtk9)";
  ASSERT_EQ(volume(path("device.vtu")).exit_code, 0);
  const std::string printed = python(R"(
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
reader = vtkXMLUnstructuredGridReader()
reader.SetFileName(')" + path("device.vtu") +
                                     R"(')
reader.Update()
grid = reader.GetOutput()
names = [grid.GetFieldData().GetAbstractArray('region_names').GetValue(n) for n in range(3)]
def sheet(behind, front):
    cells = grid.GetCellData()
    pairs = zip(*([int(cells.GetArray(a).GetValue(n)) for n in range(grid.GetNumberOfCells())]
                  for a in ('region_behind', 'region_in_front')))
    return sum(pair == (behind, front) for pair in pairs) > 0
print(names, sheet(0, 1), sheet(1, 2), sheet(1, -1), sheet(0, 2), sheet(2, -1))
)");
  EXPECT_EQ(printed, "['Si', 'SiO2', 'gas'] True True True False False\n");
}

TEST_F(VolumeCommand, ParaViewOpensTheSeriesOfARun) {
  if (!has_module("paraview.simple")) GTEST_SKIP() << "no ParaView for Python (python3-paraview)";
  const std::string printed = python(R"(
from paraview.simple import OpenDataFile
reader = OpenDataFile(')" + path("run/surface.pvd") +
                                     R"(')
reader.UpdatePipeline()
print(list(reader.TimestepValues), reader.CellData.GetNumberOfArrays() > 1)
)");
  EXPECT_THAT(printed, HasSubstr("[0.0, 1.0] True"));
}

TEST_F(VolumeCommand, OpenVdbToolsReadStates) {
  if (std::system("vdb_print -version > /dev/null 2>&1") != 0)
    GTEST_SKIP() << "no vdb_print (libopenvdb-tools)";
  const std::string line =
      "vdb_print -l " + path("run/state_0001.vdb") + " > " + path("printed.txt") + " 2>&1";
  EXPECT_EQ(std::system(line.c_str()), 0);
  const std::string printed = read_file(path("printed.txt"));
  EXPECT_THAT(printed, HasSubstr("Tree_float_5_4_3"));
  EXPECT_THAT(printed, HasSubstr("level set"));
}

}  // namespace
}  // namespace scarp
