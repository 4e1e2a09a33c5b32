#include "models/catalogue/koh_etch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "tests/models/model_fixture.h"

namespace scarp {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double um_per_min = 1000 / 60.0;
const double diagonal = std::sqrt(0.5);

/// In um/min, of silicon with this normal.
double koh_rate(const std::string& keys, Vec3d normal, const std::string& material = "Si") {
  const StepModel step = read_step("koh_etch", keys);
  const Points point({material}, {Vec3f(normalized(normal))});
  return -step.model->speeds(point, {}).front() / um_per_min;
}

// On a (100) wafer a <110> direction lies along x: {111} planes are met at 54.74 degrees.
TEST(KohEtch, HasTheRatesOfTheFourPlanes) {
  const double s = diagonal;
  EXPECT_NEAR(koh_rate("", {0, 0, 1}), 1, 1e-5);
  EXPECT_NEAR(koh_rate("", {1, 0, 0}), 1.855, 1e-5);
  EXPECT_NEAR(koh_rate("", {s, s, 0}), 1, 1e-5);
  EXPECT_NEAR(koh_rate("", {std::sqrt(2), 0, 1}), 0.0073, 1e-5);
  EXPECT_NEAR(koh_rate("", {0, -std::sqrt(2), 1}), 0.0073, 1e-5);
  EXPECT_NEAR(koh_rate("", {4 * s, -2 * s, 1}), 1.801, 1e-5);  // <311>
  EXPECT_NEAR(koh_rate("etch_rate_100 = \"3 um/min\"\n", {0, 0, 1}), 3, 1e-5);
}

// Between them the interpolation: (210), (211), (221), (331), (510) in um/min.
TEST(KohEtch, InterpolatesBetweenThem) {
  const double s = diagonal;
  const auto of_plane = [s](double h, double k, double l) {
    return koh_rate("", Vec3d{s * h + s * k, -s * h + s * k, l});
  };
  EXPECT_NEAR(of_plane(2, 1, 0), 1.4275, 1e-4);
  EXPECT_NEAR(of_plane(2, 1, 1), 1.35257, 1e-4);
  EXPECT_NEAR(of_plane(2, 2, 1), 0.93115, 1e-4);
  EXPECT_NEAR(of_plane(3, 3, 1), 1.23910, 1e-4);
  EXPECT_NEAR(of_plane(5, 1, 0), 1.171, 1e-4);
}

TEST(KohEtch, KnowsWafersAndTheirAzimuth) {
  const double s = diagonal;
  EXPECT_NEAR(koh_rate("wafer = \"110\"\n", {0, 0, 1}), 1.855, 1e-5);
  EXPECT_NEAR(koh_rate("wafer = \"110\"\n", {1, 0, 0}), 1.855, 1e-5);
  EXPECT_NEAR(koh_rate("wafer = \"110\"\n", {0, 1, 0}), 1, 1e-5);
  // Walls of {111} that stand upright.
  EXPECT_NEAR(koh_rate("wafer = \"110\"\n", {std::sqrt(2), 1, 0}), 0.0073, 1e-5);
  EXPECT_NEAR(koh_rate("wafer = \"111\"\n", {0, 0, 1}), 0.0073, 1e-5);
  EXPECT_NEAR(koh_rate("wafer = \"111\"\n", {1, 0, 0}), 1.855, 1e-5);
  EXPECT_NEAR(koh_rate("azimuth = \"45 deg\"\n", {1, 0, 0}), 1, 1e-4);
  EXPECT_NEAR(koh_rate("azimuth = \"30 deg\"\n", {0.5 * std::sqrt(3), 0.5, 0}), 1.855, 1e-4);
  EXPECT_NEAR(koh_rate("azimuth = \"45 deg\"\n", {s, s, 0}), 1.855, 1e-4);
}

TEST(KohEtch, TakesTheCrystalAlone) {
  EXPECT_EQ(koh_rate("", {0, 0, 1}, "SiO2"), 0);
  EXPECT_NEAR(koh_rate("etches = [\"SiO2\"]\n", {0, 0, 1}, "SiO2"), 1, 1e-5);
  const StepModel step = read_step("koh_etch", "");
  EXPECT_FALSE(step.deposits.has_value());
  EXPECT_TRUE(step.model->species().empty());
  const Points both({"Si", "SiO2"});
  const auto parts = step.model->angular().amplitudes(both, {}, step.model->angular().factors());
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0], (std::vector<float>{0, 0}));
  EXPECT_EQ(parts[1], (std::vector<float>{-1, 0}));
  EXPECT_FLOAT_EQ(-step.model->angular().factors().front().value({0, 0, 1}),
                  step.model->speeds(both, {}).front());
}

// What reflective sides take for granted.
TEST(KohEtch, IsItsMirrorImageAlongSymmetryPlanesOnly) {
  const auto symmetric = [](const std::string& keys, int axis) {
    return read_step("koh_etch", keys).model->angular().is_mirror_symmetric(axis);
  };
  for (const int axis : {0, 1}) {
    EXPECT_TRUE(symmetric("", axis));
    EXPECT_TRUE(symmetric("azimuth = \"45 deg\"\n", axis));
    EXPECT_TRUE(symmetric("wafer = \"110\"\n", axis));
    EXPECT_FALSE(symmetric("azimuth = \"20 deg\"\n", axis));
  }
  EXPECT_TRUE(symmetric("wafer = \"111\"\n", 0));
  EXPECT_FALSE(symmetric("wafer = \"111\"\n", 1));
}

TEST(KohEtch, SaysWhatIsWrong) {
  const auto expect = [](const std::string& keys, const std::string& message) {
    EXPECT_THAT([&] { read_step("koh_etch", keys); }, ThrowsMessage<InputError>(HasSubstr(message)))
        << keys;
  };
  expect("etch_rate_100 = \"-1 um/min\"\n", "step[0].etch_rate_100");
  expect("wafer = \"211\"\n", "step[0].wafer");
  expect("etches = [\"Su\"]\n", "step[0].etches[0]");
  expect("etch_rate = \"1 um/min\"\n", "step[0].etch_rate: unknown key");
}

TEST(KohEtch, SaysThatThereIsNoCrystal) {
  EXPECT_THAT([] { read_step("koh_etch", "etches = [\"W\"]\n"); },
              ThrowsMessage<InputError>(HasSubstr("so koh_etch etches nothing")));
  EXPECT_THAT(
      [] { read_step("koh_etch", "etches = []\n"); },
      ThrowsMessage<InputError>(HasSubstr("step[0].etches: is nothing that the step finds")));
}

}  // namespace
}  // namespace scarp
