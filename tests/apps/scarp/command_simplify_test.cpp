// scarp simplify as a user calls it.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

using SimplifyCommand = Program;

TEST_F(SimplifyCommand, SimplifyWritesAMeshAndSaysWhatStoppedIt) {
  write("a.obj", pyramid);
  const Outcome simplify = scarp("simplify " + path("a.obj") + " " + path("b.ply") + " --json");
  ASSERT_EQ(simplify.exit_code, 0) << simplify.messages;
  const auto result = json_of(simplify);
  for (const char* key : {"method", "vertices_in", "vertices_out", "facets_in", "facets_out",
                          "seconds", "max_distance", "reverse_max_distance", "stopped_by"}) {
    EXPECT_TRUE(result.contains(key)) << key;
  }
  EXPECT_TRUE(fs::exists(folder_ / "b.ply"));
}

TEST_F(SimplifyCommand, SizesThatMakeNoSenseAreExitTwo) {
  write("a.obj", pyramid);
  const std::string simplify = "simplify " + path("a.obj") + " " + path("b.ply");
  for (const char* option : {" --l0 inf", " --l0 -1", " --step-length nan", " --l-max -1",
                             " --remove 1", " --max-error -1"}) {
    const Outcome outcome = scarp(simplify + option);
    EXPECT_EQ(outcome.exit_code, 2) << option;
    EXPECT_LT(outcome.messages.size(), 300U) << option;
  }
  EXPECT_FALSE(fs::exists(folder_ / "b.ply"));
}

// Two sheets with ridges across each other, .05 apart: with few vertices they would meet.
TEST_F(SimplifyCommand, MoreVerticesThanAskedForAreSaidWithTheReason) {
  std::string film;
  constexpr int row = 13;
  for (int k = 0; k < row * row; ++k) {
    const double z = 0.4 * ((k / row + k % row) % 2);
    film += fmt::format("v {} {} {}\n", k % row, k / row, z);
  }
  for (int k = 0; k < row * row; ++k) {
    const double z = 0.05 + 0.4 * ((k / row + k % row) % 2);
    film += fmt::format("v {} {} {}\n", k % row, k / row, z);
  }
  for (int j = 0; j + 1 < row; ++j) {
    for (int i = 0; i + 1 < row; ++i) {
      const int a = j * row + i + 1;
      const int b = a + row * row;
      film +=
          fmt::format("f {} {} {}\nf {} {} {}\n", a, a + row + 1, a + 1, a, a + row, a + row + 1);
      film +=
          fmt::format("f {} {} {}\nf {} {} {}\n", b, b + 1, b + row + 1, b, b + row + 1, b + row);
    }
  }
  write("film.obj", film);
  const Outcome simplify = scarp("simplify " + path("film.obj") + " " + path("b.ply") +
                                 " --spacing 1 --vertices 30 --json");
  ASSERT_EQ(simplify.exit_code, 0) << simplify.messages;
  EXPECT_EQ(json_of(simplify)["stopped_by"], "self_intersections");
  EXPECT_THAT(simplify.messages, HasSubstr("passed through each other"));
}

TEST_F(SimplifyCommand, NegativeCountsAreExitTwo) {
  write("a.obj", pyramid);
  for (const char* count : {"0", "-5"}) {
    const std::string line = "simplify " + path("a.obj") + " " + path("b.ply") + " --vertices ";
    EXPECT_EQ(scarp(line + count).exit_code, 2) << count;
  }
  EXPECT_EQ(scarp("flux " + path("a.obj") + " --rays 100 --seed -1").exit_code, 2);
}

TEST_F(SimplifyCommand, ANonManifoldMeshIsRefusedWithThePlace) {
  write("bad.obj", std::string(pyramid) + "v 0.5 0 1\nf 1 2 6\n");
  const Outcome simplify = scarp("simplify " + path("bad.obj") + " " + path("b.ply"));
  EXPECT_EQ(simplify.exit_code, 2);
  EXPECT_THAT(simplify.messages, HasSubstr("manifold"));
  EXPECT_FALSE(fs::exists(folder_ / "b.ply"));
}

TEST_F(SimplifyCommand, AFullDiskIsExitThree) {
  write("a.obj", pyramid);
  fs::create_symlink("/dev/full", folder_ / "full.ply");
  const Outcome simplify = scarp("simplify " + path("a.obj") + " " + path("full.ply"));
  EXPECT_EQ(simplify.exit_code, 3);
  EXPECT_THAT(simplify.messages, HasSubstr("the disk is full"));
}

TEST_F(SimplifyCommand, ANumberThatIsMissedIsToldWithTheReason) {
  write("a.obj", pyramid);
  const Outcome outcome =
      scarp("simplify " + path("a.obj") + " " + path("b.ply") + " --vertices 3 --spacing 1");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.messages, HasSubstr("4 vertices are left in place of 3: no other edge"));
}

// Two cells of a grid, one of them drawn out.
TEST_F(SimplifyCommand, AMeshThatLooksSimplifiedWantsItsSpacing) {
  write("a.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 20 0 0\nv 20 1 0\n"
        "f 1 2 4\nf 1 4 3\nf 2 5 6\nf 2 6 4\n");
  const std::string simplify = "simplify " + path("a.obj") + " " + path("b.ply");
  EXPECT_THAT(scarp(simplify).messages, HasSubstr("the mesh looks simplified already"));
  EXPECT_THAT(scarp(simplify + " --spacing 1").messages, Not(HasSubstr("simplified already")));
}

}  // namespace
}  // namespace scarp
