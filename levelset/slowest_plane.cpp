#include "levelset/slowest_plane.h"

namespace scarp {

namespace {

/// Normals lean by s = tan(angle to up / 2), as sines would differ from machine to machine.
Vec3d leaning(const Vec3d& aside, const Vec3d& up, double s) {
  return (1 / (1 + s * s)) * ((2 * s) * aside + (1 - s * s) * up);
}

}  // namespace

Vec3d slowest_plane(const CrystalRates& crystal, const Vec3d& aside, const Vec3d& up) {
  constexpr int leans = 48;
  const auto speed = [&](double s) {
    return crystal.rate(Vec3f(leaning(aside, up, s))).value * ((1 + s * s) / s);
  };
  int best = 2;
  for (int n = 3; n <= leans; ++n)
    if (speed(static_cast<double>(n) / leans) < speed(static_cast<double>(best) / leans)) best = n;
  double least = static_cast<double>(best - 1) / leans;
  double most = best == leans ? 1 : static_cast<double>(best + 1) / leans;
  for (int n = 0; n < 30; ++n) {
    const double third = (most - least) / 3;
    const bool is_lower = speed(least + third) < speed(most - third);
    (is_lower ? most : least) += is_lower ? -third : third;
  }
  return leaning(aside, up, 0.5 * (least + most));
}

}  // namespace scarp
