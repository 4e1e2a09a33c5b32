// What scarp compare looks at, and that it tells changes from chance.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "apps/report/comparison.h"
#include "apps/run/common_openings.h"
#include "program.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;

constexpr const char* no_tolerances =
    " --length-cells 0 --length-part 0 --film-cells 0 --film-part 0 --volume-cells 0"
    " --volume-part 0 --mean-distance 0 --p99-distance 0";

class Verdicts : public Program {
 protected:
  /// A ridge on a wafer, of which ions and neutrals take away a part. Units: nm.
  void run_ridge(const std::string& folder, double width, int seed) const {
    write("ridge.toml", R"(
[domain]
spacing = "20 nm"
extent = ["600 nm", "200 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "fin"
material = "Si"
width = "160 nm"
height = "200 nm"
[flux]
rays = 100000
[[step]]
model = "single_particle"
duration = "20 s"
etch_rate = "2 nm/s"
sticking = 0.7
)");
    const Outcome run = scarp("run " + path("ridge.toml") + " --quiet -o " + path(folder) +
                              " --set flux.seed=" + std::to_string(seed) +
                              " --set 'geometry[1].width=\"" + std::to_string(width) + " nm\"'");
    ASSERT_EQ(run.exit_code, 0) << run.messages;
  }

  /// Units: nm.
  void run_film(const std::string& folder, const std::string& thickness) const {
    write("film.toml", R"(
[domain]
spacing = "20 nm"
extent = ["400 nm"]
mode = "2d"
[[geometry]]
shape = "wafer"
material = "Si"
[[step]]
model = "conformal"
material = "SiO2"
thickness = ")" + thickness +
                           " nm\"\n");
    ASSERT_EQ(scarp("run " + path("film.toml") + " --quiet -o " + path(folder)).exit_code, 0);
  }

  static nlohmann::json last(const nlohmann::json& found, const std::string& name) {
    nlohmann::json last;
    for (const nlohmann::json& each : found["metrology"])
      if (each["name"] == name) last = each;
    return last;
  }
};

// 2 % and .1 spacings on the surface, which is 400 nm by one spacing.
TEST_F(Verdicts, VolumesOfFilmsAreJudgedWithoutAnOpening) {
  for (const char* thickness : {"60", "62", "64"}) run_film(thickness, thickness);
  const auto compared = [&](const char* other) {
    return last(
        json_of(scarp("compare " + path("60") + ' ' + path(other) + " --json -o " + path("out"))),
        "SiO2_volume_nm3");
  };
  constexpr double area = 400 * 20;
  const auto thin = compared("62");
  EXPECT_NEAR(thin["tolerance"], area * (0.02 * 60 + 0.1 * 20), 0.01 * area);
  EXPECT_EQ(thin["verdict"], "within");
  EXPECT_EQ(thin["significant"], true);
  EXPECT_EQ(compared("64")["verdict"], "moved");
  EXPECT_EQ(compared("60")["significant"], false);
}

TEST_F(Verdicts, WhatIsRoundedIsTheSameWithoutTolerances) {
  for (const char* thickness : {"60", "60.0001", "60.1"}) run_film(thickness, thickness);
  const auto compare = [&](const char* other) {
    return scarp("compare " + path("60") + ' ' + path(other) + " --json -o " + path("out") +
                 no_tolerances);
  };
  const Outcome rounded = compare("60.0001");
  EXPECT_EQ(rounded.exit_code, 0) << rounded.messages;
  EXPECT_EQ(json_of(rounded)["significant"], false);
  EXPECT_EQ(last(json_of(rounded), "SiO2_volume_nm3")["verdict"], "within");
  EXPECT_EQ(compare("60.1").exit_code, 1);
}

// Free surfaces have volumes and heights; the seeds tell what is chance.
TEST_F(Verdicts, ARidgeThatIsWiderBySomeOfASpacingIsFoundAndIsWithinTheTolerance) {
  for (const int seed : {1, 2, 3, 4, 5, 6}) {
    run_ridge("same_" + std::to_string(seed), 160, seed);
    if (seed > 3) run_ridge("wide_" + std::to_string(seed), 163, seed);
  }
  const auto group = [&](const std::string& name, int first) {
    std::string all;
    for (int n = first; n < first + 3; ++n)
      all += (all.empty() ? "" : ",") + path(name + "_" + std::to_string(n));
    return all;
  };
  const auto compare = [&](const std::string& other, const std::string& more) {
    return scarp("compare " + group("same", 1) + ' ' + other + " --json -o " + path("out") + more);
  };
  const Outcome found = compare(group("wide", 4), no_tolerances);
  EXPECT_EQ(found.exit_code, 1);
  EXPECT_EQ(last(json_of(found), "Si_volume_nm3")["verdict"], "moved");
  EXPECT_EQ(last(json_of(found), "Si_volume_nm3")["first"]["runs"], 3);

  const Outcome usual = compare(group("wide", 4), "");
  EXPECT_EQ(usual.exit_code, 0) << usual.messages;
  EXPECT_EQ(json_of(usual)["significant"], true);
  EXPECT_EQ(last(json_of(usual), "Si_volume_nm3")["verdict"], "within");
  EXPECT_EQ(last(json_of(usual), "Si_volume_nm3")["significant"], true);
  EXPECT_EQ(last(json_of(usual), "highest_nm")["verdict"], "within");

  const Outcome itself = compare(group("same", 4), no_tolerances);
  EXPECT_EQ(itself.exit_code, 0) << itself.messages;
  EXPECT_EQ(json_of(itself)["significant"], false);
}

// Of two trenches, and of the one that they became, no depth stands for the other.
TEST_F(Verdicts, WhatHasMergedIsNotShallow) {
  const std::string domain =
      "[domain]\nspacing = \"20 nm\"\nextent = [\"800 nm\"]\n"
      "mode = \"2d\"\n[[geometry]]\nshape = \"wafer\"\n"
      "material = \"Si\"\n";
  const auto trench = [](const char* center) {
    return std::string("[[geometry]]\nshape = \"trench\"\nwidth = \"160 nm\"\n") +
           "depth = \"300 nm\"\ncenter = \"" + center + " nm\"\n";
  };
  write("two.toml", domain + trench("-110") + trench("110") +
                        "[[step]]\nmodel = \"isotropic\"\nduration = \"20 s\"\n"
                        "etch_rate = \"2 nm/s\"\n[output]\nevery = \"5 s\"\n");
  ASSERT_EQ(scarp("run " + path("two.toml") + " --quiet -o " + path("two")).exit_code, 0);
  const RunRecord run = read_run(path("two"));
  const auto state = [&](std::size_t n) {
    RunRecord one = run;
    one.is_state = true;
    one.outputs = {run.outputs[n]};
    return one;
  };
  const Comparison found = compare({.name = "two", .runs = {state(2)}},
                                   {.name = "one", .runs = {state(4)}}, Tolerances{});
  int depths = 0;
  for (const ComparedValue& each : found.values) {
    if (!each.name.ends_with(" depth_nm")) continue;
    ++depths;
    EXPECT_EQ(each.first.stand_ins + each.second.stand_ins, 0U) << each.name;
    EXPECT_EQ(each.verdict, Verdict::none) << each.name;
  }
  EXPECT_EQ(depths, 3);
}

// A hole grows into its images, until pillars are left.
TEST_F(Verdicts, WhatIsLeftAroundPillarsIsNotShallow) {
  write("hole.toml", R"(
[domain]
spacing = "20 nm"
extent = ["200 nm", "200 nm"]
boundary = ["periodic", "periodic"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "hole"
radius = "75 nm"
depth = "200 nm"
[[step]]
model = "isotropic"
duration = "16 s"
etch_rate = "2 nm/s"
)");
  const Outcome run = scarp("run " + path("hole.toml") + " --quiet -o " + path("hole"));
  ASSERT_EQ(run.exit_code, 0) << run.messages;
  const Outcome found = scarp("compare " + path("hole/state_0000.vdb") + ' ' +
                              path("hole/state_0001.vdb") + " --json -o " + path("out"));
  const auto depth = last(json_of(found), "hole 1 across y depth_nm");
  EXPECT_EQ(depth["first"]["runs"], 1);
  EXPECT_EQ(depth["second"]["runs"], 0);
  EXPECT_EQ(depth["verdict"], "none");
}

// A material that a step takes away counts as a volume of 0 from then on.
TEST_F(Verdicts, AMaterialThatIsGoneHasAVolumeOfNothing) {
  write("film.toml", R"(
[domain]
spacing = "20 nm"
extent = ["400 nm"]
mode = "2d"
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "layer"
material = "SiO2"
thickness = "60 nm"
[[step]]
model = "isotropic"
duration = "10 s"
etch_rate = { SiO2 = "2 nm/s", Si = "0 nm/s" }
)");
  const std::string run = "run " + path("film.toml") + " --quiet -o ";
  ASSERT_EQ(scarp(run + path("left")).exit_code, 0);
  ASSERT_EQ(scarp(run + path("gone") +
                  " --set 'step[0].etch_rate={ SiO2 = \"8 nm/s\", "
                  "Si = \"0 nm/s\" }'")
                .exit_code,
            0);
  const auto found =
      json_of(scarp("compare " + path("left") + ' ' + path("gone") + " --json -o " + path("out")));
  EXPECT_EQ(last(found, "SiO2_volume_nm3")["verdict"], "moved");
  EXPECT_NEAR(last(found, "SiO2_volume_nm3")["second"]["mean"], 0, 1e-3 * 400 * 20 * 40);
}

TEST_F(Verdicts, AContourIsComparedWithOneRun) {
  const Outcome outcome = scarp("compare a,b measured.csv -o " + path("out"));
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.messages, HasSubstr("a,b: a contour is compared with one run"));
}

// Four of twenty failed: an opening that one of three seeds saw had moved.
TEST_F(Verdicts, SlowARecipeIsAsItself) {
  for (int n = 0; n < 20; ++n) {
    const Outcome outcome =
        scarp("compare " + std::string(SCARP_SOURCE_DIR) +
              "/tests/reference/compare/missing_opening.toml --quiet -o " +
              path(std::to_string(n)) + " --set flux.seed=" + std::to_string(101 + 20 * n));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.messages;
  }
}

OpeningMetrology hole_at(int number, double x, double y) {
  return {.opening = number, .centre = {x, y}, .width = {100, 100}};
}

TEST(CommonOpenings, AreThoseAtOnePlace) {
  const Frame frame{
      .spacing = 10, .cells = {100, 100}, .boundary = {Boundary::periodic, Boundary::reflective}};
  CommonOpenings common;
  const auto renamed = [&](std::vector<OpeningMetrology> openings, std::map<int, int>& taken) {
    common.rename(openings, taken, frame);
    std::vector<int> numbers;
    for (const OpeningMetrology& each : openings) numbers.push_back(each.opening);
    return numbers;
  };
  std::map<int, int> first;
  std::map<int, int> second;
  EXPECT_EQ(renamed({hole_at(0, -490, 0), hole_at(1, 0, 0)}, first), (std::vector{0, 1}));
  // Numbered otherwise, and seen on the other side of the period.
  EXPECT_EQ(renamed({hole_at(0, 5, 0), hole_at(1, 495, 10)}, second), (std::vector{1, 0}));
  // What only one has seen.
  EXPECT_EQ(renamed({hole_at(0, 5, 0), hole_at(2, 250, 0)}, second), (std::vector{1, 2}));
  EXPECT_EQ(renamed({hole_at(2, -250, 0), hole_at(3, 240, 0)}, first), (std::vector{3, 2}));
}

}  // namespace
}  // namespace scarp
