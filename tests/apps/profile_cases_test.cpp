// Polygons, contours and cut meshes as the start of a cross-section, as a user meets them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;

class ProfileCases : public Program {
 protected:
  std::string recipe(const std::string& geometry,
                     const std::string& domain = "extent = [\"800 nm\"]") const {
    write("r.toml", "[domain]\nspacing = \"10 nm\"\nmode = \"2d\"\n" + domain +
                        "\n[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n[[geometry]]\n" +
                        geometry + "\n[[step]]\nmodel = \"planarise\"\nheight = \"1 um\"\n");
    return path("r.toml");
  }

  /// Of each layer, over the spacing.
  std::vector<double> areas(const std::string& recipe) const {
    const Outcome preview = scarp("preview " + recipe + " --json -o " + path("p"));
    EXPECT_EQ(preview.exit_code, 0) << preview.messages;
    std::vector<double> areas;
    if (preview.exit_code != 0) return {0, 0};
    const auto document = json_of(preview);
    for (const auto& layer : document["layers"])
      areas.push_back(layer["volume_nm3"].get<double>() / 10);
    return areas;
  }

  std::string check(const std::string& recipe) const {
    const Outcome outcome = scarp("check " + recipe);
    return outcome.messages + outcome.out;
  }

  std::string mesh(const std::string& more) const {
    write("cube.obj",
          "v -100 -100 -50\nv 100 -100 -50\nv 100 100 -50\nv -100 100 -50\n"
          "v -100 -100 100\nv 100 -100 100\nv 100 100 100\nv -100 100 100\n"
          "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
    return "shape = \"mesh\"\nfile = \"cube.obj\"\nmaterial = \"W\"\n" + more;
  }
};

TEST_F(ProfileCases, AContourFromSideToSideIsFilledBelow) {
  write("c.csv", "x [um],z [um]\n-0.4,0.05\n-0.1,0.05\n0,-0.1\n0.1,0.05\n0.4,0.05\n");
  const std::string contour = "shape = \"profile\"\nfile = \"c.csv\"\n";
  // The notch is 200 wide and 150 deep, a third of that above z = 0.
  const double above = 800 * 50 - 50 * (200 + 400.0 / 3) / 2;
  EXPECT_NEAR(areas(recipe(contour + "material = \"SiO2\""))[1], above, 100);
  EXPECT_NEAR(areas(recipe(contour + "cut = true"))[0], -100 * (400.0 / 3) / 2, 100);
}

TEST_F(ProfileCases, AContourIsChecked) {
  const std::string contour = "shape = \"profile\"\nfile = \"c.csv\"\nmaterial = \"SiO2\"";
  EXPECT_THAT(check(recipe(contour)), HasSubstr("c.csv: cannot be read"));
  write("c.csv", "x [um],z [um]\n-0.4,0.05\n0.3,0.05\n");
  EXPECT_THAT(check(recipe(contour)),
              HasSubstr("geometry[1].file: goes from x = -400 to 300 nm and is not closed; it has "
                        "to reach both sides of the domain, -400 and 400 nm"));
  EXPECT_THAT(check(recipe(contour + "\npoints = [[\"0 nm\", \"0 nm\"], [\"9 nm\", \"0 nm\"], "
                                     "[\"0 nm\", \"9 nm\"]]")),
              HasSubstr("geometry[1].file: points says already what the profile is"));
}

TEST_F(ProfileCases, AClosedContourIsABody) {
  write("c.csv", "x [nm],z [nm]\n-100,-50\n100,-50\n100,100\n-100,100\n-100,-50\n");
  EXPECT_NEAR(areas(recipe("shape = \"profile\"\nfile = \"c.csv\"\nmaterial = \"SiO2\""))[1],
              200 * 100, 20);
}

// Of a contour on periodic sides whose ends differ in height each copy ends at the sides.
TEST_F(ProfileCases, APeriodicContourHasAWallAtTheSide) {
  const std::string periodic = "extent = [\"800 nm\"]\nboundary = [\"periodic\"]";
  write("c.csv",
        "x [nm],z [nm]\n-400,81\n-150,81\n-150,10\n-50,10\n-50,200\n50,200\n50,40\n400,40\n");
  EXPECT_NEAR(
      areas(recipe("shape = \"profile\"\nfile = \"c.csv\"\nmaterial = \"SiO2\"", periodic))[1],
      250 * 81 + 100 * 10 + 100 * 200 + 350 * 40, 200);
  // A patch with the same ends.
  write("p.obj",
        "v -400 -9 81\nv -400 9 81\nv 0 -9 81\nv 0 9 81\nv 10 -9 40\nv 10 9 40\nv 400 -9 40\n"
        "v 400 9 40\nf 1 3 4\nf 1 4 2\nf 3 5 6\nf 3 6 4\nf 5 7 8\nf 5 8 6\n");
  EXPECT_NEAR(areas(recipe("shape = \"mesh\"\nfile = \"p.obj\"\nsection = \"y = 0 nm\"\n"
                           "material = \"SiO2\"",
                           periodic))[1],
              400 * 81 + 10 * 60.5 + 390 * 40, 200);
}

TEST_F(ProfileCases, WhatIsWrongWithAContourIsSaidOfItsFile) {
  write("c.csv", "x [nm],z [nm]\n0,0\n90,0\n0,90\n90,90\n0,0\n");
  EXPECT_THAT(check(recipe("shape = \"profile\"\nfile = \"c.csv\"\nmaterial = \"SiO2\"")),
              HasSubstr("geometry[1].file: edge 1 and edge 3 cross or touch"));
}

TEST_F(ProfileCases, ThinStripsOfASectionLieAtAnX) {
  const std::string cut = "cut = \"from -400 nm, 0 nm to 400 nm, 0 nm\"";
  EXPECT_THAT(
      check(recipe("shape = \"mask\"\nmaterial = \"resist\"\nthickness = \"50 nm\"\n"
                   "opening = { shape = \"polygon\", points = [[\"-5 nm\", \"-90 nm\"], "
                   "[\"5 nm\", \"-90 nm\"], [\"5 nm\", \"90 nm\"], [\"-5 nm\", \"90 nm\"]] }",
                   cut)),
      HasSubstr("walls at x = -5 nm are 10 nm apart"));
}

TEST_F(ProfileCases, AMeshIsCutInAPlane) {
  EXPECT_NEAR(areas(recipe(mesh("section = \"y = 0 nm\"")))[1], 200 * 100, 20);
  EXPECT_NEAR(areas(recipe(mesh("section = \"x = 37 nm\"")))[1], 200 * 100, 20);
  const std::string diagonal =
      "cut = \"from -282.8427 nm, -282.8427 nm to 282.8427 nm, 282.8427 nm\"";
  EXPECT_NEAR(areas(recipe(mesh(""), diagonal))[1], 282.8427 * 100, 28);
}

TEST_F(ProfileCases, ThePlaneOfAMeshIsChecked) {
  EXPECT_THAT(check(recipe(mesh(""))),
              HasSubstr("geometry[1].shape: meshes need three dimensions, or a plane in which they "
                        "are cut: section = \"y = 0 nm\""));
  EXPECT_THAT(check(recipe(mesh("section = \"z = 0 nm\""))),
              HasSubstr("geometry[1].section: \"z = 0 nm\" is no plane; write"));
  EXPECT_THAT(check(recipe(mesh("section = \"y = 200 nm\""))),
              HasSubstr("geometry[1].file: the plane of the section meets nothing of it"));
}

}  // namespace
}  // namespace scarp
