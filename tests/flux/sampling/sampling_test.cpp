#include "flux/sampling/sampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/random.h"

namespace scarp {
namespace {

// Means over a regular grid of xi: exact for these smooth maps to the grid's resolution squared.
template <class Value>
double mean_over_square(const Value& value) {
  constexpr int count = 512;
  double sum = 0;
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j) sum += value(UnitSquare{(i + 0.5) / count, (j + 0.5) / count});
  return sum / (count * count);
}

class CosineLobe : public ::testing::TestWithParam<Vec3d> {};

TEST_P(CosineLobe, HasTheMomentsOfLambertsLaw) {
  const Vec3d n = normalized(GetParam());
  const Vec3d tangent = normalized(cross(n, std::abs(n.x) < 0.5 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
  const auto moment = [&](Vec3d axis, int k) {
    return mean_over_square(
        [&](UnitSquare xi) { return std::pow(dot(sample_cosine(xi, n), axis), k); });
  };
  EXPECT_NEAR(moment(n, 1), 2.0 / 3, 1e-4);
  EXPECT_NEAR(moment(n, 2), 1.0 / 2, 1e-4);
  EXPECT_NEAR(moment(n, 4), 1.0 / 3, 1e-4);
  EXPECT_NEAR(moment(tangent, 1), 0, 1e-4);
  EXPECT_NEAR(moment(tangent, 2), 1.0 / 4, 1e-4);
  EXPECT_NEAR(moment(tangent, 3), 0, 1e-4);
}

INSTANTIATE_TEST_SUITE_P(Normals, CosineLobe,
                         ::testing::Values(Vec3d{0, 0, 1}, Vec3d{0, 0, -1}, Vec3d{1, 0, 0},
                                           Vec3d{0, -1, 0}, Vec3d{0.3, -0.5, -0.8}));

// To the bit, also where the two halves of a map meet and for axes of any direction.
TEST(CosineSamples, AreThoseOfOneAtATime) {
  RandomStream random({.seed = 4});
  const auto number = [&] { return random.uniform(); };
  for (std::size_t count = 0; count <= CosineSamples::most; ++count) {
    CosineSamples samples;
    std::vector<std::pair<UnitSquare, Vec3d>> numbers;
    for (std::size_t k = 0; k < count; ++k) {
      UnitSquare xi{number(), number()};
      if (k % 5 == 1) xi = {0.5, 0.5};
      if (k % 5 == 2) xi.xi2 = xi.xi1;
      Vec3d n = normalized(Vec3d{number() - 0.5, number() - 0.5, number() - 0.5});
      if (k % 3 == 1) n = {0, 0, k % 2 == 0 ? 1.0 : -1.0};
      numbers.emplace_back(xi, n);
      samples.add(xi, n);
    }
    sample_cosines(samples);
    for (std::size_t k = 0; k < count; ++k)
      EXPECT_EQ(samples.direction(k), sample_cosine(numbers[k].first, numbers[k].second));
  }
}

TEST(SourceDirections, AreTheSameManyAtOnce) {
  const PolarDensity density(std::array{0.0, 0.3, 1.2}, std::array{1.0, 2.0, 0.5});
  for (const std::size_t count : {std::size_t{1}, std::size_t{7}, CosineSamples::most}) {
    RandomStream random({.seed = 3});
    CosineSamples samples;
    std::vector<UnitSquare> numbers{{0.5, 0.5}};  // straight down
    samples.add(numbers[0], {});
    while (samples.count < count) {
      const double xi1 = random.uniform();
      samples.add(numbers.emplace_back(UnitSquare{xi1, random.uniform()}), {});
    }
    for (const double power : {1.0, 7.5}) {
      sample_sources(samples, power);
      for (std::size_t k = 0; k < count; ++k)
        EXPECT_EQ(samples.direction(k), sample_source(numbers[k], power));
    }
    sample_sources(samples, density);
    for (std::size_t k = 0; k < count; ++k)
      EXPECT_EQ(samples.direction(k), sample_source(numbers[k], density));
  }
}

// One over the density, averaged over samples, is the solid angle that they fill; with a factor,
// the integral of that.
TEST(SkywardDirections, HaveTheirDensity) {
  const double steepest = 1 / std::sqrt(2.0);  // cosine of slope 1
  const auto integral = [](const auto& of_u) {
    return mean_over_square([&](UnitSquare xi) {
      const Vec3d u = sample_skyward(xi);
      return of_u(u) / skyward_density(u);
    });
  };
  constexpr double pi = std::numbers::pi;
  EXPECT_NEAR(integral([](Vec3d) { return 1; }), 2 * pi * (1 - steepest), 1e-3);
  EXPECT_NEAR(integral([](Vec3d u) { return u.z; }), pi * (1 - steepest * steepest), 1e-3);
  EXPECT_NEAR(integral([](Vec3d u) { return u.x * u.x; }),
              pi * (2.0 / 3 - steepest + std::pow(steepest, 3) / 3), 1e-3);
  EXPECT_EQ(skyward_density({0, 0.6, -0.8}), 0);
  EXPECT_EQ(skyward_density(normalized(Vec3d{1.01, 0, 1})), 0);
  EXPECT_GT(skyward_density(normalized(Vec3d{0.99, 0, 1})), 0);
}

// Walls that are upright but for rounding send the same numbers the same way.
TEST(CosineLobe, IsContinuousAcrossUprightNormals) {
  const UnitSquare xi{0.3, 0.8};
  const Vec3d up = sample_cosine(xi, normalized(Vec3d{0.6, 0.8, 1e-9}));
  const Vec3d down = sample_cosine(xi, normalized(Vec3d{0.6, 0.8, -1e-9}));
  EXPECT_LT(length(up - down), 1e-8);
}

// In a lobe of power n the mean of cos^k is (n + 1) / (n + 1 + k), and no azimuth is preferred.
class SourceLobes : public ::testing::TestWithParam<double> {};

TEST_P(SourceLobes, HaveTheMomentsOfTheirPower) {
  const double power = GetParam();
  for (const int k : {1, 2, 5}) {
    const double mean =
        mean_over_square([&](UnitSquare xi) { return std::pow(-sample_source(xi, power).z, k); });
    EXPECT_NEAR(mean, (power + 1) / (power + 1 + k), 2e-4) << k;
  }
  for (const Vec3d axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0.6, 0.8, 0}}) {
    const double square = mean_over_square(
        [&](UnitSquare xi) { return std::pow(dot(sample_source(xi, power), axis), 2); });
    EXPECT_NEAR(square, 1 / (power + 3), 2e-4);
  }
}

INSTANTIATE_TEST_SUITE_P(Powers, SourceLobes, ::testing::Values(0.0, 0.5, 1.0, 2.0, 10.0, 1000.0));

TEST(Samples, AreUnitVectorsEvenAtTheCornersOfTheSquare) {
  for (const double a : {0.0, 0.5, 1 - 0x1p-32}) {
    for (const double b : {0.0, 0.5, 1 - 0x1p-32}) {
      for (const double power : {0.0, 1.0, 500.0}) {
        const Vec3d u = sample_source({a, b}, power);
        EXPECT_NEAR(length(u), 1, 1e-15);
        EXPECT_LT(u.z, 0);
      }
      const Vec3d n = normalized(Vec3d{1, 2, -2});
      EXPECT_NEAR(length(sample_cosine({a, b}, n)), 1, 1e-15);
      EXPECT_GT(dot(sample_cosine({a, b}, n), n), 0);
    }
  }
}

TEST(TriangleSamples, AreUniform) {
  for (int corner = 0; corner < 3; ++corner) {
    const auto moment = [&](int k) {
      return mean_over_square(
          [&](UnitSquare xi) { return std::pow(sample_triangle(xi)[corner], k); });
    };
    EXPECT_NEAR(moment(1), 1.0 / 3, 1e-4);
    EXPECT_NEAR(moment(2), 1.0 / 6, 1e-4);
    EXPECT_NEAR(moment(3), 1.0 / 10, 1e-4);
  }
  EXPECT_NEAR(mean_over_square([](UnitSquare xi) {
                const Vec3d w = sample_triangle(xi);
                return w.x * w.y;
              }),
              1.0 / 12, 1e-4);
}

TEST(CrossSection, KeepsTheDirectionInThePlane) {
  const Vec3d u = project_to_cross_section({0.6, 0.64, -0.48});
  EXPECT_EQ(u.y, 0);
  EXPECT_NEAR(length(u), 1, 1e-15);
  EXPECT_NEAR(u.x / u.z, 0.6 / -0.48, 1e-15);
}

}  // namespace
}  // namespace scarp
