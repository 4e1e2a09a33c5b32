// Mesh files of others as a user meets them: tests/reference/meshes.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>

#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class MeshCases : public Program {
 protected:
  static std::string reference(const std::string& name) {
    return std::string(SCARP_SOURCE_DIR) + "/tests/reference/meshes/" + name;
  }

  std::string recipe_with(const std::string& geometry) const {
    write("r.toml",
          "[domain]\nspacing = \"20 nm\"\nextent = [\"1 um\", \"1 um\"]\n"
          "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n" +
              geometry + "[[step]]\nmodel = \"planarise\"\nheight = \"1 um\"\n");
    return path("r.toml");
  }

  static std::string mesh(const std::string& file, const std::string& more) {
    return "[[geometry]]\nshape = \"mesh\"\nfile = \"" + file + "\"\n" + more + "\n";
  }

  /// Of the top material.
  double volume(const Outcome& preview) const {
    return json_of(preview)["layers"].back()["volume_nm3"];
  }
};

TEST_F(MeshCases, GiveTheirVolume) {
  for (const auto& [file, volume_nm3] : {std::pair{"polys_plus_strips.vtp", 4.0e7},
                                         {"face_plus_tristrips.ply", 4.0e7},
                                         {"zlib_default_vtk.vtp", 3.2e7},
                                         {"obj_continuation.obj", 3.2e7},
                                         {"stl_bom.stl", 3.2e7},
                                         {"stl_leading_newline.stl", 3.2e7},
                                         {"touching.obj", 3.2e7}}) {
    const std::string recipe = recipe_with(mesh(reference(file), "material = \"SiO2\""));
    const Outcome preview = scarp("preview " + recipe + " --json -o " + path("p"));
    ASSERT_EQ(preview.exit_code, 0) << file << preview.messages;
    EXPECT_NEAR(volume(preview), volume_nm3, 5e-3 * volume_nm3) << file;
    EXPECT_THAT(preview.messages, Not(HasSubstr("warning"))) << file;
  }
}

TEST_F(MeshCases, ABodyInSolidIsWarnedOfUnlessItIsCutOutBefore) {
  const std::string file = reference("inside_solid.obj");
  const std::string body = mesh(file, "material = \"W\"");
  const std::string nothing =
      "geometry[1].file: the body around (0, 0, -50) nm lies wholly in solid";
  const std::string recipe = recipe_with(body);
  for (const char* command : {"check ", "preview "}) {
    const Outcome outcome = scarp(command + recipe + (command[0] == 'p' ? " -o " + path("p") : ""));
    EXPECT_EQ(outcome.exit_code, 0);
    EXPECT_THAT(outcome.messages + outcome.out, HasSubstr(nothing));
  }
  const std::string replaced = recipe_with(mesh(file, "cut = true") + body);
  const Outcome preview = scarp("preview " + replaced + " --json -o " + path("q"));
  ASSERT_EQ(preview.exit_code, 0) << preview.messages;
  EXPECT_THAT(preview.messages, Not(HasSubstr("warning")));
  EXPECT_NEAR(volume(preview), 400 * 400 * 100, 1e5);
}

TEST_F(MeshCases, WhatIsLeftOutIsSaid) {
  write("a.obj", read_file(reference("obj_continuation.obj")) + "l 1 2\nvn 0 0 1\n");
  const std::string recipe = recipe_with(mesh(path("a.obj"), "material = \"SiO2\""));
  const Outcome check = scarp("check " + recipe);
  EXPECT_THAT(check.messages + check.out,
              AllOf(HasSubstr("geometry[1].file: leaves out 1 line\n"),
                    HasSubstr("geometry[1].file: leaves out 1 normal")));
  const Outcome simplify = scarp("simplify " + path("a.obj") + " " + path("b.obj"));
  EXPECT_THAT(simplify.messages,
              AllOf(HasSubstr("warning: " + path("a.obj") + ": leaves out 1 line"),
                    HasSubstr(path("a.obj") + ": leaves out 1 normal")));
  const Outcome distance = scarp("distance " + path("a.obj") + " " + path("b.obj"));
  EXPECT_THAT(distance.messages, HasSubstr("a.obj: leaves out 1 line"));
}

TEST_F(MeshCases, FacetsWithoutSharedVerticesAreWeldedAndReduced) {
  const Outcome outcome =
      scarp("simplify " + reference("s_soup.obj") + " " + path("b.obj") + " --spacing 1 --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
  EXPECT_EQ(json_of(outcome)["vertices_in"], 441);
  EXPECT_LE(json_of(outcome)["vertices_out"], 30);
  EXPECT_THAT(outcome.messages, HasSubstr("2400 vertices at 441 places are welded"));
}

TEST_F(MeshCases, ADrawnCylinderIsReducedAsFarAsTheBoundAllows) {
  const std::string simplify =
      "simplify " + reference("cyl_32_10_1.obj") + " " + path("b.obj") + " --json ";
  const auto result = json_of(scarp(simplify + "--max-error 0.1"));
  EXPECT_LE(result["vertices_out"], 24);
  EXPECT_LE(result["max_distance"], 0.1);
  EXPECT_LE(result["reverse_max_distance"], 0.1);
  EXPECT_EQ(json_of(scarp(simplify + "--vertices 30"))["vertices_out"], 30);
  const Outcome missed = scarp(simplify + "--remove 0.99 --max-error 0.1");
  EXPECT_THAT(missed.messages,
              HasSubstr(" vertices are left in place of 1: --max-error was reached"));
}

/// A prism over an ellipse, drawn as a CAD program draws it: sides of two facets, covers as fans.
std::string drawn_prism(int sides, std::array<double, 2> radii, double height) {
  std::string text;
  for (const double z : {0.0, height}) {
    for (int n = 0; n < sides; ++n) {
      const double angle = 2 * std::numbers::pi * n / sides;
      text += fmt::format("v {:.7g} {:.7g} {:.7g}\n", radii[0] * std::cos(angle),
                          radii[1] * std::sin(angle), z);
    }
  }
  text += fmt::format("v 0 0 0\nv 0 0 {:.7g}\n", height);
  const int top = 2 * sides + 2;
  for (int a = 1; a <= sides; ++a) {
    const int b = a % sides + 1;
    text += fmt::format("f {} {} {}\nf {} {} {}\n", a, b, b + sides, a, b + sides, a + sides);
    text += fmt::format("f {} {} {}\nf {} {} {}\n", top - 1, b, a, top, a + sides, b + sides);
  }
  return text;
}

// Facets as long as the body, 1:32 000 at most, which lie in no part of it alone.
TEST_F(MeshCases, LongSliversAreReducedAsFarAsTheBoundAllows) {
  struct Case {
    int sides;
    std::array<double, 2> radii;
    double height;
  };
  for (const auto& [sides, radii, height] : {Case{200, {1, 1}, 1000}, Case{64, {3, 1}, 3000}}) {
    write("a.obj", drawn_prism(sides, radii, height));
    const Outcome outcome =
        scarp("simplify " + path("a.obj") + " " + path("b.obj") + " --max-error 0.1 --json");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.messages;
    const auto result = json_of(outcome);
    EXPECT_EQ(result["vertices_in"], 2 * sides + 2);
    EXPECT_LE(result["vertices_out"], 48) << height;
    EXPECT_LE(result["max_distance"], 0.1) << height;
    EXPECT_LE(result["reverse_max_distance"], 0.1) << height;
    EXPECT_EQ(result["stopped_by"], "max_error");
  }
}

}  // namespace
}  // namespace scarp
