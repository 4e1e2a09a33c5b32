#include "levelset/metrology/cross_section.h"

#include <gtest/gtest.h>

#include <numbers>

#include "levelset/operations/layer_steps.h"
#include "levelset/surface/extract_surface.h"
#include "tests/levelset/cross_sections.h"
#include "tests/levelset/surfaces.h"

namespace scarp {
namespace {

TEST(CrossSection, OfATrenchIsOneLineFromSideToSideWithSharpCorners) {
  const Frame frame{.spacing = 0.5, .cells = {40, 10}};
  TrenchShape trench{.width = 6.2};
  trench.cut.depth = 8.1;
  const Layers layers =
      build_layers(frame, std::vector<Shape>{WaferShape{.material = 0},
                                             LayerShape{.material = 1, .thickness = 2.05}, trench});
  for (const double y : {-2.5, 0.13, 2.5}) {
    const auto lines = cross_section(layers, 1, y);
    ASSERT_EQ(lines.size(), 2U);
    ASSERT_EQ(lines[1].size(), 1U);
    const auto& points = lines[1][0].points;
    EXPECT_NEAR(std::abs(points.front()[0]), 10, 1e-9);
    EXPECT_NEAR(points.back()[0], -points.front()[0], 1e-9);
    for (const double x : {-3.1, 3.1}) {
      for (const double z : {2.05, -6.05}) {
        double nearest = 1e300;
        for (const auto& [px, pz] : points) {
          nearest = std::min(nearest, std::hypot(px - x, pz - z));
        }
        EXPECT_LT(nearest, 0.05) << x << " " << z;
      }
    }
  }
}

TEST(CrossSection, KeepsTheGasOnTheLeftAndClosesLoops) {
  const Frame frame{.spacing = 0.5, .cells = {40, 40}};
  const Layers ball = single_layer(
      frame, [](Vec3d r) { return length(r) - 6.3; }, -7, 7);
  for (const int axis : {0, 1}) {
    const auto lines = cross_section(extract_surface(ball.top()), axis, 2.2);
    ASSERT_EQ(lines.size(), 1U);
    const auto& points = lines[0].points;
    EXPECT_EQ(points.front(), points.back());
    double area = 0;
    for (std::size_t n = 0; n + 1 < points.size(); ++n) {
      area += 0.5 * (points[n][0] * points[n + 1][1] - points[n + 1][0] * points[n][1]);
    }
    // Solid on the right: clockwise around the ball.
    const double exact = std::numbers::pi * (6.3 * 6.3 - 2.2 * 2.2);
    EXPECT_NEAR(area, -exact, 0.02 * exact) << "axis " << axis;
  }
}

TEST(CrossSection, ThroughVerticesHasNoPointTwice) {
  TriMesh square;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      square.vertices.push_back({static_cast<float>(x), static_cast<float>(y), 0});
  for (const std::uint32_t corner : {0U, 1U, 3U, 4U}) {
    square.triangles.push_back({corner, corner + 3, corner + 4});
    square.triangles.push_back({corner, corner + 4, corner + 1});
  }
  for (const int axis : {0, 1}) {
    const auto lines = cross_section(square, axis, 0);
    ASSERT_EQ(lines.size(), 1U);
    EXPECT_EQ(lines[0].points.size(), 3U) << "axis " << axis;
  }
}

TEST(CrossSection, HasNoLineOfAMaterialThatIsAbsent) {
  Layers layers = build_layers({.spacing = 0.5, .cells = {40, 10}},
                               std::vector<Shape>{WaferShape{.material = 0}});
  add_layer(layers, 1);
  const auto absent = cross_section(layers, 1, 0);
  ASSERT_EQ(absent.size(), 2U);
  EXPECT_EQ(absent[0].size(), 1U);
  EXPECT_TRUE(absent[1].empty());
  coat(layers, 0.1);
  EXPECT_EQ(cross_section(layers, 1, 0)[1].size(), 1U);
}

TEST(CrossSection, AlongAnyLineIsThatOfTheTurnedBody) {
  const Frame frame{.spacing = 0.5, .cells = {40, 40}};
  const Layers ball = single_layer(
      frame, [](Vec3d r) { return length(r) - 6.3; }, -7, 7);
  for (const double angle : {0.3, 1.9, 4.0}) {
    const std::array<double, 2> along{std::cos(angle), std::sin(angle)};
    // Beside the middle by 2.2, to the left.
    const CutPlane plane{.origin = {-2.2 * along[1] - 3 * along[0], 2.2 * along[0] - 3 * along[1]},
                         .along = along};
    const auto lines = cross_section(extract_surface(ball.top()), plane);
    ASSERT_EQ(lines.size(), 1U);
    const double exact = std::numbers::pi * (6.3 * 6.3 - 2.2 * 2.2);
    EXPECT_NEAR(area_above_zero(lines), exact, 0.02 * exact);
    for (const auto& [lateral, z] : lines[0].points) {
      EXPECT_NEAR(std::hypot(lateral - 3, z), std::sqrt(exact / std::numbers::pi), 0.05);
      const auto [x, y] = plane.place(lateral);
      EXPECT_NEAR(std::hypot(std::hypot(x, y), z), 6.3, 0.05);
    }
  }
}

TEST(CrossSection, IsGoneOnWithBeyondTheSides) {
  // A groove that the left side halves, and a void that the right one halves.
  const std::vector<Polyline> lines{{.points = {{-10, -6}, {-7, -6}, {-7, 0}, {10, 0}}},
                                    {.points = {{10, -2}, {8, -4}, {10, -6}}}};
  const auto mirrored = with_surroundings(lines, -10, 10, Boundary::reflective);
  // The surface over three widths; three halves of the void: one whole, one in each copy.
  ASSERT_EQ(mirrored.size(), 3U);
  double area = 0;
  std::size_t closed = 0;
  for (const Polyline& line : mirrored) {
    area += area_above_zero(std::span(&line, 1));
    closed += line.points.front() == line.points.back() ? 1 : 0;
    if (line.points.size() < 6) continue;
    EXPECT_EQ(std::abs(line.points.front()[0]), 30);
    EXPECT_EQ(line.points.back()[0], -line.points.front()[0]);
  }
  EXPECT_EQ(closed, 1U);
  EXPECT_NEAR(area, -3 * (18 + 4), 1e-12);

  const std::vector<Polyline> step{{.points = {{-10, 2}, {0, 2}, {0, 5}, {10, 2}}}};
  const auto wrapped = with_surroundings(step, -10, 10, Boundary::periodic);
  ASSERT_EQ(wrapped.size(), 1U);
  EXPECT_EQ(wrapped[0].points.size(), 10U);
  EXPECT_EQ(wrapped[0].points.front(), (std::array<double, 2>{-30, 2}));
}

TEST(CrossSection, IsClippedToARange) {
  // In, out over the right end, back in; and one that is beyond the left end.
  const std::vector<Polyline> lines{{.points = {{0, 0}, {4, 4}, {8, 0}, {6, -2}, {2, -2}}},
                                    {.points = {{-9, 1}, {-5, 1}}}};
  const auto kept = clipped(lines, -1, 7);
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_EQ(kept[0].points, (std::vector<std::array<double, 2>>{{0, 0}, {4, 4}, {7, 1}}));
  EXPECT_EQ(kept[1].points, (std::vector<std::array<double, 2>>{{7, -1}, {6, -2}, {2, -2}}));
}

TEST(MaterialVolumes, AreExactForBoxes) {
  const Frame frame{.spacing = 1, .cells = {30, 20}};
  const Layers layers = build_layers(
      frame,
      std::vector<Shape>{
          WaferShape{.material = 0}, LayerShape{.material = 1, .thickness = 3.4},
          MaskShape{.material = 2, .thickness = 6.7, .outline = SlotOutline{.width = 11.6}}});
  const std::vector<double> volumes = material_volumes(layers);
  EXPECT_NEAR(volumes[1], 30 * 20 * 3.4, 2);
  EXPECT_NEAR(volumes[2], (30 - 11.6) * 20 * 6.7, 2);
}

}  // namespace
}  // namespace scarp
