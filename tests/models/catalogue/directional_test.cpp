#include "models/catalogue/directional.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tests/models/model_fixture.h"

namespace scarp {
namespace {

constexpr double degree = std::numbers::pi / 180;

TEST(BeamDirection, IsExactWhereSymmetryNeedsIt) {
  EXPECT_EQ(beam_direction(0, 0), (Vec3d{0, 0, -1}));
  EXPECT_EQ(beam_direction(0, 123 * degree), (Vec3d{0, 0, -1}));
  for (const double tilt : {1.0, 30.0, 45.0, 60.0, 89.0}) {
    const Vec3d right = beam_direction(tilt * degree, 0);
    EXPECT_EQ(right.y, 0);
    for (const double turn : {180.0, -180.0, 540.0}) {
      EXPECT_EQ(beam_direction(tilt * degree, turn * degree), (Vec3d{-right.x, 0, right.z}));
    }
    for (const double turn : {90.0, -270.0, 450.0}) {
      EXPECT_EQ(beam_direction(tilt * degree, turn * degree), (Vec3d{0, right.x, right.z}));
    }
    for (const double turn : {270.0, -90.0, 990.0}) {
      EXPECT_EQ(beam_direction(tilt * degree, turn * degree), (Vec3d{0, -right.x, right.z}));
    }
  }
}

TEST(BeamDirection, IsTheSphericalFormula) {
  for (double tilt = 0; tilt < 90; tilt += 7.3) {
    for (double azimuth = -400; azimuth < 400; azimuth += 31.7) {
      const Vec3d d = beam_direction(tilt * degree, azimuth * degree);
      EXPECT_NEAR(d.x, std::sin(tilt * degree) * std::cos(azimuth * degree), 4e-15);
      EXPECT_NEAR(d.y, std::sin(tilt * degree) * std::sin(azimuth * degree), 4e-15);
      EXPECT_NEAR(d.z, -std::cos(tilt * degree), 4e-15);
      EXPECT_NEAR(length(d), 1, 4e-15);
    }
  }
}

TEST(Directional, AddsTheFluxOfTheBeamAndAnIsotropicPart) {
  const StepModel step = read_step("directional", R"(
directional_etch_rate = { Si = "10 nm/s", SiO2 = "1 nm/s" }
isotropic_etch_rate = { Si = "0.5 nm/s", SiO2 = "0 nm/s" })");
  EXPECT_FALSE(step.deposits);
  const std::vector<Species> species = step.model->species();
  ASSERT_EQ(species.size(), 1U);
  EXPECT_EQ(species[0].source.kind, SourceLobe::Kind::beam);
  EXPECT_EQ(species[0].source.direction, (Vec3d{0, 0, -1}));
  EXPECT_EQ(species[0].sticking, std::vector<float>(Materials().size(), 1.0F));
  const std::vector<float> flux{1, 0, 0.5F};
  const std::vector<std::span<const float>> tallies{flux};
  EXPECT_THAT(step.model->speeds(Points({"Si", "Si", "SiO2"}), tallies),
              testing::ElementsAre(-10.5F, -0.5F, -0.5F));
}

TEST(Directional, SharesTheRateAmongBeams) {
  const StepModel step = read_step("directional", R"(directional_growth_rate = "8 nm/s"
material = "W"
[[step.beam]]
tilt = "30 deg"
share = 3
[[step.beam]]
tilt = "30 deg"
azimuth = "180 deg"
)");
  EXPECT_EQ(step.deposits, Materials().id("W"));
  const std::vector<Species> species = step.model->species();
  ASSERT_EQ(species.size(), 2U);
  EXPECT_NE(species[0].name, species[1].name);
  EXPECT_EQ(species[0].source.direction.x, -species[1].source.direction.x);
  const std::vector<float> first{1};
  const std::vector<float> second{0.5F};
  const std::vector<std::span<const float>> tallies{first, second};
  EXPECT_THAT(step.model->speeds(Points({"Si"}), tallies), testing::ElementsAre(8 * 0.875F));
}

TEST(Directional, WithoutVisibilityOnlyTheNormalCounts) {
  const StepModel step =
      read_step("directional", "directional_etch_rate = \"4 nm/s\"\nvisibility = false");
  EXPECT_TRUE(step.model->species().empty());
  EXPECT_THAT(step.model->speeds(Points({"Si", "Si", "Si", "Si"},
                                        {{0, 0, 1}, {1, 0, 0}, {0, 0, -1}, {0.6F, 0, 0.8F}}),
                                 {}),
              testing::ElementsAre(-4, 0, 0, -3.2F));
}

/// speeds() is the sum of the parts, at the normals of facets that lie in full light or shadow.
void expect_parts_add_up(const SurfaceModel& model, const SurfacePoints& points,
                         std::span<const std::span<const float>> flux) {
  const std::vector<AngularFactor> factors = model.angular().factors();
  const auto parts = model.angular().amplitudes(points, flux, factors);
  const std::vector<float> speeds = model.speeds(points, flux);
  ASSERT_EQ(parts.size(), 1 + factors.size());
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    float sum = parts[0][p];
    for (std::size_t b = 0; b < factors.size(); ++b) {
      sum += parts[1 + b][p] * factors[b].value(points.normal[p]);
    }
    EXPECT_NEAR(speeds[p], sum, 1e-5) << p;
  }
}

constexpr const char* two_beams = R"(
directional_etch_rate = { Si = "10 nm/s", SiO2 = "1 nm/s" }
isotropic_etch_rate = { Si = "0.5 nm/s", SiO2 = "0 nm/s" }
[[step.beam]]
tilt = "20 deg"
share = 3
[[step.beam]]
tilt = "20 deg"
azimuth = "180 deg"
)";

TEST(Directional, IsASumOfFactorsOfTheNormal) {
  const StepModel step = read_step("directional", "visibility = false" + std::string(two_beams));
  const Points points({"Si", "SiO2", "Si"}, {{0, 0, 1}, {0.6F, 0, 0.8F}, {0, -1, 0}});
  expect_parts_add_up(*step.model, points, {});
}

TEST(Directional, TakesWhatIsInSightAsTheAmplitude) {
  const StepModel step = read_step("directional", two_beams);
  const std::vector<Species> species = step.model->species();
  const Points points({"Si", "SiO2", "Si"}, {{0, 0, 1}, {0.6F, 0, 0.8F}, {1, 0, 0}});
  // The second point is in the shadow of the first beam.
  const std::array<std::vector<float>, 2> seen{std::vector<float>{1, 0, 1}, {1, 1, 1}};
  std::array<std::vector<float>, 2> arrivals;
  std::vector<std::span<const float>> tallies;
  for (std::size_t b = 0; b < 2; ++b) {
    for (std::size_t p = 0; p < 3; ++p) {
      const Vec3d n(SurfacePoints(points).normal[p]);
      const double cosine = std::max(0.0, -dot(species[b].source.direction, n));
      arrivals[b].push_back(static_cast<float>(cosine) * seen[b][p]);
    }
    tallies.insert(tallies.end(), {arrivals[b], seen[b]});
  }
  expect_parts_add_up(*step.model, points, tallies);
}

}  // namespace
}  // namespace scarp
