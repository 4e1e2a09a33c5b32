#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>

#include "mesh/files/region_file.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

bool is_installed(const std::string& program) {
  return std::system(("command -v " + program + " > /dev/null 2>&1").c_str()) == 0;
}

/// What is in a file of write_msh besides its elements.
struct MshNames {
  std::map<std::string, int> volumes;
  std::map<std::string, int> surfaces;
};

MshNames names_of(const std::string& file) {
  std::ifstream in(file);
  std::string word;
  while (in >> word && word != "$PhysicalNames") {
  }
  int count = 0;
  in >> count;
  MshNames names;
  for (int n = 0; n < count; ++n) {
    int dimension = 0;
    int number = 0;
    in >> dimension >> number >> word;
    (dimension == 3 ? names.volumes : names.surfaces)[word.substr(1, word.size() - 2)] = number;
  }
  return names;
}

double volume(const ReadTets& read, const BodyTet& tet) {
  const Vec3d a = read.vertices[tet.corners[0]];
  return std::abs(
             dot(read.vertices[tet.corners[1]] - a,
                 cross(read.vertices[tet.corners[2]] - a, read.vertices[tet.corners[3]] - a))) /
         6;
}

class RegionVolume : public Program {
 protected:
  void run(const std::string& arguments) const {
    const Outcome run = scarp("run " + arguments + " -o " + path("run") + " --quiet");
    ASSERT_EQ(run.exit_code, 0) << run.messages;
  }

  Outcome volume_of(const std::string& file, const std::string& more = "") const {
    return scarp("volume " + path("run") + " -o " + path(file) + " --json " + more);
  }

  int shell(const std::string& line) const {
    return std::system((line + " > " + path("printed.txt") + " 2>&1").c_str());
  }

  void expect_volumes(const std::map<std::string, double>& volumes, double bottom, double area,
                      const std::string& wafer = "Si") const {
    const nlohmann::json wanted = summary("run")["metrology"]["volumes_nm3"];
    EXPECT_EQ(volumes.size(), wanted.size());
    for (const auto& [name, value] : wanted.items()) {
      const double whole = value.get<double>() - (name == wafer ? bottom * area : 0);
      ASSERT_TRUE(volumes.contains(name)) << name;
      EXPECT_NEAR(volumes.at(name), whole, 0.01 * whole) << name;
    }
  }
};

class LinedTrench : public RegionVolume {
 protected:
  void SetUp() override {
    write("trench.toml", lined_trench);
    run(path("trench.toml"));
  }
};

TEST_F(LinedTrench, InterfacesAndRegionsHaveNames) {
  const Outcome outcome = volume_of("device.msh", "--gas");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
  const MshNames names = names_of(path("device.msh"));
  EXPECT_EQ(names.volumes, (std::map<std::string, int>{{"Si", 1}, {"SiO2", 2}, {"gas", 3}}));
  for (const char* name : {"Si_SiO2", "SiO2_gas", "Si_bottom", "Si_x_min", "SiO2_x_max",
                           "gas_y_min", "gas_y_max", "gas_top"})
    EXPECT_TRUE(names.surfaces.contains(name)) << name;
  const nlohmann::json json = json_of(outcome);
  EXPECT_EQ(json["regions"].size(), 3U);
  EXPECT_GE(json["least_altitude_nm"], 1.0);
  EXPECT_GE(json["least_relative_altitude"], 0.1);
  EXPECT_LE(json["max_distance_nm"], 1.0);
  EXPECT_TRUE(json["warnings"].empty());
  EXPECT_THAT(read_file(path("device.msh.opt")), HasSubstr("Physical Volume(\"SiO2\", 2) = {2};"));
}

TEST_F(LinedTrench, GmshAndTetgenGetTheSameSurface) {
  ASSERT_EQ(volume_of("device.msh").exit_code, 0);
  ASSERT_EQ(volume_of("device.smesh").exit_code, 0);
  const auto json = json_of(volume_of("device.vtu"));
  std::ifstream smesh(path("device.smesh"));
  std::string line;
  while (std::getline(smesh, line) && line[0] == '#') {
  }
  const std::size_t nodes = std::stoul(line);
  EXPECT_EQ(nodes, json["vertices"]);
  const std::string msh = read_file(path("device.msh"));
  for (std::size_t n = 0; n < nodes; ++n) {
    std::getline(smesh, line);
    EXPECT_THAT(msh, HasSubstr('\n' + line.substr(line.find(' ') + 1) + '\n'));
  }
  std::getline(smesh, line);
  EXPECT_EQ(std::stoul(line), json["facets"]);
}

TEST_F(LinedTrench, WithoutAProgramTheRemedyIsNamed) {
  const int code = shell("PATH=/nowhere " + std::string(SCARP_BINARY) + " volume " + path("run") +
                         " --tetrahedra -o " + path("device.msh"));
  EXPECT_EQ(WEXITSTATUS(code), 2);
  EXPECT_THAT(read_file(path("printed.txt")),
              HasSubstr("neither tetgen nor gmsh is installed; install one, for example by "
                        "\"apt-get install tetgen\""));
  EXPECT_FALSE(std::filesystem::exists(path("device.msh")));
}

// By an interrupt that only scarp gets, as from a queue of jobs.
TEST_F(LinedTrench, AnInterruptEndsTheProgramThatFillsAndLeavesNothing) {
  std::filesystem::create_directory(path("bin"));
  std::filesystem::create_directory(path("temporary"));
  write("bin/tetgen", "#!/bin/sh\necho $$ >" + path("pid.part") + "; mv " + path("pid.part") + ' ' +
                          path("pid") + "\nexec sleep 300\n");
  std::filesystem::permissions(path("bin/tetgen"), std::filesystem::perms::owner_all);
  write("interrupted.sh",
        "TMPDIR=" + path("temporary") + " PATH=" + path("bin") + ":$PATH " + SCARP_BINARY +
            " volume " + path("run") + " --tetrahedra -o " + path("device.msh") + " &\n" +
            "while [ ! -s " + path("pid") + " ]; do sleep 0.02; done\n" +
            "kill -TERM $!; wait $!; echo ended by $(($? - 128))\n" + "kill -0 $(cat " +
            path("pid") + ") && echo left alone\nls " + path("temporary") + '\n');
  shell("timeout 60 sh " + path("interrupted.sh"));
  EXPECT_THAT(read_file(path("printed.txt")), HasSubstr("ended by 15\n"));
  EXPECT_THAT(read_file(path("printed.txt")), Not(HasSubstr("left alone")));
  EXPECT_TRUE(std::filesystem::is_empty(path("temporary")));
  EXPECT_FALSE(std::filesystem::exists(path("device.msh")));
}

TEST_F(LinedTrench, OtherEndingsAreRefusedWithAllThatAreKnown) {
  const Outcome outcome = volume_of("device.step");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.messages,
              HasSubstr("device.step: the ending does not name a mesh format; use .obj, .ply, .stl "
                        "or .vtp for a file of each material, or .msh, .smesh or .vtu"));
}

TEST_F(LinedTrench, EitherProgramFillsTheRegions) {
  for (const std::string program : {"tetgen", "gmsh"}) {
    SCOPED_TRACE(program);
    if (!is_installed(program)) GTEST_SKIP() << "no " << program << ": apt-get install " << program;
    std::filesystem::remove_all(path("bin"));
    std::filesystem::create_directory(path("bin"));
    ASSERT_EQ(shell("ln -s $(command -v " + program + ") " + path("bin/" + program)), 0);
    ASSERT_EQ(shell("PATH=" + path("bin") + " " + SCARP_BINARY + " volume " + path("run") +
                    " --tetrahedra --bottom '-500 nm' --json -o " + path("device.msh")),
              0)
        << read_file(path("printed.txt"));
    const ReadTets read = read_gmsh_tets(path("device.msh"));
    EXPECT_EQ(read.tets.size(),
              nlohmann::json::parse(read_file(path("printed.txt")))["tetrahedra"]);
    std::map<std::string, double> volumes;
    for (const BodyTet& tet : read.tets)
      volumes[tet.body == 0 ? "Si" : "SiO2"] += volume(read, tet);
    expect_volumes(volumes, -500, 400 * 100);
    EXPECT_FALSE(std::filesystem::exists(path("device.msh.opt")));
  }
}

TEST_F(LinedTrench, WhatCannotBeIsRefusedWithTheRemedy) {
  const Outcome gas = volume_of("device.stl", "--gas");
  EXPECT_EQ(gas.exit_code, 2);
  EXPECT_THAT(gas.messages, HasSubstr("--gas: only meshes of all materials in one have it; write"));
  const Outcome filled = volume_of("device.smesh", "--tetrahedra");
  EXPECT_EQ(filled.exit_code, 2);
  EXPECT_THAT(filled.messages, HasSubstr("a .smesh file holds surfaces; write .msh or .vtu"));
  const Outcome small = volume_of("device.msh", "--size '1 nm'");
  EXPECT_EQ(small.exit_code, 2);
  EXPECT_THAT(small.messages, HasSubstr("--size: 1 nm is less than the spacing of 10 nm"));
  const Outcome bottom = volume_of("device.msh", "--bottom '-200 nm'");
  EXPECT_EQ(bottom.exit_code, 2);
  EXPECT_THAT(bottom.messages, HasSubstr("--bottom: the bottom at -200 nm is not a spacing below"));
  const Outcome top = volume_of("device.msh", "--gas --top '30 nm'");
  EXPECT_EQ(top.exit_code, 2);
  EXPECT_THAT(top.messages, HasSubstr("--top: the lid at 30 nm is not a spacing above"));
}

TEST_F(RegionVolume, ASectionIsFlatAndRefusesTetrahedra) {
  write("trench.toml", lined_trench);
  run(path("trench.toml") + " --set domain.mode='\"2d\"' --set domain.extent='[\"400 nm\"]'");
  const Outcome outcome = volume_of("device.msh", "--bottom '-500 nm'");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
  const nlohmann::json regions = json_of(outcome)["regions"];
  ASSERT_EQ(regions.size(), 2U);
  EXPECT_NEAR(regions[0]["area_nm2"], 400 * 500 - 200 * 300, 0.005 * 140000);
  const double film = 200 * 25 + 2 * 300 * 25 + 150 * 25 + 2 * (3.14159265 / 4) * 25 * 25;
  EXPECT_NEAR(regions[1]["area_nm2"], film, 0.01 * film);
  EXPECT_FALSE(std::filesystem::exists(path("device.msh.opt")));
  if (is_installed("gmsh")) {
    EXPECT_EQ(shell("gmsh -2 " + path("device.msh") + " -o " + path("again.msh")), 0);
    EXPECT_THAT(read_file(path("printed.txt")), Not(HasSubstr("Error")));
  }
  for (const char* refused : {"device.smesh", "device.msh --tetrahedra"}) {
    const Outcome no = volume_of(refused);
    EXPECT_EQ(no.exit_code, 2);
    EXPECT_THAT(no.messages, HasSubstr("run with domain.mode = \"3d\""));
  }
}

TEST_F(RegionVolume, ASectionAroundAnAxisIsFlatOrRevolved) {
  write("hole.toml", R"(
[domain]
mode = "axisymmetric"
spacing = "10 nm"
extent = ["300 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "hole"
radius = "80 nm"
depth = "100 nm"
[[step]]
model = "conformal"
material = "SiO2"
thickness = "25 nm"
)");
  run(path("hole.toml"));
  const double hole = 3.14159265 * 80 * 80 * 100;
  const double disc = 3.14159265 * 150 * 150 * 200;
  const nlohmann::json flat = json_of(volume_of("device.msh", "--bottom '-200 nm'"));
  EXPECT_NEAR(flat["regions"][0]["volume_nm3"], disc - hole, 0.01 * hole);
  const nlohmann::json revolved = json_of(volume_of("device.smesh", "--bottom '-200 nm'"));
  EXPECT_NEAR(revolved["regions"][0]["volume_nm3"], 300 * 300 * 200 - hole, 0.01 * hole);
}

/// A tapered plug of W in a liner of TiN, at 10 nm spacing.
std::string plug(const char* radius, const char* liner) {
  return fmt::format(R"(
[domain]
mode = "axisymmetric"
spacing = "10 nm"
extent = ["400 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "layer"
material = "SiO2"
thickness = "200 nm"
[[geometry]]
shape = "hole"
radius = "{}"
depth = "200 nm"
taper = "6 deg"
[[step]]
model = "conformal"
material = "TiN"
thickness = "{}"
[[step]]
model = "fill"
material = "W"
height = "180 nm"
[[step]]
model = "planarise"
stop_material = "SiO2"
)",
                     radius, liner);
}

TEST_F(RegionVolume, ADifferenceOfVolumesIsPutDownToWhatItIs) {
  const auto warnings = [&](const char* radius, const char* liner) {
    write("via.toml", plug(radius, liner));
    run(path("via.toml"));
    const Outcome outcome = volume_of("device.msh");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.messages;
    return json_of(outcome)["warnings"].get<std::vector<std::string>>();
  };
  EXPECT_THAT(warnings("100 nm", "25 nm"), IsEmpty());
  // The needle of W has a little too much: the mesh is coarse.
  EXPECT_THAT(warnings("48 nm", "25 nm"),
              ElementsAre(AllOf(HasSubstr("W has "), HasSubstr("the mesh keeps within "),
                                HasSubstr(" nm of the run's interfaces; run with a smaller"))));
  // A liner thinner than a spacing is too little.
  EXPECT_THAT(warnings("100 nm", "6 nm"),
              ElementsAre(AllOf(HasSubstr("TiN has "), HasSubstr("the mesh keeps within "),
                                HasSubstr(", and leaves out films thinner than 1 nm; run with"))));
}

struct MeshedConfig {
  const char* name;
  const char* arguments;
  double spacing;  // nm
  double bottom;   // nm
  double area;     // nm^2
};

class MeshedConfigs : public RegionVolume, public ::testing::WithParamInterface<MeshedConfig> {};
INSTANTIATE_TEST_SUITE_P(
    Configs, MeshedConfigs,
    ::testing::Values(
        MeshedConfig{"trench_deposition",
                     "--set domain.spacing='\"0.4 um\"' --set domain.extent='[\"10 um\", \"2 "
                     "um\"]' --set flux.target_error=0.1",
                     400, -12000, 1e4 * 2e3},
        MeshedConfig{"hole_directional_etch", "--set domain.spacing='\"20 nm\"'", 20, -400,
                     600 * 600},
        MeshedConfig{"trench_isolation", "--set domain.spacing='\"20 nm\"'", 20, -700, 600 * 100},
        MeshedConfig{"dual_damascene", "--set domain.spacing='\"10 nm\"'", 10, -100, 320 * 160},
        MeshedConfig{"sadp_cut", "--set domain.spacing='\"10 nm\"'", 10, -100, 320 * 240}),
    [](const auto& test) { return std::string(test.param.name); });

TEST_P(MeshedConfigs, GmshAndTetgenFillThem) {
  if (!is_installed("gmsh") || !is_installed("tetgen"))
    GTEST_SKIP() << "no gmsh or no tetgen: apt-get install gmsh tetgen";
  const MeshedConfig config = GetParam();
  run(std::string(SCARP_SOURCE_DIR) + "/configs/" + config.name + ".toml " + config.arguments);
  const std::string bottom = " --bottom '" + std::to_string(config.bottom) + " nm'";
  for (const char* file : {"device.msh", "device.smesh"}) {
    const Outcome outcome = volume_of(file, bottom);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
    EXPECT_EQ(outcome.messages, "");
  }
  std::vector<std::string> bodies;  // names of regions, in the order of the bodies
  const nlohmann::json json = json_of(volume_of("device.msh", bottom));
  for (const auto& region : json["regions"]) bodies.push_back(region["name"]);
  EXPECT_GE(json["least_relative_altitude"], 0.1);
  EXPECT_LE(json["max_distance_nm"], 0.55 * config.spacing);
  EXPECT_LE(json["max_plain_distance_nm"], 0.1 * config.spacing);

  ASSERT_EQ(shell("gmsh -3 " + path("device.msh") + " -o " + path("filled.msh")), 0);
  EXPECT_THAT(read_file(path("printed.txt")), Not(HasSubstr("Error")));
  const ReadTets by_gmsh = read_gmsh_tets(path("filled.msh"));
  std::map<int, double> of_bodies;
  for (const BodyTet& tet : by_gmsh.tets) of_bodies[tet.body] += volume(by_gmsh, tet);
  double sum = 0;
  for (const auto& [body, value] : of_bodies) sum += value;

  ASSERT_EQ(shell("tetgen -pA " + path("device.smesh")), 0);
  EXPECT_THAT(read_file(path("printed.txt")), Not(HasSubstr("rror")));
  const ReadTets by_tetgen = read_tetgen_tets(path("device.1"));
  std::map<std::string, double> volumes;
  for (const BodyTet& tet : by_tetgen.tets)
    volumes[bodies.at(static_cast<std::size_t>(tet.body))] += volume(by_tetgen, tet);
  expect_volumes(volumes, config.bottom, config.area, bodies.front());
  double sum_of_tetgen = 0;
  for (const auto& [name, value] : volumes) sum_of_tetgen += value;
  // tetgen takes facets at 0.1 degrees for one plane.
  EXPECT_NEAR(sum, sum_of_tetgen, 1e-4 * sum);
  // Each material of these is in one piece.
  if (of_bodies.size() != volumes.size()) return;
  for (const auto& region : volumes) {
    const bool is_there = std::ranges::any_of(of_bodies, [&](const auto& body) {
      return std::abs(body.second - region.second) < 1e-3 * region.second;
    });
    EXPECT_TRUE(is_there) << region.first;
  }
}

}  // namespace
}  // namespace scarp
