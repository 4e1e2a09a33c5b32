// Layouts as a user meets them: formulas of layers, sizing, windows, and sections along a line.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "tests/apps/program.h"
#include "tests/levelset/gds_writer.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class LayoutCases : public Program {
 protected:
  /// Two layers: 1/0 has a square of 400 nm, 2/0 one of 200 nm in its middle, 3/1 a strip of 100 nm
  /// along x.
  void SetUp() override {
    Program::SetUp();
    GdsWriter gds;
    gds.cell("TOP", [&] {
      gds.rectangle(1, 800, 800, 1200, 1200);
      gds.rectangle(2, 900, 900, 1100, 1100);
      gds.boundary(3, 1, {0, 950, 2000, 950, 2000, 1050, 0, 1050, 0, 950});
      gds.rectangle(4, 900, 900, 1100, 1100);
      gds.boundary(4, 5, {900, 900, 1300, 900, 1300, 1100, 900, 1100, 900, 900});
    });
    write("a.gds", gds.finish());
  }

  /// A resist of 200 nm with an outline from the layout.
  std::string recipe(const std::string& domain, const std::string& outline) const {
    write("r.toml", "[domain]\nspacing = \"10 nm\"\n" + domain +
                        "\n[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n[[geometry]]\n"
                        "shape = \"mask\"\nmaterial = \"resist\"\nthickness = \"200 nm\"\n"
                        "resist = { shape = \"gds\", file = \"a.gds\", " +
                        outline + " }\n[[step]]\nmodel = \"planarise\"\nheight = \"1 um\"\n");
    return path("r.toml");
  }

  std::string solid(const std::string& outline) const {
    return recipe("extent = [\"800 nm\", \"800 nm\"]", outline);
  }
  std::string section(const std::string& line, const std::string& outline) const {
    return recipe("mode = \"2d\"\ncut = \"" + line + "\"", outline);
  }

  /// Of the resist: volume over thickness and, of a section, over the spacing.
  double resist(const std::string& recipe, double depth = 1, const std::string& more = "") const {
    const Outcome preview = scarp("preview " + recipe + more + " --json -o " + path("p"));
    EXPECT_EQ(preview.exit_code, 0) << preview.messages;
    if (preview.exit_code != 0) return 0;
    const double volume_nm3 = json_of(preview)["layers"].back()["volume_nm3"];
    return volume_nm3 / 200 / depth;
  }

  std::string check(const std::string& recipe) const {
    const Outcome outcome = scarp("check " + recipe);
    return outcome.messages + outcome.out;
  }
};

const std::string centred = ", origin = [\"1 um\", \"1 um\"]";

TEST_F(LayoutCases, LayersAreCombined) {
  for (const auto& [formula, area_nm2] : {std::pair{"1/0 - 2/0", 160e3 - 40e3},
                                          {"1 + 3", 160e3 + 40e3},
                                          {"3/1 & 1 - 2", 20e3},
                                          {"(1 + 3) - 2", 160e3 + 40e3 - 40e3}}) {
    const std::string layers = fmt::format("layers = \"{}\"", formula);
    EXPECT_NEAR(resist(solid(layers + centred)), area_nm2, 2e-3 * area_nm2) << formula;
  }
}

TEST_F(LayoutCases, FormulasAreCheckedByName) {
  EXPECT_THAT(check(solid("layers = \"1 - 7/0\"" + centred)),
              HasSubstr("a.gds: cell TOP has nothing on layer 7/0; it has "
                        "layer/datatype 1/0, 2/0, 3/1, 4/0, 4/5"));
  EXPECT_THAT(check(solid("layers = \"1 -\"" + centred)),
              HasSubstr("resist.layers: \"1 -\" ends too early; write layers"));
  EXPECT_THAT(check(solid("layers = \"2 - 1\"" + centred)),
              HasSubstr("resist.layers: leaves nothing in the domain"));
  EXPECT_THAT(check(solid("layers = \"1\", layer = 1" + centred)),
              HasSubstr("resist.layer: layers says already which layers are taken"));
}

// In a formula the datatype stands behind the layer: there is no other key for it.
TEST_F(LayoutCases, TheRemedyForSeveralDatatypesIsOneThatIsAllowed) {
  const std::string doubt = "has layer 4 in datatypes 0, 5: all of them are taken; choose one ";
  EXPECT_THAT(check(solid("layers = \"4 & 3\"" + centred)),
              HasSubstr(doubt + "by writing for example 4/0"));
  EXPECT_THAT(check(solid("layers = \"4/0 & 3\"" + centred)), Not(HasSubstr("datatypes")));
  EXPECT_THAT(check(solid("layer = 4" + centred)), HasSubstr(doubt + "with datatype = ..."));
  EXPECT_THAT(check(solid("layer = 4, datatype = 0" + centred)), Not(HasSubstr("datatypes")));
}

TEST_F(LayoutCases, AHoleOfAFormulaStaysOnAPeriodicSide) {
  // The ring lies on the corner of the cell.
  const std::string ring =
      recipe("extent = [\"800 nm\", \"800 nm\"]\nboundary = [\"periodic\", \"periodic\"]",
             "layers = \"1 - 2\", origin = [\"600 nm\", \"600 nm\"]");
  EXPECT_NEAR(resist(ring), 120e3, 240);
}

TEST_F(LayoutCases, OutlinesGrowAndRound) {
  EXPECT_NEAR(resist(solid("layer = 1, grow = \"-25 nm\"" + centred)), 350 * 350, 250);
  EXPECT_NEAR(resist(solid("layer = 1, grow = \"25 nm\"" + centred)), 450 * 450, 400);
  const double quarter = std::numbers::pi / 4;
  EXPECT_NEAR(resist(solid("layer = 1, grow = \"30 nm\", corners = \"round\"" + centred)),
              460 * 460 - 4 * 900 * (1 - quarter), 450);
  EXPECT_NEAR(resist(solid("layer = 1, corner_radius = \"100 nm\"" + centred)),
              400 * 400 - 4 * 1e4 * (1 - quarter), 320);
}

TEST_F(LayoutCases, WhatVanishesIsSaid) {
  EXPECT_THAT(check(solid("layers = \"1 - 2\", grow = \"-50 nm\"" + centred)),
              HasSubstr("resist.grow: leaves nothing of the outline in the domain"));
  EXPECT_THAT(check(solid("layers = \"1 - 2\", grow = \"100 nm\"" + centred)),
              HasSubstr("geometry[1].resist.grow: 1 of 2 gaps and holes "
                        "close in the domain"));
  EXPECT_THAT(check(solid("layers = \"1 - 2\", grow = \"10 nm\"" + centred)),
              Not(HasSubstr("warning")));
  // Beside the domain lies what no sizing brings into it.
  EXPECT_THAT(check(solid("layer = 1, corner_radius = \"10 nm\", origin = [\"5 um\", \"1 um\"]")),
              Not(HasSubstr("corner_radius: leaves")));
  // The key is the one that does it.
  for (const std::string grow : {"", "grow = \"-10 nm\", ", "grow = \"10 nm\", "})
    EXPECT_THAT(
        check(solid("layers = \"1 - 2\", " + grow + "corner_radius = \"300 nm\"" + centred)),
        HasSubstr("resist.corner_radius: leaves nothing of the outline in the domain"))
        << grow;
  EXPECT_THAT(
      check(solid("layers = \"1 - 2\", grow = \"-50 nm\", corner_radius = \"5 nm\"" + centred)),
      HasSubstr("resist.grow: leaves nothing of the outline in the domain"));
  EXPECT_THAT(
      check(solid("layers = \"1 - 2\", grow = \"5 nm\", corner_radius = \"110 nm\"" + centred)),
      Not(HasSubstr("resist.grow")));
}

TEST_F(LayoutCases, AWindowOrACentrePlacesTheDomain) {
  const double area_nm2 = 160e3;
  EXPECT_NEAR(resist(solid("layer = 1, center = [\"1 um\", \"1 um\"]")), area_nm2, 320);
  EXPECT_NEAR(
      resist(solid("layer = 1, window = [[\"600 nm\", \"600 nm\"], [\"1.4 um\", \"1.4 um\"]]")),
      area_nm2, 320);
  EXPECT_THAT(
      check(solid("layer = 1, window = [[\"600 nm\", \"600 nm\"], [\"1.4 um\", \"1.5 um\"]]")),
      HasSubstr("resist.window: is 800 nm x 900 nm, and the domain 800 nm x 800 nm; write "
                "domain.extent = [\"800 nm\", \"900 nm\"]"));
  EXPECT_THAT(check(solid("layer = 1, window = [[\"2 um\", \"2 um\"], [\"1 um\", \"3 um\"]]")),
              HasSubstr("resist.window: the first corner has to lie below and left of the second"));
  EXPECT_THAT(check(solid("layer = 1, center = [\"1 um\", \"1 um\"]" + centred)),
              HasSubstr("resist.origin: center says already what becomes the middle"));
}

TEST_F(LayoutCases, ALineCutsALayout) {
  const std::string along_x = "from -400 nm, 150 nm to 400 nm, 150 nm";
  EXPECT_NEAR(resist(section(along_x, "layer = 1" + centred), 10), 400, 0.5);
  EXPECT_NEAR(resist(section(along_x, "layers = \"1 - 2\"" + centred), 10), 400, 0.5);
  const std::string middle = "from -400 nm, 20 nm to 400 nm, 20 nm";
  EXPECT_NEAR(resist(section(middle, "layers = \"1 - 2\"" + centred), 10), 200, 0.5);
  EXPECT_NEAR(resist(section(middle, "layer = 1, grow = \"-33 nm\"" + centred), 10), 334, 0.5);
  // Slanted by 30 degrees: 1000 nm long.
  const std::string slanted = "from -433.0127 nm, -250 nm to 433.0127 nm, 250 nm";
  EXPECT_NEAR(resist(section(slanted, "layer = 1" + centred), 10),
              400 / std::cos(std::numbers::pi / 6), 0.5);
}

TEST_F(LayoutCases, WhatVanishesOnALineIsSaid) {
  const std::string middle = "from -400 nm, 20 nm to 400 nm, 20 nm";
  EXPECT_THAT(
      check(section(middle, "layers = \"1 - 2\", grow = \"-50 nm\"" + centred)),
      HasSubstr("resist.grow: of 2 parts on the line of domain.cut 2 vanish or join others"));
  EXPECT_THAT(
      check(section(middle, "layers = \"1 - 2\", grow = \"100 nm\"" + centred)),
      HasSubstr("resist.grow: of 2 parts on the line of domain.cut 1 vanish or join others"));
  EXPECT_THAT(check(section(middle, "layers = \"1 - 2\", grow = \"-20 nm\"" + centred)),
              Not(HasSubstr("warning")));
}

TEST_F(LayoutCases, ALineIsChecked) {
  const std::string outline = "layer = 1" + centred;
  EXPECT_THAT(check(section("from 0 nm, 0 nm to 0 nm, 0 nm", outline)),
              HasSubstr("domain.cut: \"from 0 nm, 0 nm to 0 nm, 0 nm\" has no length; write"));
  EXPECT_THAT(check(recipe("cut = \"from 0 um, 0 um to 1 um, 0 um\"\n"
                           "extent = [\"800 nm\", \"800 nm\"]",
                           outline)),
              HasSubstr("domain.cut: is a line for mode = \"2d\"; leave it out"));
  EXPECT_THAT(check(recipe("mode = \"2d\"\nextent = [\"700 nm\"]\n"
                           "cut = \"from -400 nm, 0 nm to 400 nm, 0 nm\"",
                           outline)),
              HasSubstr("domain.extent[0]: 700 nm is not the length of the line, 800 nm; leave "
                        "extent out, or write extent = [\"800 nm\"]"));
  EXPECT_THAT(check(section("from -404 nm, 0 nm to 400 nm, 0 nm", outline)),
              HasSubstr("domain.cut: the line is 804 nm long, 80.4 spacings; the section is 800 nm "
                        "long"));
  EXPECT_THAT(check(section("from -400 nm, 350 nm to 400 nm, 350 nm", outline)),
              HasSubstr("resist.shape: the line of domain.cut meets nothing of it"));
  EXPECT_THAT(check(recipe("mode = \"2d\"\nextent = [\"800 nm\"]", outline)),
              HasSubstr("geometry[1].resist.shape: polygons and layouts need three dimensions, or "
                        "the line of the cross-section: domain.cut = \"from X, Y to X, Y\""));
}

TEST_F(LayoutCases, ShapesAndMaskStepsAreCut) {
  write("s.toml", R"([domain]
spacing = "10 nm"
mode = "2d"
cut = "from -400 nm, 0 nm to 400 nm, 0 nm"
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "hole"
radius = "100 nm"
center = ["-100 nm", "60 nm"]
depth = "100 nm"
[[geometry]]
shape = "trench"
along = "x"
width = "50 nm"
depth = "50 nm"
center = "200 nm"
[[step]]
model = "mask"
material = "resist"
thickness = "200 nm"
planar = true
opening = { shape = "gds", file = "a.gds", layers = "1 - 2", origin = ["1 um", "1 um"] }
)");
  EXPECT_THAT(check(path("s.toml")),
              AllOf(HasSubstr("geometry[1].shape: a hole is cut by domain.cut: in the section it "
                              "is a slot that is infinite along y"),
                    HasSubstr("geometry[2].shape: the line of domain.cut meets nothing of it")));
  const Outcome run = scarp("run " + path("s.toml") + " -o " + path("out"));
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  const Outcome preview = scarp("preview " + path("s.toml") + " --json -o " + path("p"));
  const double silicon_nm3 = json_of(preview)["layers"][0]["volume_nm3"];
  EXPECT_NEAR(silicon_nm3, -10 * 160 * 100, 2000);
}

TEST_F(LayoutCases, ACutOfALinePatternIsTheSectionOfItsSolid) {
  GdsWriter lines;
  lines.cell("TOP", [&] {
    lines.rectangle(1, -250, -5000, -110, 5000);
    lines.rectangle(1, 90, -5000, 270, 5000);
  });
  write("a.gds", lines.finish());
  const auto run = [&](const std::string& domain, const std::string& folder) {
    write("l.toml", "[domain]\nspacing = \"20 nm\"\n" + domain +
                        "\n[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n[[geometry]]\n"
                        "shape = \"mask\"\nmaterial = \"resist\"\nthickness = \"100 nm\"\n"
                        "resist = { shape = \"gds\", file = \"a.gds\", layer = 1 }\n[[step]]\n"
                        "model = \"isotropic\"\nduration = \"60 s\"\n"
                        "etch_rate = { Si = \"1 nm/s\", resist = \"0 nm/s\" }\n");
    const Outcome outcome = scarp("run " + path("l.toml") + " -o " + path(folder));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.messages;
  };
  run("extent = [\"800 nm\", \"80 nm\"]", "solid");
  run("mode = \"2d\"\ncut = \"from -400 nm, 10 nm to 400 nm, 10 nm\"", "cut");
  const Outcome compared =
      scarp("compare " + path("solid") + " " + path("cut") + " --json -o " + path("c"));
  ASSERT_EQ(compared.exit_code, 0) << compared.messages;
  for (const char* const way : {"forward", "reverse"})
    EXPECT_LT(json_of(compared)["distance"].back()[way]["max"], 0.25) << way;
}

TEST_F(LayoutCases, TheFlowOfTheReferenceIsCut) {
  const std::string reference = std::string(SCARP_SOURCE_DIR) + "/tests/reference/flows/r.toml";
  const std::string cut = " --set domain.cut='\"from -1 um, 0 um to 1 um, 0 um\"'";
  EXPECT_NEAR(resist(reference, 10, cut) * 200, 80e3, 400);
}

}  // namespace
}  // namespace scarp
