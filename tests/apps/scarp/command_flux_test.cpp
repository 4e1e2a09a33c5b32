// scarp flux as a user calls it.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tests/apps/program.h"

namespace scarp {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

using FluxCommand = Program;

TEST_F(FluxCommand, OnAConvexBumpHasNothingReEmittedInto) {
  write("a.obj", pyramid);
  const Outcome flux = scarp("flux " + path("a.obj") + " --engine forward --rays 20000 --json -o " +
                             path("flux.csv"));
  ASSERT_EQ(flux.exit_code, 0) << flux.messages;
  const auto result = json_of(flux);
  EXPECT_EQ(result["engine"], "forward");
  EXPECT_EQ(result["facets"], 4);
  EXPECT_EQ(result["lost"], 0);
  EXPECT_NEAR(result["absorbed"].get<double>() + result["escaped"].get<double>(), 1, 1e-9);
  EXPECT_EQ(read_file(folder_ / "flux.csv").rfind("facet,x,y,z,nx,ny,nz,area,flux,std_error\n", 0),
            0U);
}

TEST_F(FluxCommand, AMeshThatFacesDownIsRefused) {
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
  write("square.obj", corners + "f 3 2 1\nf 4 3 1\n");
  write("half.obj", corners + "f 3 2 1\n");
  for (const std::string engine : {"gather", "forward"}) {
    for (const std::string mesh : {"square.obj", "half.obj"}) {
      const Outcome flux = scarp("flux " + path(mesh) + " --engine " + engine + " --json");
      EXPECT_EQ(flux.exit_code, 2) << mesh << engine;
      EXPECT_THAT(flux.messages, HasSubstr(mesh + ": is inside out")) << mesh << engine;
    }
  }
}

/// A unit cube; vertex 8 is its corner (1, 1, 1).
std::string cube(bool inside_out, const std::string& eighth = "1 1 1") {
  std::string text =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv " + eighth + "\n";
  const std::array<std::array<int, 3>, 12> facets{{{1, 3, 4},
                                                   {1, 4, 2},
                                                   {5, 6, 8},
                                                   {5, 8, 7},
                                                   {1, 2, 6},
                                                   {1, 6, 5},
                                                   {3, 7, 8},
                                                   {3, 8, 4},
                                                   {1, 5, 7},
                                                   {1, 7, 3},
                                                   {2, 4, 8},
                                                   {2, 8, 6}}};
  for (auto [a, b, c] : facets) {
    if (inside_out) std::swap(b, c);
    text += "f " + std::to_string(a) + ' ' + std::to_string(b) + ' ' + std::to_string(c) + '\n';
  }
  return text;
}

TEST_F(FluxCommand, RefusesAMeshThatIsInsideOut) {
  write("right.obj", cube(false));
  write("wrong.obj", cube(true));
  for (const char* engine : {" --engine forward --rays 10000", " --engine gather"}) {
    EXPECT_EQ(scarp("flux " + path("right.obj") + engine).exit_code, 0) << engine;
    const Outcome flux = scarp("flux " + path("wrong.obj") + engine + " -o " + path("flux.csv"));
    EXPECT_EQ(flux.exit_code, 2) << engine;
    EXPECT_EQ(flux.out, "") << engine;
    EXPECT_THAT(flux.messages, AllOf(HasSubstr("wrong.obj: is inside out"), HasSubstr("100 %"),
                                     HasSubstr("turn its triangles over")));
    EXPECT_FALSE(fs::exists(folder_ / "flux.csv"));
  }
}

// A flat square, one of whose 200 facets is turned over: particles balance, and its flux is 0.
TEST_F(FluxCommand, WarnsOfAFacetThatIsTurnedOver) {
  constexpr int cells = 10;
  std::string text;
  std::string faces;
  for (int y = 0; y <= cells; ++y)
    for (int x = 0; x <= cells; ++x) text += fmt::format("v {} {} 0\n", x, y);
  for (int y = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) {
      const int v = y * (cells + 1) + x + 1;
      const bool is_turned = x == 4 && y == 4;
      faces += is_turned ? fmt::format("f {} {} {}\n", v, v + cells + 2, v + 1)
                         : fmt::format("f {} {} {}\n", v, v + 1, v + cells + 2);
      faces += fmt::format("f {} {} {}\n", v, v + cells + 2, v + cells + 1);
    }
  }
  write("turned.obj", text + faces);
  const Outcome flux = scarp("flux " + path("turned.obj") + " --sticking 1 --rays 20000");
  EXPECT_EQ(flux.exit_code, 0) << flux.messages;
  EXPECT_THAT(flux.messages, HasSubstr("warning: the mesh is not the border of a solid: "));
}

TEST_F(FluxCommand, RefusesVerticesTooFarAway) {
  write("far.obj", cube(false, "5e12 5e12 5e12"));
  const Outcome flux = scarp("flux " + path("far.obj") + " --rays 1000");
  EXPECT_EQ(flux.exit_code, 2);
  EXPECT_THAT(flux.messages, AllOf(HasSubstr("far.obj: vertex 7"), HasSubstr("scale the mesh")));
}

TEST_F(FluxCommand, BooksWhatPassesThroughAHoleWithEveryEngine) {
  const std::string text = pyramid;
  write("hole.obj", text.substr(0, text.find("f 4 1 5")));
  for (const char* engine : {" --engine forward --rays 30000", " --engine gather"}) {
    const Outcome flux = scarp("flux " + path("hole.obj") + " --json" + engine);
    ASSERT_EQ(flux.exit_code, 0) << engine << flux.messages;
    EXPECT_NEAR(json_of(flux)["lost"].get<double>(), 0.25, 0.02) << engine;
    EXPECT_NEAR(json_of(flux)["balance_error"].get<double>(), 0, 0.02) << engine;
    EXPECT_THAT(flux.messages, ::testing::ContainsRegex("warning: 2[0-9] % of the particles"));
  }
}

// A needle: no ray from its flanks finds the sky. Of a shorter one a few do, so that the
// standard error is as large as what is missing.
TEST_F(FluxCommand, AnAuditThatDoesNotBalanceIsExitThree) {
  for (const char* tip : {"0.5 0.5 2e5", "0.5 0.5 1e3"}) {
    std::string needle = pyramid;
    needle.replace(needle.find("0.5 0.5 0.5"), 11, tip);
    write("needle.obj", needle);
    const Outcome flux =
        scarp("flux " + path("needle.obj") + " --engine gather --rays 32 -o " + path("flux.csv"));
    EXPECT_EQ(flux.exit_code, 3) << tip << flux.messages;
    EXPECT_THAT(flux.messages, HasSubstr("the particles do not balance: ")) << tip;
    EXPECT_FALSE(fs::exists(folder_ / "flux.csv")) << tip;
  }
}

TEST_F(FluxCommand, RefusesASpacingLargerThanTheMesh) {
  write("a.obj", "v 0 0 0\nv 1e-9 0 0\nv 1e-9 1e-9 0\nv 0 1e-9 0\nf 1 2 3\nf 1 3 4\n");
  const Outcome large = scarp("flux " + path("a.obj") + " --spacing 1");
  EXPECT_EQ(large.exit_code, 2);
  EXPECT_THAT(large.messages,
              AllOf(HasSubstr("--spacing 1 is larger than"), HasSubstr("which is 1e-09 wide")));
  EXPECT_EQ(scarp("flux " + path("a.obj") + " --spacing 1e-9").exit_code, 0);
}

TEST_F(FluxCommand, SaysIfMoreRaysThanAskedWereNeeded) {
  write("a.obj", cube(false));
  const std::string line = "flux " + path("a.obj") + " --json ";
  const Outcome gather = scarp(line + "--engine gather --rays 10");
  EXPECT_NEAR(json_of(gather)["rays"].get<double>(), 4096, 50);
  EXPECT_THAT(gather.messages,
              AllOf(HasSubstr(" rays instead of 10:"), HasSubstr("fewer cannot tell their error")));
  EXPECT_THAT(scarp(line + "--engine gather --max-rays 10").messages,
              HasSubstr(" rays instead of 10:"));
  const Outcome forward = scarp(line + "--engine forward --rays 100");
  EXPECT_EQ(json_of(forward)["rays"], 128);
  EXPECT_THAT(forward.messages, HasSubstr("note: 128 rays instead of 100: they come in whole"));
  EXPECT_EQ(scarp(line + "--engine gather --rays 5000").messages, "");
  EXPECT_EQ(scarp(line + "--engine forward --rays 100 --quiet").messages, "");
}

TEST_F(FluxCommand, WarnsWhereTheSpacingOfASimplifiedMeshIsNotGiven) {
  const auto plane = [](const std::vector<int>& nodes) {
    std::string text;
    const auto n = static_cast<int>(nodes.size());
    for (const int y : nodes) {
      for (const int x : nodes) text += fmt::format("v {} {} 0\n", x, y);
    }
    for (int j = 0; j + 1 < n; ++j) {
      for (int i = 0; i + 1 < n; ++i) {
        const int a = j * n + i + 1;
        text += fmt::format("f {0} {1} {3}\nf {0} {3} {2}\n", a, a + 1, a + n, a + n + 1);
      }
    }
    return text;
  };
  write("full.obj", plane({0, 1, 2, 3, 4}));
  write("simplified.obj", plane({0, 1, 2, 3, 9}));
  const auto messages = [&](const std::string& rest) {
    const Outcome flux = scarp("flux " + path(rest));
    EXPECT_EQ(flux.exit_code, 0) << flux.messages;
    return flux.messages;
  };
  EXPECT_EQ(messages("full.obj --rays 5000"), "");
  EXPECT_THAT(messages("simplified.obj --rays 1000"), HasSubstr("--spacing"));
  EXPECT_THAT(messages("simplified.obj --rays 1000 --spacing 1"), Not(HasSubstr("--spacing")));
}

TEST_F(FluxCommand, AFixedNumberOfRaysHasNoTarget) {
  write("a.obj", pyramid);
  EXPECT_TRUE(
      json_of(scarp("flux " + path("a.obj") + " --rays 100 --json"))["target_reached"].is_null());
  EXPECT_EQ(json_of(scarp("flux " + path("a.obj") + " --json"))["target_reached"], true);
}

TEST_F(FluxCommand, BadMeshFilesAreExitTwo) {
  write("empty.obj", "");
  write("cut.obj", "v 0 0 0\nv 1 0 0\nf 1 2 9\n");
  write("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  for (const char* name : {"empty.obj", "cut.obj", "nan.obj", "missing.obj", "a.unknown"}) {
    const Outcome flux = scarp("flux " + path(name) + " --rays 100");
    EXPECT_EQ(flux.exit_code, 2) << name;
    EXPECT_THAT(flux.messages, HasSubstr(name));
  }
}

TEST_F(FluxCommand, ZeroRaysAndStickingOutsideItsRangeAreExitTwo) {
  write("a.obj", pyramid);
  EXPECT_EQ(scarp("flux " + path("a.obj") + " --rays 0").exit_code, 2);
  EXPECT_EQ(scarp("flux " + path("a.obj") + " --rays 100 --sticking 1.5").exit_code, 2);
  EXPECT_EQ(scarp("flux " + path("a.obj") + " --rays 100 --sticking nan").exit_code, 2);
}

}  // namespace
}  // namespace scarp
