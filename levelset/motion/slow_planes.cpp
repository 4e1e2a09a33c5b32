#include "levelset/motion/slow_planes.h"

#include <algorithm>

namespace scarp {

namespace {

/// Angles to up have halves whose tangents are multiples of this one's inverse: sines would differ
/// from machine to machine.
constexpr int leans = 48;

/// In the plane across the line: aside, up.
struct Direction {
  double aside = 0;
  double up = 0;
};

double dot(const Direction& a, const Direction& b) { return a.aside * b.aside + a.up * b.up; }

/// How much of a plane there is at time 1 above the surface, behind all others.
double exposed_length(const std::vector<Direction>& normals, const std::vector<double>& rates,
                      std::size_t plane) {
  const Direction& n = normals[plane];
  const Direction along{n.up, -n.aside};
  double least = -1e300;
  double most = 1e300;
  const auto cut = [&](const Direction& normal, double rate) {
    const double room = rate - dot(normal, n) * rates[plane];
    const double slope = dot(normal, along);
    if (slope > 0) most = std::min(most, room / slope);
    if (slope < 0) least = std::max(least, room / slope);
  };
  for (std::size_t other = 0; other < normals.size(); ++other)
    if (other != plane) cut(normals[other], rates[other]);
  cut({0, -1}, 0);
  return most - least;
}

}  // namespace

std::vector<CrystalPlane> slow_planes(const CrystalRates& crystal, const Vec3d& aside,
                                      const Vec3d& up) {
  std::vector<Direction> normals;
  std::vector<double> rates;
  const auto normal = [&](const Direction& n) { return n.aside * aside + n.up * up; };
  for (int lean = 0; lean <= leans; ++lean) {
    const double s = static_cast<double>(lean) / leans;
    normals.push_back({2 * s / (1 + s * s), (1 - s * s) / (1 + s * s)});
    rates.push_back(crystal.rate(Vec3f(normal(normals.back()))).value);
  }
  constexpr double least_part = 0.01;
  std::vector<CrystalPlane> planes;
  for (std::size_t n = 1; n < normals.size(); ++n)
    if (exposed_length(normals, rates, n) > least_part * rates.front())
      planes.push_back({normal(normals[n]), rates[n]});
  return planes;
}

}  // namespace scarp
