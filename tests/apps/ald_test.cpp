// Atomic layer deposition on whole surfaces.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "apps/simulator/simulator.h"
#include "core/error.h"
#include "core/parallel.h"
#include "levelset/operations/layer_steps.h"
#include "tests/apps/program.h"
#include "tests/apps/recipe_text.h"

namespace scarp {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double growth_per_cycle = 0.112;  // nm
constexpr double saturated = 0.92943;       // of an open wafer after 0.1 s
constexpr double flux_factor = 1e4;         // J of the starved case, in 1e15 /cm2/s
constexpr double sticking = 0.01;           // g of it
constexpr double desorption = 2.5;
constexpr double sites = 3.36;
constexpr double diameter = 100;  // nm

const std::string step = R"(
[[step]]
model = "ald"
material = "Al2O3"
growth_per_cycle = "0.112 nm"
)";
const std::string starved = "sticking = 0.01\nflux = \"1e19 /cm2/s\"\n";

std::string wafer(const std::string& cycles) {
  return R"(
[domain]
mode = "2d"
spacing = "5 nm"
extent = ["50 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
)" + step +
         cycles;
}

/// A quarter of a hole.
std::string hole(double aspect, const std::string& keys, double target = 0.01) {
  return R"(
[domain]
spacing = "10 nm"
extent = ["100 nm", "100 nm"]
[[geometry]]
shape = "wafer"
material = "Si"
[[geometry]]
shape = "hole"
radius = "50 nm"
depth = ")" +
         std::to_string(diameter * aspect) + R"( nm"
center = ["-50 nm", "-50 nm"]
[flux]
target_error = )" +
         std::to_string(target) + step + "cycles = 1\n" + keys;
}

Survey first_survey(const Recipe& recipe) {
  State state = start_state(recipe.domain.frame, recipe.start);
  begin_step(state, recipe.steps);
  return survey(state, recipe);
}

/// The mean by area of what is between two depths. Units: nm.
double mean_between(const TriMesh& facets, const std::vector<float>& values, double upper,
                    double lower) {
  const std::vector<double> areas = facet_areas(facets);
  double sum = 0;
  double area = 0;
  for (std::size_t f = 0; f < areas.size(); ++f) {
    double depth = 0;
    for (const std::uint32_t v : facets.triangles[f])
      depth -= static_cast<double>(facets.vertices[v].z) / 3;
    if (depth < upper || depth > lower) continue;
    sum += areas[f] * values[f];
    area += areas[f];
  }
  return sum / area;
}

TEST(AldRun, AnOpenWaferGrowsByTheCoverageOfItsCycles) {
  struct Case {
    const char* keys;
    double theta;
  };
  for (const Case& each :
       {Case{"cycles = 200\n", saturated}, Case{"cycles = 200\ncycles_at_once = 30\n", saturated},
        Case{"cycles = 200\npurge_time = \"50 ms\"\n",
             saturated * std::exp(-desorption / sites * 0.05)},
        Case{"cycles = 200\nsticking = 0.01\nflux = \"1e19 /cm2/s\"\n", saturated}}) {
    const Recipe recipe = read_text(wafer(each.keys));
    State state = start_state(recipe.domain.frame, recipe.start);
    begin_step(state, recipe.steps);
    const double start = highest_point(state.layers);
    while (!finished(state, recipe.steps)) {
      const Survey now = survey(state, recipe);
      for (const float theta : now.coverages[0]) EXPECT_NEAR(theta, each.theta, 2e-4) << each.keys;
      advance(state, recipe, now, 1e9);
    }
    EXPECT_NEAR(highest_point(state.layers) - start, 200 * growth_per_cycle * each.theta,
                2e-3 * 200 * growth_per_cycle)
        << each.keys;
    EXPECT_NEAR(state.time, recipe.steps[0].duration, 1e-9);
  }
}

// A simulated cycle stands for as many as are allowed, and no more than a time step has.
TEST(AldRun, CyclesAtOnceLimitTheTimeStep) {
  const auto time_steps_of = [](const std::string& keys) {
    const Recipe recipe = read_text(wafer(keys));
    State state = start_state(recipe.domain.frame, recipe.start);
    begin_step(state, recipe.steps);
    while (!finished(state, recipe.steps)) advance(state, recipe, survey(state, recipe), 1e9);
    return state.time_step;
  };
  EXPECT_EQ(time_steps_of("cycles = 40\ncycles_at_once = 5\n"), 8U);
  EXPECT_EQ(time_steps_of("cycles = 40\n"), 2U);  // 4.17 nm: 2 at first, up to 4 then
}

// Where molecules hardly stick what arrives is nearly the same everywhere. At the bottom it lies
// between what arrives while all is bare (0.9666 and 0.8294 of an open wafer) and all of it.
TEST(AldRun, SaturatesAtAnyAspectRatio) {
  for (const auto& [aspect, least] : {std::pair{20.0, 0.9238}, {50.0, 0.8944}}) {
    const Survey now = first_survey(read_text(hole(aspect, "")));
    EXPECT_TRUE(now.coverage_fit.reached);
    const double depth = aspect * diameter;
    EXPECT_NEAR(mean_between(now.facets, now.coverages[0], -50, 1), saturated, 1e-3);
    const double bottom = mean_between(now.facets, now.coverages[0], depth - 5, depth + 5);
    EXPECT_GT(bottom, least);
    EXPECT_LT(bottom, saturated);
  }
}

/// The exchange in a tube of diameter 1 between rings of its wall and its bottom, solved on rings
/// of the same width, and the Langmuir kinetics of each: one dimension, no rays.
class Tube {
 public:
  explicit Tube(double depth) : width_(depth / rings) {
    matrix_.assign(rings + 1, std::vector<double>(rings + 1));
    direct_.resize(rings + 1);
    for (std::size_t i = 0; i < rings; ++i) add_ring(i, depth);
    double seen = 0;
    for (const double part : matrix_[rings]) seen += part;
    direct_[rings] = 1 - seen;
  }

  /// Second order in time.
  std::vector<double> covered_after(double seconds) const {
    constexpr int steps = 100;
    std::vector<double> theta(rings + 1);
    for (int n = 0; n < steps; ++n) {
      const double dt = seconds / steps;
      const std::vector<double> middle = advanced(theta, theta, dt / 2);
      theta = advanced(theta, middle, dt);
    }
    return theta;
  }

  double between(const std::vector<double>& theta, double upper, double lower) const {
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < rings; ++i) {
      const double z = (static_cast<double>(i) + 0.5) * width_;
      if (z < upper || z > lower) continue;
      sum += theta[i];
      ++count;
    }
    return sum / count;
  }

 private:
  static constexpr std::size_t rings = 160;

  // The part of a wall's view that a disk across the tube fills at a distance.
  static double end(double z) { return (z * z + 0.5) / std::sqrt(z * z + 1) - z; }

  // What a ring sees, as a mean over its width, and the bottom of it.
  void add_ring(std::size_t i, double depth) {
    constexpr int points = 8;
    for (int k = 0; k < points; ++k) {
      const double z = (static_cast<double>(i) + (k + 0.5) / points) * width_;
      direct_[i] += end(z) / points;
      for (std::size_t j = 0; j < rings; ++j) {
        const double upper = end(std::abs(static_cast<double>(j) * width_ - z));
        const double lower = end(std::abs(static_cast<double>(j + 1) * width_ - z));
        matrix_[i][j] += (i == j ? 1 - upper - lower : std::abs(upper - lower)) / points;
      }
      matrix_[i][rings] += end(depth - z) / points;
    }
    matrix_[rings][i] = 4 * width_ * matrix_[i][rings];
  }

  // By the flux at one coverage, from another.
  std::vector<double> advanced(std::vector<double> theta, const std::vector<double>& at,
                               double dt) const {
    const std::vector<double> flux = arrivals(at);
    for (std::size_t i = 0; i < theta.size(); ++i) {
      const double adsorbs = sticking * flux_factor * flux[i];
      const double sum = adsorbs + desorption;
      theta[i] = adsorbs / sum + (theta[i] - adsorbs / sum) * std::exp(-sum / sites * dt);
    }
    return theta;
  }

  // F = E + K ((1 - s) F + e), by elimination.
  std::vector<double> arrivals(const std::vector<double>& theta) const {
    const std::size_t size = theta.size();
    std::vector<std::vector<double>> a(size, std::vector<double>(size));
    std::vector<double> b = direct_;
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = 0; j < size; ++j) {
        a[i][j] = (i == j ? 1 : 0) - matrix_[i][j] * (1 - sticking * (1 - theta[j]));
        b[i] += matrix_[i][j] * desorption / flux_factor * theta[j];
      }
    }
    for (std::size_t k = 0; k < size; ++k) {
      for (std::size_t i = k + 1; i < size; ++i) {
        const double factor = a[i][k] / a[k][k];
        for (std::size_t j = k; j < size; ++j) a[i][j] -= factor * a[k][j];
        b[i] -= factor * b[k];
      }
    }
    for (std::size_t i = size; i-- > 0;) {
      for (std::size_t j = i + 1; j < size; ++j) b[i] -= a[i][j] * b[j];
      b[i] /= a[i][i];
    }
    return b;
  }

  double width_;
  std::vector<std::vector<double>> matrix_;
  std::vector<double> direct_;
};

/// Where a profile, one value for each diameter of depth, passes half of the saturation. Units:
/// diameters.
double front_of(const std::vector<double>& theta) {
  std::size_t i = 1;
  while (i < theta.size() && theta[i] > 0.5 * saturated) ++i;
  return static_cast<double>(i) - 0.5 +
         (theta[i - 1] - 0.5 * saturated) / (theta[i - 1] - theta[i]);
}

// With fewer molecules than sites a front goes down, as far as the one of the reference.
TEST(SlowAldRun, AStarvedHoleFillsToTheFrontOfTheReference) {
  constexpr int aspect = 20;
  const Tube tube(aspect);
  // Between seeds, what is covered at a depth differs by 0.002 at this target.
  constexpr double target = 0.005;
  for (const double pulse : {0.05, 0.1}) {
    const std::string keys = starved + "pulse_time = \"" + std::to_string(pulse) + " s\"\n";
    const Survey now = first_survey(read_text(hole(aspect, keys, target)));
    const std::vector<double> theta = tube.covered_after(pulse);
    std::vector<double> found;
    std::vector<double> expected;
    for (int z = 0; z < aspect; ++z) {
      found.push_back(mean_between(now.facets, now.coverages[0], z * diameter, (z + 1) * diameter));
      expected.push_back(tube.between(theta, z, z + 1));
      EXPECT_NEAR(found.back(), expected.back(), 0.01) << z;
    }
    EXPECT_NEAR(front_of(found), front_of(expected), 0.02 * front_of(expected)) << pulse;
    EXPECT_LT(found.back(), 0.3);
  }
}

// What desorbs in a purge adsorbs again below, and less of it is lost than from an open wafer.
TEST(AldRun, APurgedHoleKeepsMoreThanAnOpenWafer) {
  const auto covered = [](const std::string& purge) {
    return first_survey(read_text(hole(
        5, "desorption = \"1e17 /cm2/s\"\nsticking = 0.01\nflux = \"1e19 /cm2/s\"\n" + purge)));
  };
  const Survey before = covered("");
  const Survey after = covered("purge_time = \"0.05 s\"\n");
  const double left = std::exp(-100 / sites * 0.05);
  EXPECT_NEAR(mean_between(after.facets, after.coverages[0], -50, 1) /
                  mean_between(before.facets, before.coverages[0], -50, 1),
              left, 0.01 * left);
  EXPECT_GT(mean_between(after.facets, after.coverages[0], 440, 505) /
                mean_between(before.facets, before.coverages[0], 440, 505),
            1.5 * left);
}

TEST(AldRun, BitsDoNotDependOnThreads) {
  const Recipe recipe = read_text(hole(5, starved, 0.05));
  std::vector<std::vector<std::vector<float>>> coverages;
  for (const int threads : {1, 2, 8}) {
    const ThreadLimit limit(threads);
    coverages.push_back(first_survey(recipe).coverages);
  }
  EXPECT_EQ(coverages[0], coverages[1]);
  EXPECT_EQ(coverages[0], coverages[2]);
}

TEST(AldRun, SaysWhatIsWrong) {
  const auto expect = [](const std::string& text, const std::string& message) {
    EXPECT_THAT([&] { read_text(text); }, ThrowsMessage<InputError>(HasSubstr(message)));
  };
  expect(wafer("cycles = 10\n") + "[flux]\nposition_error = 0.1\n",
         "step[0].model: ald grows its film in cycles");
  expect(wafer("cycles = 1000000000\nduration = \"1 s\"\n"),
         "step[0].duration: ald takes as long as cycles (pulse_time + purge_time); leave this out");
  expect(wafer("cycles = 1000000000\npulse_time = \"100 s\"\n"),
         "step[0].cycles: the step takes 1e11 s; the most is 1e9 s");
  expect(wafer("cycles = 1000000000\n"), "step[0].cycles: 1e8 s makes about");
}

using AldProgram = Program;

TEST_F(AldProgram, AResumedRunGivesTheSameBits) {
  write("hole.toml", hole(3, "cycles_at_once = 30\n", 0.05) + "[output]\nevery = \"4 s\"\n");
  const std::string run = "run " + path("hole.toml") + " --quiet --set step[0].cycles=120 ";
  ASSERT_EQ(scarp(run + "-o " + path("whole")).exit_code, 0);
  std::filesystem::copy(folder_ / "whole", folder_ / "cut",
                        std::filesystem::copy_options::recursive);
  for (const char* late : {"summary.json", "state_0002.vdb", "state_0003.vdb"})
    std::filesystem::remove(folder_ / "cut" / late);
  ASSERT_EQ(scarp(run + "--resume -o " + path("cut")).exit_code, 0);
  expect_same_bits("whole", "cut");
}

}  // namespace
}  // namespace scarp
