#include "flux/ions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/random.h"
#include "core/running_statistics.h"
#include "tests/flux/ion_traces.h"

namespace scarp {
namespace {

using exact::degree;
using exact::right_angle;

double at_angle(const AngleTable& table, double theta) {
  return table.at(AngleTable::half_sine(std::cos(theta)));
}

TEST(Reflection, KeepsTheEnergyOfBelen) {
  const AngleTable kept = kept_energy(89 * degree, 10);
  const double expected[][2]{{60, 0.0174}, {70, 0.0814}, {75, 0.1624},
                             {80, 0.3096}, {85, 0.5676}, {88, 0.8029}};
  for (const auto& [theta, part] : expected)
    EXPECT_NEAR(at_angle(kept, theta * degree), part, 1e-4) << theta;
  EXPECT_NEAR(at_angle(kept, 89 * degree), 0.8990, 1e-3);
  EXPECT_NEAR(at_angle(kept, right_angle), 1, 1e-6);
}

TEST(Reflection, SticksBelowOneAngleAndNeverAboveAnother) {
  const AngleTable sticking = sticking_between(70 * degree, 90 * degree);
  EXPECT_EQ(at_angle(sticking, 0), 1);
  EXPECT_NEAR(at_angle(sticking, 69.9 * degree), 1, 1e-6);
  EXPECT_NEAR(at_angle(sticking, 80 * degree), 0.5, 1e-4);
  EXPECT_NEAR(at_angle(sticking, right_angle), 0, 1e-6);
  EXPECT_EQ(at_angle(sticking_between(40 * degree, 60 * degree), 80 * degree), 0);
}

TEST(Reflection, OpensTheConeForSteepIons) {
  const AngleTable cone = reflection_cone(80 * degree);
  EXPECT_NEAR(at_angle(cone, 0), right_angle, 1e-6);
  EXPECT_NEAR(at_angle(cone, 50 * degree), 40 * degree, 1e-5);
  EXPECT_NEAR(at_angle(cone, 85 * degree), 10 * degree, 1e-5);
}

// Means over many draws of (cos phi, cos^2 phi, x about the axis) against the density
// cos(pi / 2 phi / cone) sin(phi).
TEST(Reflection, HasTheDensityOfTheCone) {
  const Vec3d n{0, 0, 1};
  const Vec3d d = normalized(Vec3d{1e-9, 0, -1});
  for (const double cone : {5 * degree, 40 * degree, right_angle}) {
    double norm = 0;
    double first = 0;
    double second = 0;
    constexpr int steps = 20'000;
    for (int k = 0; k < steps; ++k) {
      const double phi = cone * (k + 0.5) / steps;
      const double density = std::cos(right_angle * phi / cone) * std::sin(phi);
      norm += density;
      first += density * std::cos(phi);
      second += density * std::pow(std::cos(phi), 2);
    }
    RandomStream random({.seed = 1});
    RunningStatistics height;
    RunningStatistics square;
    RunningStatistics across;
    RunningStatistics x;
    RunningStatistics y;
    for (int k = 0; k < 200'000; ++k) {
      const Vec3d u = sample_reflection(d, n, cone, random);
      ASSERT_NEAR(length(u), 1, 1e-12);
      height.add(u.z);
      square.add(u.z * u.z);
      across.add(u.x * u.x - u.y * u.y);
      x.add(u.x);
      y.add(u.y);
    }
    EXPECT_NEAR(height.mean(), first / norm, 4 * height.std_error() + 1e-6) << cone;
    EXPECT_NEAR(square.mean(), second / norm, 4 * square.std_error() + 1e-6) << cone;
    EXPECT_NEAR(across.mean(), 0, 4 * across.std_error() + 1e-7) << cone;
    EXPECT_NEAR(x.mean(), 0, 4 * x.std_error() + 1e-7) << cone;
    EXPECT_NEAR(y.mean(), 0, 4 * y.std_error() + 1e-7) << cone;
  }
}

TEST(Reflection, WithoutAConeIsAMirrorAndNeverEntersTheSolid) {
  RandomStream random({.seed = 2});
  const Vec3d n = normalized(Vec3d{1, 2, 2});
  const Vec3d d = normalized(Vec3d{0.3, -0.2, -1});
  const Vec3d mirrored = sample_reflection(d, n, 0, random);
  EXPECT_NEAR(dot(mirrored, n), -dot(d, n), 1e-14);
  EXPECT_NEAR(length(cross(mirrored - d, n)), 0, 1e-14);

  const Vec3d glancing = normalized(cross(n, Vec3d{0, 0, 1}) - 0.01 * n);
  for (int k = 0; k < 10'000; ++k)
    ASSERT_GT(dot(sample_reflection(glancing, n, 80 * degree, random), n), 0);
}

// About a specular direction that is `elevation` above the plane the height of a direction is
// cos(phi) sin(elevation) + sin(phi) cos(elevation) cos(azimuth); its mean without the sign.
TEST(Reflection, MirrorsWhatWouldEnterTheSolid) {
  constexpr double elevation = 2 * degree;
  constexpr double cone = 40 * degree;
  constexpr int steps = 1000;
  double norm = 0;
  double expected = 0;
  for (int k = 0; k < steps; ++k) {
    const double phi = cone * (k + 0.5) / steps;
    const double density = std::cos(right_angle * phi / cone) * std::sin(phi);
    for (int j = 0; j < steps; ++j) {
      const double azimuth = 2 * std::numbers::pi * (j + 0.5) / steps;
      norm += density;
      expected += density * std::abs(std::cos(phi) * std::sin(elevation) +
                                     std::sin(phi) * std::cos(elevation) * std::cos(azimuth));
    }
  }
  RandomStream random({.seed = 4});
  const Vec3d n{0, 0, 1};
  const Vec3d d{std::cos(elevation), 0, -std::sin(elevation)};
  RunningStatistics height;
  for (int k = 0; k < 100'000; ++k) height.add(sample_reflection(d, n, cone, random).z);
  EXPECT_NEAR(height.mean(), expected / norm, 4 * height.std_error());
}

TEST(Reflection, LeavesThePlaneAlsoOfAFlightAlongIt) {
  RandomStream random({.seed = 5});
  const Vec3d u = sample_reflection({1, 0, 0}, {0, 0, 1}, 0, random);
  EXPECT_NEAR(u.z, 1e-6, 1e-12);
  EXPECT_NEAR(length(u), 1, 1e-14);
}

TEST(Reflection, KeepsAPartOfTheEnergyBetweenNothingAndAll) {
  RandomStream random({.seed = 3});
  RunningStatistics middle;
  RunningStatistics low;
  RunningStatistics high;
  for (int k = 0; k < 100'000; ++k) {
    middle.add(sample_kept_energy(0.5, 0.1, random));
    low.add(sample_kept_energy(0, 0.1, random));
    high.add(sample_kept_energy(1, 0.1, random));
  }
  EXPECT_NEAR(middle.mean(), 0.5, 4 * middle.std_error());
  // Half a normal distribution.
  EXPECT_NEAR(low.mean(), 0.1 * std::sqrt(2 / std::numbers::pi), 4 * low.std_error() + 1e-5);
  EXPECT_NEAR(high.mean(), 1 - 0.1 * std::sqrt(2 / std::numbers::pi), 4 * high.std_error() + 1e-5);
  EXPECT_EQ(sample_kept_energy(0.3, 0, random), 0.3);
}

TEST(Yield, FollowsTheSquareRootLaw) {
  const YieldLaw law{.name = "sputter",
                     .amplitude = 0.0337,
                     .threshold = 20,
                     .factor = AngleTable([](double theta) { return std::cos(theta); })};
  const double upright = AngleTable::half_sine(1);
  EXPECT_NEAR(law.at(100, upright), 0.0337 * (10 - std::sqrt(20.0)), 1e-7);
  EXPECT_EQ(law.at(19, upright), 0);
  EXPECT_NEAR(law.at(100, AngleTable::half_sine(0.5)) / law.at(100, upright), 0.5, 1e-5);
}

}  // namespace
}  // namespace scarp
