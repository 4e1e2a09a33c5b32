// Shapes that are drawn in a cross-section.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "levelset/metrology/cross_section.h"
#include "levelset/operations/layer_steps.h"
#include "levelset/start/shapes.h"

namespace scarp {
namespace {

using testing::HasSubstr;

const Frame profile_slice{.spacing = 1, .cells = {100, 1}, .two_dimensional = true};

Frame periodic_slice() {
  Frame frame = profile_slice;
  frame.boundary[0] = Boundary::periodic;
  return frame;
}

std::vector<double> volumes_with(const ProfileShape& profile, const Frame& frame = profile_slice) {
  return material_volumes(
      build_layers(frame, std::vector<Shape>{WaferShape{.material = 0}, profile}));
}

const Loop trapezium{{-20, -10}, {20, -10}, {12, 30}, {-12, 30}};

TEST(Profile, APolygonAddsWhatWasOpen) {
  // From z = 0 on: 36 wide there, 24 at the top.
  EXPECT_NEAR(volumes_with({.loops = {trapezium}, .material = 1})[1], 30 * 30, 3);
}

TEST(Profile, APolygonCutsWhatIsSolid) {
  EXPECT_NEAR(volumes_with({.loops = {trapezium}})[0], -10 * 38, 3);
}

TEST(Profile, APolygonInAnotherIsAHole) {
  const Loop hole{{-5, 10}, {5, 10}, {5, 20}, {-5, 20}};
  const double left = volumes_with({.loops = {trapezium, hole}, .material = 1})[1];
  EXPECT_NEAR(left, 30 * 30 - 100, 4);
}

TEST(Profile, SlopesAreExact) {
  const Layers layers = build_layers(
      profile_slice,
      std::vector<Shape>{WaferShape{.material = 0}, ProfileShape{{trapezium}, false, 1}});
  // Half way up the wall.
  EXPECT_NEAR(layers.top().distance({14, 0, 20}), 0, 0.01);
  EXPECT_NEAR(layers.top().distance({-14, 0, 20}), 0, 0.01);
}

TEST(Profile, SidesMirrorOrRepeatIt) {
  const Loop box{{40, -5}, {60, -5}, {60, 20}, {40, 20}};
  EXPECT_NEAR(volumes_with({.loops = {box}, .material = 1})[1], 10 * 20, 1);
  EXPECT_NEAR(volumes_with({.loops = {box}, .material = 1}, periodic_slice())[1], 20 * 20, 1);
}

TEST(Profile, BelowALineAllIsSolidAndAboveItNothing) {
  const Loop line{{-60, 10}, {-10, 10}, {0, -20}, {10, 10}, {60, 10}};
  // The notch is 20 wide and 30 deep; below z = 0 it is two thirds of that.
  const double above = 100 * 10 - 10 * (20 + 40.0 / 3) / 2;
  EXPECT_NEAR(volumes_with({.loops = {line}, .is_line = true, .material = 1})[1], above, 4);
  // A cut leaves the wafer below the notch.
  const double notch = 20 * (40.0 / 3) / 2;
  EXPECT_NEAR(volumes_with({.loops = {line}, .is_line = true})[0], -notch, 3);
}

// Its ends may differ in height, or lie beyond the sides: each copy is cut at the sides.
TEST(Profile, SidesRepeatALineAsTheyCutIt) {
  const auto volume = [](const Loop& line) {
    return volumes_with({.loops = {line}, .is_line = true, .material = 1}, periodic_slice())[1];
  };
  // A wall of 15 at the side, between a low half and a high one.
  const Loop step{{-60, 25}, {0, 25}, {0, 10}, {60, 10}};
  EXPECT_NEAR(volume(step), 50 * 25 + 50 * 10, 3);
  // Slopes that go on beyond the sides.
  EXPECT_NEAR(volume({{-90, 50}, {90, 14}}), 100 * 32, 3);
  EXPECT_NEAR(volume({{-50, 20}, {-20, 20}, {-20, 8}, {20, 8}, {20, 19}, {50, 19}}),
              30 * 20 + 40 * 8 + 30 * 19, 3);
  // Rounding at the ends makes no wall.
  EXPECT_NEAR(volume({{-60, 20}, {-20, 20}, {-20, 8}, {20, 8}, {20, 20.00001}, {60, 20.00001}}),
              60 * 20 + 40 * 8, 3);
  EXPECT_EQ(
      check_shapes(periodic_slice(),
                   std::vector<Shape>{WaferShape{.material = 0},
                                      ProfileShape{{{{-60, 20}, {0, 5}, {60, 20.00001}}}, true, 1}})
          .size(),
      0U);
}

std::string problem_of(const ProfileShape& profile, const Frame& frame = profile_slice) {
  const auto problems = check_shapes(frame, std::vector<Shape>{WaferShape{.material = 0}, profile});
  return problems.empty() ? "none" : problems[0].key + ": " + problems[0].message;
}

TEST(Profile, SaysWhatIsWrong) {
  EXPECT_THAT(problem_of({.loops = {trapezium}, .material = 1}), "none");
  EXPECT_THAT(problem_of({.loops = {{{0, 0}, {9, 0}, {0, 9}, {9, 9}}}, .material = 1}),
              HasSubstr("points: edge 1 and edge 3 cross or touch"));
  EXPECT_THAT(problem_of({.loops = {{{0, 0}, {1, 0}, {1, 9}, {0, 9}}}, .material = 1}),
              HasSubstr("points: walls at (0, 0) nm are 1 nm apart"));
  EXPECT_THAT(
      problem_of({.loops = {{{70, 0}, {90, 0}, {90, 9}}}, .material = 1}),
      HasSubstr("points: lies wholly outside the domain, which reaches from x = -50 nm to 50 nm"));
  EXPECT_THAT(
      problem_of({.loops = {trapezium}, .material = 1}, {.spacing = 1, .cells = {100, 100}}),
      HasSubstr("shape: a profile needs mode = \"2d\""));
}

}  // namespace
}  // namespace scarp
