#include "flux/ions.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flux/portable_math.h"
#include "flux/quantiles.h"
#include "flux/sampling.h"

namespace scarp {

namespace {

constexpr double right_angle = std::numbers::pi / 2;

// The part below x of a density x cos(pi / 2 x) in [0, 1].
double narrow_cone_part_below(double x) {
  return (x * std::sin(right_angle * x) + (std::cos(right_angle * x) - 1) / right_angle) /
         (1 - 1 / right_angle);
}

// An angle of a cone of opening 1 with that density.
double narrow_cone_angle(double u) {
  static const Quantiles table(
      1024, [](double part) { return inverse(narrow_cone_part_below, part, 0, 1); });
  return table.at(u);
}

// A polar angle in [0, cone) with density cos(pi / 2 phi / cone) sin(phi), from one that has phi
// for sin(phi): more than three of five draws are taken.
SineCosine sample_cone(double cone, RandomStream& random) {
  for (;;) {
    const double phi = cone * narrow_cone_angle(random.uniform_double());
    // By halves, which are in the range of the series.
    const auto [s, c] = portable_sine_cosine(phi / 2);
    const SineCosine whole{2 * s * c, 1 - 2 * s * s};
    if (random.uniform_double() * phi <= whole.sine) return whole;
  }
}

// Keeps flights off the plane they start from.
Vec3d off_the_plane(Vec3d u, Vec3d n) {
  constexpr double smallest_cosine = 1e-6;
  const double up = dot(u, n);
  return up < smallest_cosine ? normalized(u + (smallest_cosine - up) * n) : normalized(u);
}

}  // namespace

double YieldLaw::strength(double energy) const {
  return amplitude * std::max(0.0, std::sqrt(energy) - std::sqrt(threshold));
}

double YieldLaw::largest(double energy) const { return strength(energy) * factor.largest(); }

AngleTable sticking_between(double first, double second) {
  return AngleTable([=](double theta) {
    if (theta <= first) return 1.0;
    return std::max(0.0, (second - theta) / (second - first));
  });
}

AngleTable reflection_cone(double largest) {
  return AngleTable([=](double theta) { return right_angle - std::min(theta, largest); });
}

AngleTable kept_energy(double inflection, double power) {
  const double at_inflection = 1 / (1 + power * (right_angle / inflection - 1));
  return AngleTable([=](double theta) {
    if (theta < inflection) return at_inflection * std::pow(theta / inflection, power);
    return 1 - (1 - at_inflection) * (right_angle - theta) / (right_angle - inflection);
  });
}

Vec3d sample_reflection(Vec3d d, Vec3d n, double cone, RandomStream& random) {
  const Vec3d specular = d - 2 * dot(d, n) * n;
  Vec3d u = specular;
  if (cone > 0) {
    const auto [sine, cosine] = sample_cone(cone, random);
    const auto [y, x] = sample_azimuth(random.uniform_double());
    u = about_axis(sine * x, sine * y, cosine, specular);
  }
  // What would go into the solid leaves as in a mirror.
  const double up = dot(u, n);
  if (up < 0) u = u - 2 * up * n;
  return off_the_plane(u, n);
}

double sample_kept_energy(double mean, double deviation, RandomStream& random) {
  if (!(deviation > 0)) return mean;
  for (;;) {
    const double part = mean + deviation * standard_normal(random.uniform_double());
    if (part >= 0 && part <= 1) return part;
  }
}

}  // namespace scarp
