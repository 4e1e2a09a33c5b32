#include "levelset/metrology/metrology.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "core/parallel.h"
#include "levelset/operations/layer_steps.h"
#include "tests/levelset/contours.h"

namespace scarp {
namespace {

constexpr double h = 2.5;  // nm
constexpr double degree = std::numbers::pi / 180;
constexpr double cells = 0.1;    // what a length may be off by, in spacings
constexpr double degrees = 0.2;  // and an angle

constexpr Frame plane{.spacing = h, .cells = {64, 1}, .two_dimensional = true};

/// Where the surface lies between the nodes, in spacings: eighths in x and z.
std::array<double, 2> offset(int n) { return {n / 8.0, (3 * n % 8) / 8.0}; }

Layers stack_of(const Frame& frame, const std::vector<ContourPoints>& contours,
                std::array<double, 2> shift) {
  Layers layers{.frame = frame, .stack = {}};
  MaterialId material = 0;
  for (const ContourPoints& contour : contours)
    layers.stack.push_back({material++, solid_below(frame, contour, shift)});
  return layers;
}

/// What is expected of an opening. Units: spacings, degrees.
struct Expected {
  const char* name;
  std::optional<double> OpeningMetrology::*member;
  double value;
  bool is_angle = false;
};

Expected angle(const char* name, std::optional<double> OpeningMetrology::*member, double value) {
  return {.name = name, .member = member, .value = value, .is_angle = true};
}

struct AnalyticShape {
  std::string name;
  ContourPoints contour;
  std::vector<Expected> expected;
};

using M = OpeningMetrology;

/// A trench 24 wide at the top and 60 deep whose walls lean by an angle.
AnalyticShape leaning(const char* name, double wall_angle) {
  const double slope = 1 / std::tan(wall_angle * degree);
  const auto cd = [=](double part) { return 24 - 2 * 60 * part * slope; };
  AnalyticShape shape{.name = name,
                      .contour = symmetric({{-12, 0}, {-cd(1) / 2, -60}}),
                      .expected = {{"depth", &M::depth, 60},
                                   {"top", &M::top_cd, cd(0.1)},
                                   {"middle", &M::middle_cd, cd(0.5)},
                                   {"bottom", &M::bottom_cd, cd(0.9)},
                                   {"neck", &M::neck_cd, wall_angle > 90 ? cd(0) : cd(0.9)},
                                   {"bow", &M::bow, wall_angle > 90 ? cd(1) - cd(0.1) : 0},
                                   angle("angle", &M::sidewall_angle, wall_angle),
                                   {"roughness", &M::wall_roughness, 0},
                                   {"micro trenching", &M::micro_trenching, 0},
                                   {"facet", &M::facet_width, 0}}};
  return shape;
}

/// Walls are arcs of a radius about points at 0.4 of the depth, the trench is 26 wide there.
AnalyticShape bowed() {
  const double radius = 120;
  const double centre = -24;
  const auto cd = [=](double z) {
    return 26 - 2 * (radius - std::sqrt(radius * radius - (z - centre) * (z - centre)));
  };
  ContourPoints left;
  for (int n = 0; n <= 60; ++n) left.push_back({-cd(-n) / 2, -1.0 * n});
  return {.name = "bowed",
          .contour = symmetric(left),
          .expected = {{"depth", &M::depth, 60},
                       {"top", &M::top_cd, cd(-6)},
                       {"middle", &M::middle_cd, cd(-30)},
                       {"bottom", &M::bottom_cd, cd(-54)},
                       {"bow", &M::bow, 26 - cd(-6)},
                       {"bow depth", &M::bow_depth, 24}}};
}

/// Arcs of radius 8 at a pitch of 12, above a ridge on the floor that is no part of the walls.
AnalyticShape scalloped() {
  const double half = std::asin(6.0 / 8) / degree;
  ContourPoints left;
  for (int n = 0; n < 6; ++n) {
    const ContourPoints scallop = arc(-8, -6.0 - 12 * n, 8, 180 - half, 180 + half);
    left.insert(left.end(), scallop.begin() + (n == 0 ? 0 : 1), scallop.end());
  }
  left.insert(left.end(), {{-3, -72}, {-2, -44}});
  return {.name = "scalloped",
          .contour = symmetric(left),
          .expected = {{"depth", &M::depth, 72},
                       {"pitch", &M::scallop_pitch, 12},
                       {"amplitude", &M::scallop_amplitude, 8 - std::sqrt(64.0 - 36)},
                       angle("angle", &M::sidewall_angle, 90)}};
}

/// A corner cut off at 45 degrees, 5 wide, and grooves 4 deep along the foot of the walls.
AnalyticShape faceted() {
  return {.name = "faceted",
          .contour = symmetric({{-17, 0}, {-12, -5}, {-12, -60}, {-9, -60}, {-6, -56}}),
          .expected = {{"depth", &M::depth, 60},
                       {"facet", &M::facet_width, 5},
                       {"micro trenching", &M::micro_trenching, 4},
                       angle("angle", &M::sidewall_angle, 90)}};
}

/// Grooves along the foot of the walls that leave a ridge of an eighth of the depth.
AnalyticShape trenched() {
  return {.name = "trenched",
          .contour = symmetric({{-14, 0}, {-12, -64}, {-8, -64}, {-5, -56}}),
          .expected = {{"depth", &M::depth, 64},
                       {"bottom", &M::bottom_cd, 24.4},
                       {"neck", &M::neck_cd, 24.4},
                       {"micro trenching", &M::micro_trenching, 8}}};
}

/// An edge rounded with a radius of 12.
AnalyticShape rounded() {
  ContourPoints left = arc(-24, -12, 12, 90, 0);
  left.push_back({-12, -60});
  return {.name = "rounded",
          .contour = symmetric(left),
          .expected = {{"depth", &M::depth, 60},
                       {"facet", &M::facet_width, 12 * std::numbers::sqrt2 / 2},
                       angle("angle", &M::sidewall_angle, 90)}};
}

/// Jar: a neck 10 wide and 12 long above a belly 30 wide.
AnalyticShape jar() {
  return {.name = "jar",
          .contour = symmetric({{-5, 0}, {-5, -12}, {-15, -22}, {-15, -60}}),
          .expected = {{"depth", &M::depth, 60},
                       {"top", &M::top_cd, 10},
                       {"middle", &M::middle_cd, 30},
                       {"neck", &M::neck_cd, 10},
                       {"bow", &M::bow, 20}}};
}

// NOLINTNEXTLINE(readability-identifier-naming): GoogleTest calls it
void PrintTo(const AnalyticShape& shape, std::ostream* out) { *out << shape.name; }

void expect(const OpeningMetrology& found, const std::vector<Expected>& expected,
            const std::string& where) {
  for (const Expected& each : expected) {
    const std::optional<double> value = found.*each.member;
    ASSERT_TRUE(value) << each.name << where;
    if (each.is_angle) {
      EXPECT_NEAR(*value / degree, each.value, degrees) << each.name << where;
    } else {
      EXPECT_NEAR(*value / h, each.value, cells) << each.name << where;
    }
  }
}

class Analytic : public ::testing::TestWithParam<AnalyticShape> {};

TEST_P(Analytic, IsMeasuredWithinATenthOfASpacingWhereverItLiesBetweenNodes) {
  for (int n = 0; n < 8; ++n) {
    const Metrology found = measure(stack_of(plane, {GetParam().contour}, offset(n)));
    ASSERT_EQ(found.openings.size(), 1U) << n;
    expect(found.openings[0], GetParam().expected, " at offset " + std::to_string(n));
    EXPECT_NEAR(found.openings[0].centre[0], h * n / 8, h) << n;
  }
}

INSTANTIATE_TEST_SUITE_P(Metrology, Analytic,
                         ::testing::Values(leaning("tapered", 86), leaning("upright", 90),
                                           leaning("reentrant", 94), bowed(), scalloped(),
                                           faceted(), trenched(), rounded(), jar()),
                         [](const auto& info) { return info.param.name; });

// Walls that lean differently above and below a kink, and on either side.
TEST(Metrology, HasAnglesOfBothWallsAtHeights) {
  const double upper = 5;  // degrees from the vertical
  const double lower = 12;
  const double at_kink = -12 + 30 * std::tan(upper * degree);
  const ContourPoints contour{
      {-12, 0}, {at_kink, -30}, {at_kink + 30 * std::tan(lower * degree), -60}, {14, -60}, {14, 0}};
  for (int n = 0; n < 8; ++n) {
    const auto [dx, dz] = offset(n);
    MetrologyOptions options;
    options.angle_heights = {h * (dz - 15), h * (dz - 45), h * (dz - 59.9)};
    const Metrology found = measure(stack_of(plane, {contour}, offset(n)), options);
    ASSERT_EQ(found.openings.size(), 1U) << n;
    const auto& angles = found.openings[0].angle_at;
    ASSERT_EQ(angles.size(), 3U);
    for (const auto& [which, expected] : {std::pair(0, 90 - upper), std::pair(1, 90 - lower)}) {
      ASSERT_TRUE(angles[static_cast<std::size_t>(which)][0]) << n;
      EXPECT_NEAR(*angles[static_cast<std::size_t>(which)][0] / degree, expected, 1) << n;
      EXPECT_NEAR(*angles[static_cast<std::size_t>(which)][1] / degree, 90, 1) << n;
    }
    EXPECT_FALSE(angles[2][0]) << "below the floor";
  }
}

/// A body of revolution or a trench in space: cells enough for holes 24 wide.
constexpr Frame space{.spacing = h, .cells = {44, 40}};

/// The contour turned about an upright axis, at a place in spacings.
Layers hole_in(const Frame& frame, const ContourPoints& contour, std::array<double, 2> place,
               double lift) {
  double lowest = 0;
  for (const auto& [x, z] : contour) lowest = std::min(lowest, z);
  Layers layers{.frame = frame, .stack = {}};
  layers.stack.push_back({0, LevelSet(
                                 frame,
                                 [=](Vec3d r) {
                                   const double away =
                                       std::hypot(r.x / h - place[0], r.y / h - place[1]);
                                   return h * distance_to(contour, away, r.z / h - lift);
                                 },
                                 h * (lowest + lift - 5), h * (lift + 5))});
  return layers;
}

TEST(Metrology, OfHolesIsThatOfTheirSectionsAlongBothAxes) {
  for (const double wall : {86.0, 94.0}) {
    const double slope = 1 / std::tan(wall * degree);
    const ContourPoints right{{10 - 40 * slope, -40}, {10, 0}};
    for (int n = 0; n < 8; ++n) {
      const auto [dx, dz] = offset(n);
      const Metrology found = measure(hole_in(space, right, {dx - 3, 2 - dz}, dz));
      ASSERT_EQ(found.openings.size(), 2U) << n;
      for (const OpeningMetrology& each : found.openings) {
        EXPECT_FALSE(each.is_trench);
        EXPECT_EQ(each.section_count, 1);
        EXPECT_NEAR(each.centre[0] / h, dx - 3, 0.3) << n;
        EXPECT_NEAR(each.centre[1] / h, 2 - dz, 0.3) << n;
        expect(each,
               {{"depth", &M::depth, 40},
                {"top", &M::top_cd, 20 - 8 * slope},
                {"middle", &M::middle_cd, 20 - 40 * slope},
                {"bottom", &M::bottom_cd, 20 - 72 * slope},
                angle("angle", &M::sidewall_angle, wall)},
               " at offset " + std::to_string(n));
      }
    }
  }
}

// The right half of a trench's contour, turned about the middle of the trench.
TEST(Metrology, OfHolesIsThatOfTrenchesWithTheSameSection) {
  for (const AnalyticShape& shape : {bowed(), scalloped(), jar(), leaning("tapered", 86)}) {
    const auto half = static_cast<std::ptrdiff_t>(shape.contour.size() / 2);
    const ContourPoints right(shape.contour.begin() + half, shape.contour.end());
    for (int n = 0; n < 8; ++n) {
      const auto [dx, dz] = offset(n);
      const Metrology found = measure(hole_in(space, right, {dx - 3, 2 - dz}, dz));
      ASSERT_EQ(found.openings.size(), 2U) << shape.name << n;
      for (const OpeningMetrology& each : found.openings)
        expect(each, shape.expected, " of " + shape.name + " at offset " + std::to_string(n));
    }
  }
}

TEST(Metrology, OfAHoleThatSidesCutIsThatOfTheWholeHole) {
  const ContourPoints right{{10, -30}, {10, 0}};
  const Metrology found = measure(hole_in(space, right, {-22, 20}, 0.3));
  ASSERT_EQ(found.openings.size(), 2U);
  for (const OpeningMetrology& each : found.openings) {
    EXPECT_EQ(each.centre, (std::array<double, 2>{-22 * h, 20 * h}));
    expect(each, {{"depth", &M::depth, 30}, {"middle", &M::middle_cd, 20}}, "");
  }
}

// With its middle on either side of the domain's.
TEST(Metrology, OfAHoleAcrossPeriodicSidesIsThatOfTheWholeHole) {
  Frame frame = space;
  frame.boundary = {Boundary::periodic, Boundary::periodic};
  for (const int axis : {0, 1}) {
    for (const int direction : {-1, 1}) {
      std::array<double, 2> place{0.3, 0.3};
      place[static_cast<std::size_t>(axis)] = direction * (0.5 * frame.cells[axis] - 3.3);
      Layers layers{.frame = frame, .stack = {}};
      layers.stack.push_back(
          {0, LevelSet(
                  frame,
                  [&](Vec3d r) {
                    double x = r.x / h - place[0];
                    double y = r.y / h - place[1];
                    x = std::remainder(x, frame.cells[0]);
                    y = std::remainder(y, frame.cells[1]);
                    return h *
                           std::max(r.z / h - 0.3, std::min(10 - std::hypot(x, y), r.z / h + 29.7));
                  },
                  -36 * h, 6 * h, 1.2)});
      const Metrology found = measure(layers);
      ASSERT_EQ(found.openings.size(), 2U);
      for (const OpeningMetrology& each : found.openings)
        expect(each,
               {{"depth", &M::depth, 30},
                {"middle", &M::middle_cd, 20},
                angle("left", &M::left_angle, 90),
                angle("right", &M::right_angle, 90)},
               " along " + std::to_string(axis) + " at " + std::to_string(direction));
    }
  }
}

/// A trench along an axis whose walls come and go by a wave, in spacings.
Layers wavy_trench(const Frame& frame, int along, double centre, double amplitude) {
  Layers layers{.frame = frame, .stack = {}};
  const double waves = 2 * std::numbers::pi / (frame.cells[along] / 2.0);
  layers.stack.push_back(
      {0, LevelSet(
              frame,
              [=](Vec3d r) {
                const double half = 8 + 0.5 * amplitude * std::cos(waves * (r[along] / h + 0.37));
                const double width = frame.cells[1 - along];
                double across = r[1 - along] / h - centre;
                if (frame.boundary[1 - along] == Boundary::periodic)
                  across -= width * std::round(across / width);
                return h *
                       std::max(r.z / h - 0.2, std::min(half - std::abs(across), r.z / h + 24.8));
              },
              -30 * h, 6 * h, 1.2)});
  return layers;
}

TEST(Metrology, OfTrenchesIsTheMeanAlongThemAndTheirRoughnessThreeSigma) {
  for (const int along : {0, 1}) {
    for (const Boundary boundary : {Boundary::reflective, Boundary::periodic}) {
      Frame frame = space;
      frame.boundary = {boundary, boundary};
      // On a side: mirrored or wrapped.
      const double centre = 0.5 * frame.cells[1 - along];
      const Metrology found = measure(wavy_trench(frame, along, centre, 1.5));
      ASSERT_EQ(found.openings.size(), 1U) << along;
      const OpeningMetrology& trench = found.openings[0];
      EXPECT_TRUE(trench.is_trench);
      EXPECT_EQ(trench.axis, along);
      EXPECT_EQ(trench.section_count, frame.cells[along]);
      EXPECT_EQ(trench.centre[along], 0);
      EXPECT_NEAR(std::abs(trench.centre[1 - along]), centre * h, 0.3 * h);
      expect(trench,
             {{"depth", &M::depth, 25},
              {"middle", &M::middle_cd, 16},
              {"line width roughness", &M::line_width_roughness, 3 * 1.5 / std::sqrt(2.0)}},
             " along axis " + std::to_string(along));
    }
  }
}

TEST(Metrology, OfFewerThanEightSectionsThereIsNoRoughness) {
  for (const int sections : {7, 8}) {
    Frame frame = space;
    frame.cells[1] = sections;
    const Metrology found = measure(wavy_trench(frame, 1, 0, 1.5));
    ASSERT_EQ(found.openings.size(), 1U);
    EXPECT_EQ(found.openings[0].section_count, sections);
    EXPECT_EQ(found.openings[0].line_width_roughness.has_value(), sections == 8);
  }
}

/// Silicon etched by 10 to all sides below a mask with an opening of 12, and the mask on it.
std::vector<ContourPoints> undercut_mask(double thickness) {
  ContourPoints silicon = arc(-6, 0, 10, 180, 270);
  ContourPoints mask = silicon;
  silicon.insert(silicon.begin(), {-30, 0});
  const ContourPoints above{{-30, thickness}, {-6, thickness}, {-6, 0}};
  mask.insert(mask.begin(), above.begin(), above.end());
  return {symmetric(silicon), symmetric(mask)};
}

TEST(Metrology, OfMasksIsThatOfTheStructureBelowAndOfWhatTheMaskHasLost) {
  const MetrologyOptions options{.masks = {1}, .cd_heights = {4 * h, -6 * h}};
  for (int n = 0; n < 8; ++n) {
    const ContourPoints flat{{-30, 0}, {30, 0}};
    const ContourPoints mask = symmetric({{-6, 9}, {-6, 0}});
    const Metrology start = measure(stack_of(plane, {flat, mask}, offset(n)), options);
    ASSERT_EQ(start.openings.size(), 1U);
    EXPECT_FALSE(start.openings[0].depth);
    EXPECT_NEAR(*start.openings[0].mask_thickness / h, 9, 0.1);

    const Metrology found = measure(stack_of(plane, undercut_mask(7), offset(n)), options, &start);
    ASSERT_EQ(found.openings.size(), 1U);
    const OpeningMetrology& trench = found.openings[0];
    expect(trench,
           {{"depth", &M::depth, 10},
            {"middle", &M::middle_cd, 12 + 2 * std::sqrt(75.0)},
            {"undercut", &M::undercut, 10},
            {"mask", &M::mask_thickness, 7},
            {"mask loss", &M::mask_loss, 2},
            {"etched", &M::etched_depth, 10}},
           " at offset " + std::to_string(n));
    EXPECT_NEAR(*trench.selectivity, *trench.etched_depth / *trench.mask_loss, 1e-9);
    EXPECT_NEAR(*trench.cd_at[0] / h, 12, 0.1);
    const double depth = 6 + offset(n)[1];
    EXPECT_NEAR(*trench.cd_at[1] / h, 12 + 2 * std::sqrt(100 - depth * depth), 0.1);
  }
}

// Where feet of walls were rounded, half a spacing and (5 micro-trenches + 6 spacings) spacings by
// the floor's width, and no more than the depth.
TEST(Metrology, StatesTheErrorOfRoundedFeetWhereThereAreSome) {
  const ContourPoints grooves = symmetric({{-14, 0}, {-12, -64}, {-8, -64}, {-5, -56}});
  const ContourPoints slit = symmetric({{-1.5, 0}, {-1.5, -3}});
  for (int n = 0; n < 8; ++n) {
    const Layers layers = stack_of(plane, {grooves}, offset(n));
    const Metrology sharp = measure(layers);
    ASSERT_EQ(sharp.openings.size(), 1U);
    EXPECT_FALSE(sharp.openings[0].depth_error);
    EXPECT_FALSE(sharp.openings[0].micro_trenching_error);
    EXPECT_FALSE(sharp.lowest_error);

    const Metrology rounded = measure(layers, {.feet_are_rounded = true});
    const double error = 0.5 + (5 * 8 + 6) / 24.4;
    expect(
        rounded.openings.at(0),
        {{"depth", &M::depth_error, error}, {"micro trenching", &M::micro_trenching_error, error}},
        " at offset " + std::to_string(n));
    EXPECT_EQ(rounded.lowest_error, rounded.openings[0].depth_error);
    const Metrology narrow =
        measure(stack_of(plane, {slit}, offset(n)), {.feet_are_rounded = true});
    for (const OpeningMetrology& each : narrow.openings) EXPECT_LE(*each.depth_error, *each.depth);
  }
}

TEST(Metrology, UndercutsOfLeaningWallsAreThoseAtTheInterface) {
  // 4 beyond the foot of a mask that leans by 60 degrees, above walls that lean as much.
  const double slope = 1 / std::sqrt(3.0);
  const ContourPoints groove{{-18, 0}, {-18 + 20 * slope, -20}};
  const ContourPoints mask{{-14 - 8 * slope, 8}, {-14, 0}, {-18, 0}, {-18 + 20 * slope, -20}};
  for (int n = 0; n < 8; ++n) {
    const Metrology found =
        measure(stack_of(plane, {symmetric(groove), symmetric(mask)}, offset(n)), {.masks = {1}});
    ASSERT_EQ(found.openings.size(), 1U);
    expect(found.openings[0], {{"undercut", &M::undercut, 4}}, " at offset " + std::to_string(n));
  }
}

TEST(Metrology, OfFilmsIsThatOfEachMaterialOnTopOnTheWallAndAtTheBottom) {
  // Two films of one material, each 4 on top, 2 on the wall, 3 at the bottom; of another one in
  // between that is the same everywhere.
  const auto box = [](double top, double half, double bottom) {
    return symmetric({{-half, top}, {-half, bottom}});
  };
  for (int n = 0; n < 8; ++n) {
    const Layers layers = [&] {
      Layers stack = stack_of(
          plane, {box(0, 16, -40), box(4, 14, -37), box(6, 12, -35), box(10, 10, -32)}, offset(n));
      stack.stack[3].material = 1;
      return stack;
    }();
    const Metrology found = measure(layers);
    ASSERT_EQ(found.openings.size(), 1U);
    const std::vector<FilmMetrology>& films = found.openings[0].films;
    ASSERT_EQ(films.size(), 2U);
    EXPECT_EQ(films[0].material, 1);
    EXPECT_NEAR(*films[0].top / h, 8, 0.1);
    EXPECT_NEAR(*films[0].wall / h, 4, 0.1);
    EXPECT_NEAR(*films[0].bottom / h, 6, 0.1);
    EXPECT_NEAR(*films[0].step_coverage, 0.75, 0.02);
    EXPECT_NEAR(*films[0].wall_coverage, 0.5, 0.02);
    EXPECT_FALSE(films[0].conformality);  // it is two films
    EXPECT_NEAR(*films[1].wall / h, 2, 0.1);
    EXPECT_NEAR(*films[1].step_coverage, 1, 0.05);
    EXPECT_NEAR(*films[1].conformality, 1 / std::sqrt(2.0), 0.05);  // square corners
  }
}

TEST(Metrology, OfFilmsBelowAHundredthOfASpacingThereAreNoRatios) {
  const auto box = [](double film) { return symmetric({{-16 + film, film}, {-16 + film, -40}}); };
  for (const double thickness : {0.007, 0.015}) {
    const Layers layers = stack_of(plane, {box(0), box(thickness)}, {0.3, 0.6});
    const FilmMetrology film = measure(layers).openings.at(0).films.at(0);
    EXPECT_NEAR(*film.top / h, thickness, 1e-3);
    EXPECT_NEAR(*film.wall / h, thickness, 1e-3);
    EXPECT_EQ(film.wall_coverage.has_value(), thickness > 0.01);
    EXPECT_EQ(film.conformality.has_value(), thickness > 0.01);
  }
}

TEST(Metrology, OfAConformalFilmIsTheSameEverywhere) {
  Layers layers = stack_of(plane, {symmetric({{-12, 0}, {-12, -40}})}, {0.3, 0.6});
  add_layer(layers, 4);
  coat(layers, 5.2 * h);
  const FilmMetrology film = measure(layers).openings.at(0).films.at(0);
  for (const auto member : {&FilmMetrology::top, &FilmMetrology::wall, &FilmMetrology::bottom})
    EXPECT_NEAR(*(film.*member) / h, 5.2, 0.1);
  EXPECT_NEAR(*film.conformality, 1, 0.02);
}

TEST(Metrology, TellsHowMuchShallowerNarrowOpeningsAre) {
  const ContourPoints left = symmetric({{-4, 0}, {-4, -20}});
  ContourPoints both;
  for (const auto& [x, z] : left) both.push_back({x - 14, z});
  for (const auto& [x, z] : symmetric({{-8, 0}, {-8, -25}})) both.push_back({x + 10, z});
  const Metrology found = measure(stack_of(plane, {both}, {0.2, 0.7}));
  ASSERT_EQ(found.openings.size(), 2U);
  EXPECT_EQ(found.openings[0].opening, 0);
  EXPECT_EQ(found.openings[1].opening, 1);
  expect(found.openings[0], {{"depth", &M::depth, 20}, {"top", &M::top_cd, 8}}, " left");
  expect(found.openings[1], {{"depth", &M::depth, 25}, {"top", &M::top_cd, 16}}, " right");
  EXPECT_NEAR(*found.openings[0].arde_lag, 0.2, 0.01);
  EXPECT_EQ(*found.openings[1].arde_lag, 0);
}

TEST(Metrology, OfAVoidIsItsAreaVolumeAndHeight) {
  for (int n = 0; n < 8; ++n) {
    const auto [dx, dz] = offset(n);
    const Vec3d centre{(dx + 2) * h, (1 - dz) * h, (dz - 12) * h};
    for (const bool flat : {true, false}) {
      Layers layers{.frame = flat ? plane : space, .stack = {}};
      layers.stack.push_back({0, LevelSet(
                                     layers.frame,
                                     [=, top = dz * h](Vec3d r) {
                                       Vec3d away = r - centre;
                                       if (flat) away.y = 0;
                                       return std::max(r.z - top, 7 * h - length(away));
                                     },
                                     -26 * h, 6 * h)});
      const Metrology found = measure(layers);
      EXPECT_TRUE(found.openings.empty());
      ASSERT_EQ(found.voids.size(), 1U);
      const VoidMetrology& bubble = found.voids[0];
      EXPECT_NEAR(bubble.centre.x / h, dx + 2, 0.1);
      EXPECT_NEAR(bubble.centre.z / h, dz - 12, 0.1);
      EXPECT_NEAR((bubble.upper - bubble.lower) / h, 14, 0.1);
      const double pi = std::numbers::pi;
      EXPECT_NEAR(std::sqrt(bubble.area / pi) / h, 7, 0.1) << n;
      const double volume = flat ? pi * 49 : 4 * pi / 3 * 343;
      EXPECT_NEAR(bubble.volume / (h * h * h), volume, 0.01 * volume) << n;
      EXPECT_NEAR(found.lowest / h, dz, 0.01);
    }
  }
}

TEST(Metrology, OfASurfaceWithoutOpeningsIsItsRoughness) {
  Layers layers{.frame = plane, .stack = {}};
  layers.stack.push_back(
      {0,
       LevelSet(
           plane,
           [](Vec3d r) { return r.z - 0.5 * h * std::sin(2 * std::numbers::pi * r.x / (16 * h)); },
           -6 * h, 6 * h, 1.1)});
  const Metrology found = measure(layers);
  EXPECT_NEAR(*found.surface_roughness / h, 0.5 / std::sqrt(2.0), 0.02);
  EXPECT_NEAR(found.highest / h, 0.5, 0.02);
  EXPECT_NEAR(found.lowest / h, -0.5, 0.02);
}

// A film 14 thick at the bottom and 5 on the field, with a void of 6 by 4 in the middle of the
// former.
TEST(Metrology, AVoidDoesNotCountAsFilm) {
  const ContourPoints trench{{-12, 0}, {-12, -40}, {12, -40}, {12, 0}};
  const ContourPoints film{{-8, 5}, {-8, -26}, {8, -26}, {8, 5}};
  Layers layers = stack_of(plane, {trench}, {});
  layers.stack.push_back(
      {1, LevelSet(
              plane,
              [&](Vec3d r) {
                const double bubble = std::max(std::abs(r.x / h) - 3, std::abs(r.z / h + 34) - 2);
                return h * std::max(distance_to(film, r.x / h, r.z / h), -bubble);
              },
              -50 * h, 15 * h)});
  const Metrology found = measure(layers);
  ASSERT_EQ(found.openings.size(), 1U);
  ASSERT_EQ(found.voids.size(), 1U);
  const FilmMetrology& lining = found.openings[0].films.at(0);
  EXPECT_NEAR(*lining.bottom / h, 14 - 4, 0.1);
  EXPECT_NEAR(*lining.top / h, 5, 0.1);
}

TEST(Metrology, SumsVolumesByMaterial) {
  const ContourPoints flat{{-30, 0}, {30, 0}};
  const auto at = [](double z) { return ContourPoints{{-30, z}, {30, z}}; };
  Layers layers = stack_of(plane, {flat, at(4), at(6), at(11)}, {});
  layers.stack[3].material = 1;
  const std::vector<MaterialVolume> volumes = measure(layers).volumes;
  ASSERT_EQ(volumes.size(), 3U);
  EXPECT_NEAR(volumes[1].volume / (h * h * h), 9 * 64, 0.1);
  EXPECT_NEAR(volumes[2].volume / (h * h * h), 2 * 64, 0.1);
}

TEST(Metrology, HasTheSameBitsForAnyNumberOfThreads) {
  const Layers layers = wavy_trench(space, 1, 3.3, 1.5);
  const auto with = [&](int threads) {
    const ThreadLimit limit(threads);
    return measure(layers).openings.at(0);
  };
  const OpeningMetrology one = with(1);
  const OpeningMetrology two = with(2);
  EXPECT_EQ(*one.middle_cd, *two.middle_cd);
  EXPECT_EQ(*one.sidewall_angle, *two.sidewall_angle);
  EXPECT_EQ(*one.line_width_roughness, *two.line_width_roughness);
}

}  // namespace
}  // namespace scarp
