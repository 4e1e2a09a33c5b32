#include "levelset/motion/slow_planes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scarp {
namespace {

constexpr double degrees = 180 / std::numbers::pi;

CrystalRates crystal(double r110, double r111, double r311) {
  const double s = std::sqrt(0.5);
  return {{.r100 = 1, .r110 = r110, .r111 = r111, .r311 = r311},
          {Vec3d{s, s, 0}, {-s, s, 0}, {0, 0, 1}}};
}

/// Of the planes beyond a line along <110> on {100}, the angles to that. Units: degrees.
std::vector<double> angles(const CrystalRates& rates, const Vec3d& aside) {
  std::vector<double> found;
  for (const CrystalPlane& plane : slow_planes(rates, aside, {0, 0, 1})) {
    found.push_back(std::acos(plane.normal.z) * degrees);
    EXPECT_NEAR(length(plane.normal), 1, 1e-12);
    EXPECT_NEAR(plane.rate, rates.rate(Vec3f(plane.normal)).value, 1e-6);
  }
  return found;
}

bool has(const std::vector<double>& angles, double angle) {
  return std::ranges::any_of(angles, [&](double each) { return std::abs(each - angle) < 1.2; });
}

TEST(PlanesOfACrystal, AreThoseThatAreLeft) {
  // {111} alone: it goes aside more slowly than {110}, and {311} is behind the corner of {100}.
  const std::vector<double> one = angles(crystal(0.5, 0.2, 0.75), {1, 0, 0});
  EXPECT_TRUE(has(one, 54.74));
  EXPECT_FALSE(has(one, 25.24));
  EXPECT_FALSE(has(one, 90));
  EXPECT_LE(one.size(), 3U);

  const std::vector<double> three = angles(crystal(0.45, 0.5, 0.7), {0, -1, 0});
  for (const double angle : {25.24, 54.74, 90.0}) EXPECT_TRUE(has(three, angle)) << angle;
}

TEST(PlanesOfACrystal, OfMirroredLinesAreMirroredBitForBit) {
  const CrystalRates rates = crystal(0.5, 0.3, 0.7);
  const Vec3d aside{0.6, 0.8, 0};
  const auto here = slow_planes(rates, aside, {0, 0, 1});
  const auto there = slow_planes(rates, {-aside.x, aside.y, 0}, {0, 0, 1});
  const auto exchanged = slow_planes(rates, {aside.y, aside.x, 0}, {0, 0, 1});
  ASSERT_EQ(here.size(), there.size());
  ASSERT_EQ(here.size(), exchanged.size());
  for (std::size_t n = 0; n < here.size(); ++n) {
    const Vec3d& normal = here[n].normal;
    EXPECT_EQ(there[n].normal, (Vec3d{-normal.x, normal.y, normal.z}));
    EXPECT_EQ(exchanged[n].normal, (Vec3d{normal.y, normal.x, normal.z}));
    EXPECT_EQ(there[n].rate, here[n].rate);
    EXPECT_EQ(exchanged[n].rate, here[n].rate);
  }
}

}  // namespace
}  // namespace scarp
