// Shapes that are etched by ions from straight above, of which only the slope counts: nothing but
// what a mask covers lies in the shadow.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/apps/final_state.h"
#include "tests/apps/recipe_text.h"
#include "tests/apps/surface_height.h"
#include "tests/levelset/cross_sections.h"

namespace scarp {
namespace {

constexpr double spacing = 10;
constexpr double flat_speed = 20;
constexpr double half_extent = 400;

/// A groove with walls of 60 degrees.
double start_height(double x) {
  const double down = (150 - std::abs(x)) * std::sqrt(3.0);
  return -std::clamp(down, 0.0, 150.0);
}

/// The groove once flat parts have gone down by a distance, if a surface with the normal n goes at
/// n_z^power of their speed: by the scheme of Lax and Friedrichs on a much finer grid, which is
/// monotone.
std::vector<double> heights_after(double distance, double power, double step) {
  const auto count = static_cast<std::size_t>(std::lround(2 * half_extent / step));
  std::vector<double> h(count);
  for (std::size_t i = 0; i < count; ++i)
    h[i] = start_height(-half_extent + step * static_cast<double>(i));
  const auto descent = [power](double slope) {
    return std::pow(1 + slope * slope, (1 - power) / 2);
  };
  constexpr double fastest_kink = 1;
  const auto steps = static_cast<int>(std::ceil(distance * fastest_kink / (0.5 * step)));
  const double dt = distance / steps;
  for (int n = 0; n < steps; ++n) {
    const std::vector<double> before = h;
    for (std::size_t i = 0; i < count; ++i) {
      const double left = (before[i] - before[(i + count - 1) % count]) / step;
      const double right = (before[(i + 1) % count] - before[i]) / step;
      const double smoothing = 0.5 * fastest_kink * (right - left);
      h[i] -= dt * (descent(0.5 * (left + right)) - smoothing);
    }
  }
  return h;
}

/// By the power of the response and advection.cfl.
class GrooveUnderIons : public ::testing::TestWithParam<std::tuple<int, double>> {};

TEST_P(GrooveUnderIons, GoesAsASlopeDoes) {
  const auto [power, cfl] = GetParam();
  constexpr double seconds = 20;
  const Recipe recipe = read_text(
      "[domain]\nmode = \"2d\"\nspacing = \"10 nm\"\nextent = [\"800 nm\"]\n"
      "boundary = [\"periodic\"]\n"
      "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n"
      "[[geometry]]\nshape = \"trench\"\nwidth = \"300 nm\"\ndepth = \"150 nm\"\n"
      "taper = \"30 deg\"\n"
      "[flux]\ntarget_error = 0.01\n[advection]\ncfl = " +
      std::to_string(cfl) +
      "\n[[step]]\nmodel = \"multi_particle\"\nduration = \"20 s\"\nrate = \"-20 nm/s * Ar^" +
      std::to_string(power) +
      "\"\n[[step.ion]]\nname = \"Ar\"\nsource_power = 1e6\nsticks_to = \"90 deg\"\n");
  const std::vector<Polyline> lines = surface_after(recipe);
  constexpr double step = 0.5;
  const std::vector<double> expected = heights_after(flat_speed * seconds, power, step);
  double sum = 0;
  double most = 0;
  int count = 0;
  for (double x = -395; x < 400; x += 5, ++count) {
    const auto at = static_cast<std::size_t>(std::lround((x + half_extent) / step));
    const double off = height_at(lines, x) - expected[at];
    const double slope = (expected[at + 2] - expected[at - 2]) / (4 * step);
    const double distance = std::abs(off) / std::hypot(1, slope);
    sum += distance;
    // Where the floor has closed to a tip nothing is resolved.
    if (std::abs(x) > 2 * spacing) most = std::max(most, distance);
  }
  EXPECT_LT(sum / count, 0.06 * spacing);
  EXPECT_LT(most, 0.5 * spacing);
}

INSTANTIATE_TEST_SUITE_P(Powers, GrooveUnderIons,
                         ::testing::Combine(::testing::Values(1, 2),
                                            ::testing::Values(0.5, 0.25, 0.1)));

/// The speed of a surface at an angle under ions, of that of a flat one: at that of the part of
/// them that meets it, as far as their yield goes, or nearly as fast with fewer of them.
double part_of_speed(double angle, bool saturates) {
  constexpr double half_saturated = 0.3;
  // As on a flat surface up to 60 degrees, and from there on linearly to 0 at 90.
  const double yield = std::min((std::numbers::pi / 2 - angle) / (std::numbers::pi / 6), 1.0);
  const double part = std::cos(angle) * yield;
  return saturates ? (1 + half_saturated) * part / (half_saturated + part) : part;
}

/// Where the wall below the edge of a mask lies at a part of the depth, in depths from the edge
/// into the opening. Between floor and wall the front is a fan: its normals start at the edge, each
/// of them goes at its own speed.
double fan_position(double part_of_depth, bool saturates) {
  constexpr double pi = std::numbers::pi;
  const auto place = [&](double angle) {
    constexpr double turn = 1e-6;
    const double speed = part_of_speed(angle, saturates);
    const double slope = (speed - part_of_speed(angle - turn, saturates)) / turn;
    return std::pair{-speed * std::sin(angle) - slope * std::cos(angle),
                     speed * std::cos(angle) - slope * std::sin(angle)};
  };
  double low = pi / 3 + 1e-5;
  double high = pi / 2;
  for (int n = 0; n < 50; ++n) {
    const double middle = 0.5 * (low + high);
    (place(middle).second > part_of_depth ? low : high) = middle;
  }
  return place(low).first;
}

double right_wall_at(const std::vector<Polyline>& lines, double z) {
  double wall = NAN;
  for (const Polyline& line : lines) {
    for (std::size_t p = 0; p + 1 < line.points.size(); ++p) {
      const auto& [xa, za] = line.points[p];
      const auto& [xb, zb] = line.points[p + 1];
      if ((za < z) != (zb < z) && xa > 0) wall = xa + (z - za) / (zb - za) * (xb - xa);
    }
  }
  return wall;
}

/// How far the wall below a mask lies from where it should, into the opening. Units: nm.
double error_of_wall(const std::string& spacing, bool saturates) {
  constexpr double half_opening = 250;
  constexpr double depth = 400;
  const std::string rate = saturates ? "-26 nm/s * etch / (0.3 + etch)" : "-20 nm/s * etch";
  const Recipe recipe = read_text("[domain]\nmode = \"2d\"\nextent = [\"1.2 um\"]\nspacing = \"" +
                                  spacing + R"("
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "mask"
material = "mask"
thickness = "200 nm"
opening = { shape = "trench", width = "500 nm" }
[flux]
target_error = 0.01
[[step]]
model = "multi_particle"
duration = "20 s"
rate = { Si = ")" + rate + R"(", mask = "0" }
[[step.ion]]
name = "ion"
source_power = 1e6
energy = "100 eV"
energy_deviation = "0 eV"
sticks_to = "90 deg"
[[step.ion.yield]]
name = "etch"
amplitude = 0.1
angular = "enhanced"
)");
  const std::vector<Polyline> lines = surface_after(recipe);
  double sum = 0;
  int count = 0;
  for (double part = 0.1; part < 0.95; part += 0.01, ++count)
    sum +=
        half_opening - right_wall_at(lines, -part * depth) - depth * fan_position(part, saturates);
  return sum / count;
}

// The yield of ions on sites with etchant. A speed that turned by the cosine alone would leave the
// wall upright where the grid made its foot steep, and slanted where not.
TEST(WallUnderIons, ComesCloserWithTheSpacingToTheSlopesThatTheirYieldGives) {
  const double coarse = error_of_wall("20 nm", false);
  const double fine = error_of_wall("10 nm", false);
  EXPECT_GT(coarse, 0);
  EXPECT_LT(coarse, 0.33 * 20);  // 0.36 with the dissipation of Lax and Friedrichs everywhere
  EXPECT_NEAR(fine / coarse, 0.5, 0.1);
}

// A floor goes on nearly as fast with fewer ions, and so do its slopes. By the cosine alone, with a
// yield that falls off, it came to be 0.4 spacings off at 10 nm, and more at finer ones.
TEST(WallUnderIons, ComesCloserToThoseOfASpeedThatSaturates) {
  const double coarse = error_of_wall("20 nm", true);
  const double fine = error_of_wall("10 nm", true);
  EXPECT_LT(std::abs(coarse), 0.12 * 20);
  EXPECT_LT(std::abs(fine), 0.6 * std::abs(coarse));
}

/// What a beam from above took of layers of 200 nm of oxide on silicon that is etched a hundred
/// times more slowly, in a trench between masks, once the oxide is gone in the middle and as long
/// again. In squares of the spacing.
struct Taken {
  double oxide_left = 0;
  double silicon = 0;
  double lowest = 0;  ///< in spacings
};

Taken taken_by_beam(const std::string& scheme, double place) {
  constexpr double width = 20;
  constexpr double depth = 20;
  const auto length = [](double spacings) {
    return '"' + std::to_string(spacings * spacing) + " nm\"";
  };
  const Recipe recipe = read_text(
      "[domain]\nmode = \"2d\"\nspacing = \"10 nm\"\nextent = [\"400 nm\"]\n"
      "boundary = [\"periodic\"]\n[advection]\nscheme = \"" +
      scheme +
      "\"\n[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n"
      "[[geometry]]\nshape = \"layer\"\nmaterial = \"SiO2\"\nthickness = \"200 nm\"\n"
      "[[geometry]]\nshape = \"mask\"\nmaterial = \"resist\"\nthickness = \"200 nm\"\n"
      "opening = { shape = \"trench\", width = \"200 nm\", center = " +
      length(place) +
      " }\n[[step]]\nmodel = \"directional\"\nduration = \"400 s\"\n"
      "directional_etch_rate = { SiO2 = \"1 nm/s\", Si = \"0.01 nm/s\", resist = \"0 nm/s\" }\n");
  const std::vector<double> before =
      material_volumes(start_state(recipe.domain.frame, recipe.start).layers);
  const State state = final_state(recipe);
  const std::vector<double> after = material_volumes(state.layers);
  const auto area = [&](std::size_t layer) {
    return (before[layer] - after[layer]) / std::pow(spacing, 3);
  };
  double lowest = 0;
  const std::vector<Polyline> surface = cross_section(state.layers, 1, 0.0).back();
  for (const Polyline& line : surface)
    for (const auto& point : line.points) lowest = std::min(lowest, point[1] / spacing);
  return {.oxide_left = width * depth - area(1), .silicon = area(0), .lowest = lowest};
}

// The floor is flat up to upright walls. Beside them phi above the floor is the distance to the
// wall; differences of that left wedges of .4 to .6 squares of the spacing at the feet, and 4 to 9
// % of the silicon below.
TEST(FootOfAWall, IsSharpUnderABeam) {
  for (const std::string scheme : {"first_order", "eno2", "weno5"}) {
    for (const double place : {0.1, 0.25, 0.4, 0.6}) {
      const Taken taken = taken_by_beam(scheme, place);
      EXPECT_NEAR(taken.oxide_left, 0, 0.2) << scheme << " " << place;
      EXPECT_NEAR(taken.silicon, 20 * 0.2, 0.01 * 20 * 0.2) << scheme << " " << place;
      EXPECT_NEAR(taken.lowest, -0.2, 0.002) << scheme << " " << place;
    }
  }
}

// By first order a slope of 0.16 squares of the spacing stays at either foot, as the silicon is
// etched by a fifth of a spacing only.
TEST(FootOfAWall, IsSharpWhereTheWallLiesOnNodes) {
  for (const std::string scheme : {"first_order", "eno2", "weno5"}) {
    const Taken taken = taken_by_beam(scheme, 0);
    const double slopes = scheme == "first_order" ? 0.32 : 0;
    EXPECT_NEAR(taken.oxide_left, 0, 0.5) << scheme;
    EXPECT_NEAR(taken.silicon + slopes, 20 * 0.2, 0.01 * 20 * 0.2) << scheme;
    EXPECT_NEAR(taken.lowest, -0.2, 0.002) << scheme;
  }
}

}  // namespace
}  // namespace scarp
