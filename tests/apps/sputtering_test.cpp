// Ions that sputter, on whole surfaces: blanket rates, facets, and atoms that settle again.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include "apps/simulator/simulator.h"
#include "apps/simulator/surface_speeds.h"
#include "apps/simulator/symmetry.h"
#include "levelset/metrology/cross_section.h"
#include "models/open_response.h"
#include "tests/apps/recipe_text.h"
#include "tests/apps/surface_height.h"

namespace scarp {
namespace {

constexpr double degrees = 180 / std::numbers::pi;

std::string domain(const std::string& keys) { return "[domain]\n" + keys; }

constexpr const char* wafer = "[[geometry]]\nshape = \"wafer\"\nmaterial = \"Si\"\n";

std::string step_of(const std::string& model, const std::string& keys) {
  return "[[step]]\nmodel = \"" + model + "\"\n" + keys;
}

struct Blanket {
  const char* name;
  std::string keys;
};

/// Open wafers under all kinds of ions, in two and three dimensions.
class MilledWafer : public ::testing::TestWithParam<Blanket> {};

TEST_P(MilledWafer, GoesAtItsRate) {
  for (const std::string dimensions :
       {"mode = \"2d\"\nspacing = \"10 nm\"\nextent = [\"400 nm\"]\nboundary = [\"periodic\"]\n",
        "spacing = \"10 nm\"\nextent = [\"100 nm\", \"100 nm\"]\n"
        "boundary = [\"periodic\", \"periodic\"]\n"}) {
    const Recipe recipe = read_text(
        domain(dimensions) + wafer + "[flux]\nrays = 100000\n" +
        step_of("ion_milling", "duration = \"1 s\"\netch_rate = \"2 nm/s\"\nmaterial = \"Si\"\n" +
                                   GetParam().keys));
    State state = start_state(recipe.domain.frame, recipe.start);
    begin_step(state, recipe.steps);
    const Survey now = survey(state, recipe);
    const std::vector<float> speeds = facet_speeds(state, now);
    const std::vector<double> areas = facet_areas(now.facets);
    double sum = 0;
    double area = 0;
    for (std::size_t f = 0; f < speeds.size(); ++f) {
      sum += speeds[f] * areas[f];
      area += areas[f];
    }
    EXPECT_NEAR(sum / area, -2, 0.01 * 2);
    for (const float arrives : now.flux.back().arrivals().mean) EXPECT_EQ(arrives, 0);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Ions, MilledWafer,
    ::testing::Values(
        Blanket{"Vertical", "[[step.ion]]\nsource_power = 1e5\n"},
        Blanket{"Wide", "[[step.ion]]\nsource_power = 20\n"},
        Blanket{"Tilted", "[[step.ion]]\nsource_power = 100\ntilt = \"35 deg\"\n"},
        Blanket{"Turning",
                "[[step.ion]]\nsource_power = 100\ntilt = \"35 deg\"\nrotating = true\n"},
        Blanket{"Steep", "[[step.ion]]\nsource_power = 500\ntilt = \"70 deg\"\n"},
        Blanket{"ByPolynomial",
                "angular_polynomial = [[1, 1.075], [2, -1.55], [3, 0.65]]\n[[step.ion]]\n"
                "source_power = 100\ntilt = \"30 deg\"\n"},
        Blanket{"OfTwoEnergies",
                "[[step.ion]]\nenergy_width = \"150 eV\"\n[[step.ion]]\nenergy = \"50 eV\"\n"}),
    [](const auto& test) { return std::string(test.param.name); });

// Faceting. Source of the exact solution: tests/levelset/motion/lax_friedrichs_test.cpp.

double faceted_height(double b, double x) {
  double highest = 1;
  for (double q = 0; q < 20; q += 1e-3)
    highest = std::max(highest, q * x + (1 + b * q * q / (1 + q * q)) / std::sqrt(1 + q * q));
  return -highest;
}

constexpr double flat_depth = 200;  // nm, 20 spacings

/// A ridge with walls at `wall` to either side of its middle. Units: nm.
std::string mesa(double extent, double middle, double wall, double height,
                 const std::string& boundary) {
  const auto length = [](double nm) { return '"' + std::to_string(nm) + " nm\""; };
  return domain("mode = \"2d\"\nspacing = \"10 nm\"\nextent = [" + length(extent) +
                "]\nboundary = [\"" + boundary + "\"]\n") +
         wafer + "[[geometry]]\nshape = \"fin\"\nmaterial = \"Si\"\ncenter = " + length(middle) +
         "\nwidth = " + length(2 * wall) + "\nheight = " + length(height) +
         "\n[flux]\ntarget_error = 0.02\n";
}

std::string half_mesa(double top, const std::string& ion) {
  return mesa(1600, -800, 1000, top, "reflective") +
         step_of("ion_milling",
                 "duration = \"200 s\"\netch_rate = \"1 nm/s\"\n[[step.ion]]\n"
                 "source_power = 1e5\nsticks_to = \"90 deg\"\n" +
                     ion);
}

// A parallel beam on half a mesa: slopes within 1.5 degrees, the depth at the wall within 3 %.
TEST(IonMilling, FacetsAMesaAsTheExactSolution) {
  constexpr double b = 9.3;
  constexpr double top = 1500;
  constexpr double wall = 200;
  const std::vector<Polyline> lines = surface_after(read_text(half_mesa(top, "")));
  EXPECT_NEAR(height_at(lines, -799), top - flat_depth, 0.01 * flat_depth);
  EXPECT_NEAR(height_at(lines, 700), -flat_depth, 0.01 * flat_depth);
  constexpr double h = 0.1;
  for (double x = -3.0; x < -0.3; x += 0.1) {
    const auto height = [&](double from) { return height_at(lines, wall + from * flat_depth); };
    const double slope =
        degrees * std::atan((height(x - h) - height(x + h)) / (2 * h * flat_depth));
    const double exact =
        degrees * std::atan((faceted_height(b, x - h) - faceted_height(b, x + h)) / (2 * h));
    EXPECT_NEAR(slope, exact, 1.5) << x;
  }
  const double depth = (top - height_at(lines, wall - 10)) / flat_depth;
  const double exact = -faceted_height(b, -10 / flat_depth);
  EXPECT_NEAR(depth, exact, 0.03 * exact);
}

/// How fast a surface goes along its normal under ions from all azimuths, relative to a flat one.
double turning_speed(double b, double tilt, double slope) {
  constexpr int azimuths = 720;
  const auto at = [b](double cosine) {
    return cosine > 0 ? cosine * cosine * (1 + b * (1 - cosine * cosine)) : 0;
  };
  double sum = 0;
  for (int n = 0; n < azimuths; ++n) {
    const double across = std::sin(tilt) * std::cos(2 * std::numbers::pi * (n + 0.5) / azimuths);
    sum += at(std::sin(slope) * across + std::cos(slope) * std::cos(tilt));
  }
  return sum / azimuths / at(std::cos(tilt));
}

// Ions that lean by 35 degrees from all azimuths take the wall back, too. Every slope between goes
// down more slowly than the corner of top and wall does, so there is no facet: the corner stays.
TEST(SlowIonMilling, KeepsTheCornerOfAMesaOnATurningWafer) {
  constexpr double b = 9.3;
  constexpr double top = 1500;
  const double tilt = 35 / degrees;
  const double back = turning_speed(b, tilt, std::numbers::pi / 2);
  for (double slope = 0.05; slope < 1.5; slope += 0.05)
    ASSERT_LT(turning_speed(b, tilt, slope), std::cos(slope) + back * std::sin(slope));
  const std::vector<Polyline> lines =
      surface_after(read_text(half_mesa(top, "tilt = \"35 deg\"\nrotating = true\n")));
  const double edge = 200 - back * flat_depth;
  for (double x = -790; x < edge - 25; x += 10)
    EXPECT_NEAR(height_at(lines, x), top - flat_depth, 0.03 * flat_depth) << x;
  EXPECT_GT(height_at(lines, edge - 15), top - flat_depth - 10);
  EXPECT_LT(height_at(lines, edge + 10), top - 3 * flat_depth);
}

// Ions that lean facet the side that they come from; on a turning wafer both alike.
TEST(IonMilling, IsSymmetricOnATurningWaferOnly) {
  const auto heights = [](const std::string& keys) {
    const Recipe recipe =
        read_text(mesa(900, 0, 250, 300, "periodic") +
                  step_of("ion_milling",
                          "duration = \"40 s\"\netch_rate = \"1 nm/s\"\n[[step.ion]]\n"
                          "source_power = 500\ntilt = \"35 deg\"\n" +
                              keys));
    const std::vector<Polyline> lines = surface_after(recipe);
    return std::array{height_at(lines, -215), height_at(lines, 215)};
  };
  const auto turning = heights("rotating = true\n");
  const auto leaning = heights("");
  EXPECT_NEAR(turning[0], turning[1], 5);
  EXPECT_GT(std::abs(leaning[0] - leaning[1]), 20);
}

// Redeposition.

constexpr const char* one_trench =
    "[[geometry]]\nshape = \"trench\"\nwidth = \"400 nm\"\ndepth = \"800 nm\"\n";
constexpr const char* one_hole =
    "[[geometry]]\nshape = \"hole\"\nradius = \"150 nm\"\ndepth = \"300 nm\"\n";

const std::string plane =
    domain("mode = \"2d\"\nspacing = \"10 nm\"\nextent = [\"800 nm\"]\n") + wafer + one_trench;
const std::string strip =
    domain("spacing = \"20 nm\"\nextent = [\"800 nm\", \"60 nm\"]\n") + wafer + one_trench;
const std::string sputtered_hole =
    domain("spacing = \"20 nm\"\nextent = [\"500 nm\", \"500 nm\"]\n") + wafer + one_hole;

std::string milled(const std::string& geometry, const std::string& keys) {
  return geometry + "[flux]\ntarget_error = 0.01\n" +
         step_of("ion_milling", "etch_rate = \"1 nm/s\"\nmaterial = \"Si\"\n" + keys);
}

constexpr const char* beam = "[[step.ion]]\nsource_power = 1e6\nsticks_to = \"90 deg\"\n";

// A wall at height z above a floor of width w sees it under (1 - z / sqrt(z^2 + w^2)) / 2.
TEST(Redeposition, OnAWallIsThatOfTheFloorInSight) {
  for (const std::string& geometry : {plane, strip}) {
    const Recipe recipe = read_text(milled(geometry, std::string("duration = \"1 s\"\n") + beam));
    State state = start_state(recipe.domain.frame, recipe.start);
    begin_step(state, recipe.steps);
    const Survey now = survey(state, recipe);
    const std::vector<float> speeds = facet_speeds(state, now);
    const std::vector<double> areas = facet_areas(now.facets);
    for (const double low : {100.0, 300.0, 500.0}) {
      double sum = 0;
      double expected = 0;
      double area = 0;
      for (std::size_t f = 0; f < speeds.size(); ++f) {
        Vec3d r{};
        for (const std::uint32_t v : now.facets.triangles[f])
          r = r + Vec3d(now.facets.vertices[v]) / 3.0;
        const double z = r.z + 800;
        if (std::abs(std::abs(r.x) - 200) > 5 || z < low || z > low + 100) continue;
        sum += areas[f] * speeds[f];
        expected += areas[f] * 0.5 * (1 - z / std::hypot(z, 400));
        area += areas[f];
      }
      ASSERT_GT(area, 0);
      // The wall lies within a hundredth of a spacing of where it should; the flux is good to 1 %
      // on patches of 4 x 4 spacings.
      EXPECT_NEAR(sum / expected, 1, 0.03) << low;
    }
  }
}

// Sputtered = settled + escaped, from facets and from the audit of all flights.
TEST(Redeposition, ConservesAtoms) {
  for (const std::string& geometry : {plane, strip, sputtered_hole}) {
    for (const std::string sticking : {"1", "0.4"}) {
      const Recipe recipe =
          read_text(milled(geometry, "duration = \"1 s\"\nredeposition_sticking = " + sticking +
                                         "\n[[step.ion]]\nsource_power = 100\n"));
      State state = start_state(recipe.domain.frame, recipe.start);
      begin_step(state, recipe.steps);
      const Survey now = survey(state, recipe);
      const std::vector<double> areas = facet_areas(now.facets);
      const FluxField& atoms = now.flux.back();
      std::vector<std::span<const float>> flux;
      for (const FluxField& field : now.flux)
        for (const Tally& tally : field.tallies) flux.emplace_back(tally.mean);
      const std::vector<Vec3f> normals = facet_normals(now.facets);
      const std::vector<float> sputtered =
          recipe.steps[0]
              .model->emitter()
              ->emission({.material = now.facets.materials, .normal = normals}, flux)
              .front();
      double leaves = 0;
      double settles = 0;
      for (std::size_t f = 0; f < areas.size(); ++f) {
        leaves += areas[f] * sputtered[f];
        settles += areas[f] * std::stod(sticking) * atoms.arrivals().mean[f];
      }
      const FluxAudit& audit = atoms.audit;
      EXPECT_EQ(audit.lost(), 0);
      const double escapes = audit.escaped / audit.emitted;
      EXPECT_GT(escapes, 0.2);
      EXPECT_LT(escapes, 0.95);
      EXPECT_NEAR(settles / leaves + escapes, 1, 4 * audit.balance_std_error + 1e-6);
      EXPECT_LT(audit.balance_std_error, 0.01);
    }
  }
}

// What the wafer loses in a run is what escapes: by the volume of all layers, which knows what has
// moved and not what should have. A yield that is the same at all angles takes off no edges, which
// no facet stands for before they are off.
TEST(Redeposition, LeavesTheVolumeThatDoesNotEscape) {
  for (const std::string& geometry : {plane, sputtered_hole}) {
    Recipe recipe = read_text(
        milled(geometry,
               std::string("duration = \"20 s\"\nangular_polynomial = [[0, 1], [1, 0]]\n") + beam));
    recipe.flux.options.target_error = 0.03;
    State state = start_state(recipe.domain.frame, recipe.start);
    const auto volume = [&state] {
      const std::vector<double> each = material_volumes(state.layers);
      return std::accumulate(each.begin(), each.end(), 0.0);
    };
    const double before = volume();
    begin_step(state, recipe.steps);
    double escaped = 0;
    double sputtered = 0;
    while (!finished(state, recipe.steps)) {
      const Survey now = survey(state, recipe);
      const std::vector<double> areas = facet_areas(now.facets);
      const double flat = now.factors.front().value({0, 0, 1});
      double leaves = 0;  // at 1 nm/s of an open wafer
      for (std::size_t f = 0; f < areas.size(); ++f)
        leaves += areas[f] * now.flux.front().tallies[1].mean[f] / flat;
      const FluxAudit& audit = now.flux.back().audit;
      const double dt = advance(state, recipe, now, 1e9).dt;
      sputtered += leaves * dt;
      escaped += leaves * dt * audit.escaped / audit.emitted;
    }
    EXPECT_LT(escaped, 0.95 * sputtered);
    EXPECT_NEAR((before - volume()) / escaped, 1, 0.02);
  }
}

// Sputter deposition.

/// The mean speed of facets that are taken, by area. Units: nm/s.
template <class Taken>
double mean_speed(const Recipe& recipe, const Taken& taken) {
  State state = start_state(recipe.domain.frame, recipe.start);
  begin_step(state, recipe.steps);
  const Survey now = survey(state, recipe);
  const std::vector<float> speeds = facet_speeds(state, now);
  const std::vector<double> areas = facet_areas(now.facets);
  double sum = 0;
  double area = 0;
  for (std::size_t f = 0; f < speeds.size(); ++f) {
    Vec3d r{};
    for (const std::uint32_t v : now.facets.triangles[f])
      r = r + Vec3d(now.facets.vertices[v]) / 3.0;
    if (!taken(r)) continue;
    sum += areas[f] * speeds[f];
    area += areas[f];
  }
  return sum / area;
}

constexpr const char* atoms_on_a_wafer =
    "duration = \"1 s\"\ngrowth_rate = \"1 nm/s\"\nmaterial = \"Ta\"\n";

// 5 x 0.03 (sqrt(200) - sqrt(20)) / 5.46 nm/s go again; the law of the angle is 1 at 0.
TEST(SputterDeposition, OfAnOpenWaferIsItsRateLessWhatIonsTake) {
  const std::string ions =
      "resputter_amplitude = 0.03\n[[step.ion]]\nflux = \"5e15 /cm2/s\"\nenergy = \"200 eV\"\n"
      "energy_deviation = \"0 eV\"\nsource_power = 1e5\n";
  const double rho = Materials()[Materials().id("Ta")].density;
  const double taken = 5 * 0.03 * (std::sqrt(200.0) - std::sqrt(20.0)) / rho;
  for (const std::string dimensions :
       {"mode = \"2d\"\nspacing = \"10 nm\"\nextent = [\"400 nm\"]\n",
        "spacing = \"10 nm\"\nextent = [\"100 nm\", \"100 nm\"]\n"}) {
    const std::string flat = domain(dimensions) + wafer + "[flux]\ntarget_error = 0.005\n";
    const auto all = [](Vec3d) { return true; };
    const std::string off_axis = "source_power = 5\ntilt = \"40 deg\"\nrotating = true\n";
    for (const std::string& source : {std::string(), off_axis}) {
      const std::string keys = atoms_on_a_wafer + source;
      EXPECT_NEAR(mean_speed(read_text(flat + step_of("sputter_deposition", keys)), all), 1, 0.01);
      EXPECT_NEAR(mean_speed(read_text(flat + step_of("sputter_deposition", keys + ions)), all),
                  1 - taken, 0.01);
    }
  }
}

// Atoms that fall straight down make the film of the map.
TEST(SputterDeposition, FollowsAMapOfTheSource) {
  const Recipe recipe = read_text(
      domain("mode = \"2d\"\nspacing = \"10 nm\"\nextent = [\"1 um\"]\n") + wafer +
      "[flux]\ntarget_error = 0.01\n" +
      step_of("sputter_deposition",
              std::string(atoms_on_a_wafer) +
                  "source_power = 1e4\nsource_map = [[\"-500 nm\", 1], [\"500 nm\", 3]]\n"));
  for (const double x : {-400.0, 0.0, 400.0}) {
    const double found = mean_speed(recipe, [x](Vec3d r) { return std::abs(r.x - x) < 50; });
    EXPECT_NEAR(found, 1 + 0.001 * x, 0.02) << x;
  }
}

// Ions that fall into a trench take the film off its floor and bring it to the walls.
TEST(SputterDeposition, IonsMoveTheFilmFromTheFloorToTheWalls) {
  const auto speeds = [](const std::string& ions) {
    const Recipe recipe =
        read_text(plane + "[flux]\ntarget_error = 0.01\n" +
                  step_of("sputter_deposition",
                          atoms_on_a_wafer + std::string("source_power = 100\n") + ions));
    return std::array{mean_speed(recipe, [](Vec3d r) { return r.z < -799 && std::abs(r.x) < 100; }),
                      mean_speed(recipe, [](Vec3d r) {
                        return std::abs(std::abs(r.x) - 200) < 5 && r.z > -780 && r.z < -700;
                      })};
  };
  const auto without = speeds("");
  const auto with = speeds(
      "resputter_amplitude = 0.03\n[[step.ion]]\nflux = \"5e15 /cm2/s\"\nenergy = \"200 eV\"\n"
      "source_power = 1e4\nsticks_to = \"90 deg\"\n");
  EXPECT_LT(with[0], without[0] - 0.1);
  EXPECT_GT(with[1], without[1] + 0.05);
}

struct Floor {
  const char* name;
  const char* domain;
  const char* opening;
};

/// Floors between walls that ions do not etch.
class FloorUnderSputtering : public ::testing::TestWithParam<Floor> {};

// It moves as an open wafer does. Every slope between floor and wall would be etched up to three
// times as fast, yet there is none: fronts with such a yield keep the foot of a wall sharp. With
// speeds of the slopes that a grid makes of it a trench is dug there and runs across the floor, in
// the first two cases 90 and 150 nm deep.
TEST_P(FloorUnderSputtering, StaysFlat) {
  const Recipe whole = read_text(
      domain(GetParam().domain) + wafer +
      "[[geometry]]\nshape = \"mask\"\nmaterial = \"mask\"\nthickness = \"200 nm\"\nopening = { " +
      GetParam().opening + " }\n" +
      step_of("multi_particle",
              "duration = \"30 s\"\nrate = { Si = \"-1 nm/s * etch\", mask = \"0 nm/s\" }\n"
              "[[step.ion]]\nname = \"ion\"\nsource_power = 1000\nsticks_to = \"89.9 deg\"\n"
              "[[step.ion.yield]]\nname = \"etch\"\namplitude = 1\nangular = \"sputter\"\n"));
  const Recipe recipe = on_part(whole, mirror_planes(whole));
  const Species ions = recipe.steps.front().model->species().front();
  const double depth = 30 * OpenResponse(ions, ions.yields.front()).flat();
  const std::vector<Polyline> surface = surface_after(recipe);
  for (const double x : {1.0, 100.0, 200.0, 250.0})
    EXPECT_NEAR(height_at(surface, x), -depth, 0.01 * depth) << x;
}

INSTANTIATE_TEST_SUITE_P(
    Openings, FloorUnderSputtering,
    ::testing::Values(
        Floor{"Trench", "mode = \"2d\"\nextent = [\"1000 nm\"]\nspacing = \"25 nm\"\n",
              "shape = \"trench\", width = \"600 nm\""},
        Floor{"FineTrench", "mode = \"2d\"\nextent = [\"1000 nm\"]\nspacing = \"12.5 nm\"\n",
              "shape = \"trench\", width = \"600 nm\""},
        Floor{"SectionOfAHole",
              "mode = \"axisymmetric\"\nextent = [\"1000 nm\"]\nspacing = \"25 nm\"\n",
              "shape = \"hole\", radius = \"300 nm\""},
        Floor{"Hole",
              "extent = [\"1000 nm\", \"1000 nm\"]\nspacing = \"25 nm\"\nsymmetry = \"auto\"\n",
              "shape = \"hole\", radius = \"300 nm\""}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace scarp
