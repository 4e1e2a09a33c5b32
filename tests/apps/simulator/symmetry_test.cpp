// Recipes that run on the half, quarter or eighth of a wafer that is its own mirror image.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "mesh/files/mesh_file.h"
#include "mesh/half_edges.h"
#include "tests/apps/columns.h"
#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* hole = R"(
[domain]
spacing = "10 nm"
extent = ["260 nm", "220 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "resist"
thickness = "60 nm"
opening = { shape = "hole", radius = "45 nm" }
)";

// Undercuts the mask, then closes its opening: a void on both planes.
constexpr const char* prescribed = R"(
[[step]]
name = "etch"
model = "isotropic"
duration = "40 s"
etch_rate = { Si = "2 nm/s", resist = "0 nm/s" }
[step.until]
depth = "60 nm"
at = ["-12 nm", "-7 nm"]
[[step]]
name = "film"
model = "isotropic"
duration = "30 s"
material = "SiO2"
growth_rate = "2 nm/s"
[output]
every = "25 s"
)";

constexpr const char* deposition = R"(
[metrology]
masks = []
[[step]]
model = "single_particle"
duration = "10 s"
growth_rate = "2 nm/s"
material = "SiO2"
sticking = 0.3
[flux]
target_error = 0.02
)";

class SymmetricRun : public Program {
 protected:
  nlohmann::json run(const std::string& recipe, const std::string& folder,
                     const std::string& symmetry, const std::string& more = "") const {
    const Outcome outcome = scarp("run " + path(recipe) + " --json --set 'domain.symmetry=\"" +
                                  symmetry + "\"' -o " + path(folder) + " " + more);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.messages;
    return nlohmann::json::parse(read_file(path(folder) + "/summary.json"));
  }
};

TEST_F(SymmetricRun, PrescribedSpeedsGiveTheBitsOfTheWhole) {
  write("hole.toml", std::string(hole) + prescribed);
  const auto whole = run("hole.toml", "whole", "none");
  const auto quarter = run("hole.toml", "quarter", "auto");
  EXPECT_EQ(quarter["state_hash"], whole["state_hash"]);
  EXPECT_EQ(quarter["steps"], whole["steps"]);
  EXPECT_EQ(quarter["void_count"], 1);
  EXPECT_EQ(whole["void_count"], 1);
  const double volume = whole["void_volume_nm3"];
  EXPECT_NEAR(quarter["void_volume_nm3"], volume, 1e-6 * volume);
  EXPECT_EQ(read_file(path("quarter") + "/metrology.csv"),
            read_file(path("whole") + "/metrology.csv"));
  EXPECT_EQ(read_file(path("quarter") + "/profile_0002.csv"),
            read_file(path("whole") + "/profile_0002.csv"));
  const double facets = read_mesh(path("whole") + "/surface_0001.vtp").triangles.size();
  EXPECT_NEAR(read_mesh(path("quarter") + "/surface_0001.vtp").triangles.size(), facets,
              0.1 * facets);
}

// Where layers are crossed within a move, where an undercut meets the underside of a mask, and
// where films that grow by their normal pass a mask: nothing may hang on how facets lie there.
TEST_F(SymmetricRun, BordersOfMaterialsGiveTheBitsOfTheWhole) {
  const std::string domain = R"(
[domain]
spacing = "10 nm"
extent = ["400 nm", "400 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
)";
  const auto layer = [](const std::string& material) {
    return "\n[[geometry]]\nshape = \"layer\"\nthickness = \"53 nm\"\nmaterial = \"" + material +
           "\"\n";
  };
  const auto mask = [](const std::string& opening) {
    return "\n[[geometry]]\nshape = \"mask\"\nmaterial = \"mask\"\nthickness = \"43.7 nm\"\n" +
           opening;
  };
  const std::string hole_of_73 = "opening = { shape = \"hole\", radius = \"73 nm\" }\n";
  const std::string square =
      "opening = { shape = \"rectangle\", size = [\"141 nm\", \"141 nm\"] }\n";
  const std::string beam = R"(
[[step]]
model = "directional"
visibility = false
duration = "20 s"
directional_etch_rate = { mask = "0.2 nm/s", SiO2 = "4 nm/s", Si = "2 nm/s" }
isotropic_etch_rate = { mask = "0.05 nm/s", SiO2 = "0.5 nm/s", Si = "0.2 nm/s" }
)";
  const std::string epitaxy = R"(
[[step]]
model = "epitaxy"
duration = "20 s"
growth_rate = "4 nm/s"
material = "SiGe"
)";
  const std::string koh = R"(
[[step]]
model = "koh_etch"
duration = "20 s"
etch_rate_100 = "4 nm/s"
etch_rate_110 = "7 nm/s"
etch_rate_111 = "0.03 nm/s"
etch_rate_311 = "7 nm/s"
)";
  const std::string undercut = R"(
[[step]]
model = "isotropic"
duration = "30 s"
etch_rate = { mask = "0 nm/s", default = "2.3 nm/s" }
)";
  const std::string tapered =
      "taper = \"7 deg\"\nopening = { shape = \"hole\", radius = \"83 nm\" }\n";
  int number = 0;
  for (const std::string& recipe :
       {domain + layer("SiO2") + mask(square) + beam, domain + layer("Si") + mask(square) + epitaxy,
        domain + layer("Si") + mask(hole_of_73) + epitaxy, domain + mask(square) + koh,
        domain + mask(hole_of_73) + koh, domain + mask(tapered) + undercut}) {
    const std::string name = "borders_" + std::to_string(number++);
    write(name + ".toml", recipe);
    const auto whole = run(name + ".toml", name + "_whole", "none");
    const auto part = run(name + ".toml", name + "_part", "auto");
    EXPECT_EQ(part["state_hash"], whole["state_hash"]) << recipe;
  }
}

// The same in a square, which is its own image across the diagonal, too.
std::string square_hole() {
  std::string text = hole;
  const std::string narrow = "\"220 nm\"]";
  return text.replace(text.find(narrow), narrow.size(), "\"260 nm\"]");
}

TEST_F(SymmetricRun, PrescribedSpeedsGiveTheBitsOfTheWholeOnAnEighth) {
  write("hole.toml", square_hole() + prescribed);
  const auto whole = run("hole.toml", "whole", "none");
  const auto eighth = run("hole.toml", "eighth", "auto");
  EXPECT_EQ(eighth["state_hash"], whole["state_hash"]);
  EXPECT_EQ(eighth["steps"], whole["steps"]);
  EXPECT_EQ(eighth["void_count"], 1);
  EXPECT_EQ(read_file(path("eighth") + "/metrology.csv"),
            read_file(path("whole") + "/metrology.csv"));
  EXPECT_EQ(read_file(path("eighth") + "/profile_0002.csv"),
            read_file(path("whole") + "/profile_0002.csv"));
  const auto columns = [&](const std::string& folder) {
    return columns_of(path(folder) + "/metrics.csv");
  };
  const auto of_whole = columns("whole");
  const auto of_eighth = columns("eighth");
  // Facets are others, and near a neck they see more or less of it.
  constexpr double part = 0.06;
  for (const char* const name : {"surface_area_nm2", "solid_volume_nm3", "growth_nm3_per_s"}) {
    ASSERT_EQ(of_eighth.at(name).size(), of_whole.at(name).size());
    for (std::size_t row = 0; row < of_whole.at(name).size(); ++row) {
      const double expected = std::stod(of_whole.at(name)[row]);
      EXPECT_NEAR(std::stod(of_eighth.at(name)[row]), expected, part * std::abs(expected)) << name;
    }
  }
}

TEST_F(SymmetricRun, TwoDimensionalBitsAreThoseOfTheWhole) {
  write("trench.toml", R"(
[domain]
spacing = "10 nm"
extent = ["260 nm"]
mode = "2d"
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "trench"
width = "80 nm"
depth = "110 nm"
taper = "-8 deg"
[[step]]
model = "isotropic"
duration = "30 s"
material = "SiO2"
growth_rate = "2 nm/s"
)");
  const auto whole = run("trench.toml", "whole", "none");
  const auto half = run("trench.toml", "half", "auto");
  EXPECT_EQ(half["state_hash"], whole["state_hash"]);
  EXPECT_EQ(half["void_count"], whole["void_count"]);
}

// The film on the floor, in which the flux counts most: of a quarter, and of an eighth, also on all
// of the facets that it is cut from.
TEST_F(SymmetricRun, FluxModelsAgreeWithinTheirErrors) {
  const std::string all_facets = "[simplify]\nenabled = false\n";
  for (const std::string& geometry :
       {std::string(hole), square_hole(), square_hole() + all_facets}) {
    write("hole.toml", geometry + deposition);
    const auto depth = [&](const std::string& folder, const std::string& symmetry, int seed) {
      return run("hole.toml", folder, symmetry,
                 "--set flux.seed=" + std::to_string(seed))["metrology"]["openings"][0]["depth_nm"]
          .get<double>();
    };
    constexpr int count = 6;
    std::array<double, 2> mean{};
    std::array<double, 2> squares{};
    for (int seed = 1; seed <= count; ++seed) {
      const std::array<double, 2> found{depth("whole", "none", seed), depth("part", "auto", seed)};
      for (std::size_t n = 0; n < 2; ++n) {
        mean[n] += found[n] / count;
        squares[n] += found[n] * found[n] / count;
      }
    }
    double variance = 0;
    for (std::size_t n = 0; n < 2; ++n)
      variance += std::max(0.0, squares[n] - mean[n] * mean[n]) / (count - 1);
    // Time steps go by the largest of all speeds, with its noise, of which a quarter has less: that
    // makes a twentieth of a spacing.
    EXPECT_NEAR(mean[0], mean[1], 4 * std::sqrt(variance) + 0.5);
  }
}

TEST_F(SymmetricRun, GoesOnAfterAnInterruptionAsIfThereHadBeenNone) {
  write("hole.toml", square_hole() + prescribed + "checkpoint_every = \"3 s\"\n");
  const auto whole = run("hole.toml", "whole", "auto");
  std::filesystem::create_directory(path("part"));
  for (const char* name :
       {"recipe.toml", "metrics.csv", "metrology.csv", "state_0000.vdb", "state_0001.vdb"})
    std::filesystem::copy_file(path("whole") + "/" + name, path("part") + "/" + name);
  const auto resumed = run("hole.toml", "part", "auto", "--resume");
  EXPECT_EQ(resumed["state_hash"], whole["state_hash"]);
  EXPECT_EQ(metrics_without_times(path("part") + "/metrics.csv"),
            metrics_without_times(path("whole") + "/metrics.csv"));
}

TEST_F(SymmetricRun, LeavesAStateThatIsThatOfTheWhole) {
  write("hole.toml", square_hole() + deposition);
  run("hole.toml", "eighth", "auto");
  write("on.toml", "start = \"eighth/state_0001.vdb\"\n" +
                       square_hole().substr(0, square_hole().find("[[geometry]]")) +
                       R"(
[[step]]
model = "isotropic"
duration = "8 s"
etch_rate = "2 nm/s"
)");
  const auto whole = run("on.toml", "on_whole", "none");
  const auto eighth = run("on.toml", "on_eighth", "auto");
  EXPECT_EQ(eighth["state_hash"], whole["state_hash"]);
  // What flux has moved is still its own mirror image, to the last bit.
  EXPECT_THAT(scarp("check " + path("on.toml")).out, HasSubstr("on the eighth of the domain"));
  const Outcome measured = scarp("measure " + path("eighth") + " --json");
  EXPECT_EQ(measured.exit_code, 0) << measured.messages;
}

// The fronts of the film that closes the arms of a cross meet on the planes, nearly along them: no
// facet may join two places there, or its image would join them, too, and the surface be none.
TEST_F(SymmetricRun, FrontsThatMeetOnAPlaneLeaveASurface) {
  write("cross.toml", R"(
[domain]
spacing = "10 nm"
extent = ["400 nm", "400 nm"]
symmetry = "auto"
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "layer"
material = "SiO2"
thickness = "60 nm"
[[geometry]]
shape = "mask"
material = "resist"
thickness = "80 nm"
[geometry.opening]
shape = "polygon"
points = [["-120 nm", "-40 nm"], ["-40 nm", "-40 nm"], ["-40 nm", "-120 nm"],
          ["40 nm", "-120 nm"], ["40 nm", "-40 nm"], ["120 nm", "-40 nm"], ["120 nm", "40 nm"],
          ["40 nm", "40 nm"], ["40 nm", "120 nm"], ["-40 nm", "120 nm"], ["-40 nm", "40 nm"],
          ["-120 nm", "40 nm"]]
[[step]]
model = "conformal"
thickness = "55 nm"
material = "Si3N4"
[[step]]
model = "isotropic"
duration = "40 s"
etch_rate = { Si3N4 = "1.5 nm/s", default = "0.3 nm/s" }
[output]
every = "20 s"
)");
  run("cross.toml", "cross", "auto");
  for (int output = 0; output <= 3; ++output) {
    const std::string surface = path("cross") + "/surface_000" + std::to_string(output) + ".vtp";
    EXPECT_NO_THROW(HalfEdges(read_mesh(surface))) << output;
  }
  EXPECT_TRUE(std::filesystem::exists(path("cross") + "/report.html"));
}

// A film is measured from triangles, which are no mirror images.
TEST_F(SymmetricRun, AConformalFilmKeepsAnEighth) {
  write("hole.toml", square_hole() + R"(
[[step]]
model = "conformal"
material = "SiO2"
thickness = "23 nm"
)");
  run("hole.toml", "eighth", "auto");
  write("on.toml", "start = \"eighth/state_0001.vdb\"\n" +
                       square_hole().substr(0, square_hole().find("[[geometry]]")) +
                       "[[step]]\nmodel = \"isotropic\"\nduration = \"8 s\"\n"
                       "etch_rate = \"2 nm/s\"\n");
  EXPECT_THAT(scarp("check " + path("on.toml")).out, HasSubstr("on the eighth of the domain"));
}

TEST_F(SymmetricRun, CheckTellsOfMirrorPlanesAndWhyThereAreNone) {
  write("hole.toml", std::string(hole) + prescribed);
  const auto told = [&](const std::string& settings) {
    return scarp("check " + path("hole.toml") + " " + settings).out;
  };
  EXPECT_THAT(told(""), HasSubstr("\"auto\" would run on the quarter of the domain beyond the "
                                  "mirror planes x = 0 and y = 0"));
  const std::string used = "--set 'domain.symmetry=\"auto\"' ";
  EXPECT_THAT(told(used), HasSubstr("Symmetry: runs on the quarter"));
  EXPECT_THAT(told(used + "--set 'geometry[1].opening.center=[\"10 nm\",\"0 nm\"]'"),
              HasSubstr("runs on the half of the domain beyond the mirror plane y = 0"));
  EXPECT_THAT(told(used + "--set 'domain.extent=[\"250 nm\",\"210 nm\"]'"),
              HasSubstr("there is no mirror plane: along x 25 cells cannot be halved, along y 21 "
                        "cells cannot be halved"));
  EXPECT_THAT(told(used + "--set 'domain.boundary=[\"periodic\",\"periodic\"]'"),
              HasSubstr("there is no mirror plane: the sides are not reflective"));
  EXPECT_THAT(told("--set 'domain.boundary=[\"periodic\",\"periodic\"]'"),
              Not(HasSubstr("# Symmetry")));
  const auto planes = json_of(scarp("check --json " + path("hole.toml")))["mirror_planes"];
  EXPECT_EQ(planes, (nlohmann::json{"x = 0", "y = 0"}));
  const std::string square = "--set 'domain.extent=[\"260 nm\",\"260 nm\"]' ";
  EXPECT_THAT(told(used + square), HasSubstr("runs on the eighth of the domain beyond the mirror "
                                             "planes x = 0, y = 0 and x = y"));
  const std::string slit = "--set 'geometry[1].opening={shape=\"trench\",width=\"60 nm\"}'";
  EXPECT_THAT(told(used + square + slit),
              AllOf(HasSubstr("runs on the quarter"),
                    HasSubstr("x = y is none: the start is not its own mirror image")));
  // Rates that lean, though no particle does.
  write("beams.toml", square_hole() + R"(
[[step]]
model = "directional"
duration = "10 s"
directional_etch_rate = "1 nm/s"
visibility = false
[[step.beam]]
tilt = "60 deg"
[[step.beam]]
tilt = "60 deg"
azimuth = "180 deg"
)");
  EXPECT_THAT(scarp("check " + path("beams.toml")).out,
              AllOf(HasSubstr("on the quarter"), HasSubstr("a source that leans")));
}

}  // namespace
}  // namespace scarp
