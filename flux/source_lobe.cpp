#include "flux/source_lobe.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flux/sampling/portable_math.h"
#include "flux/sampling/sobol.h"

namespace scarp {

namespace {

Vec3d sample_upright(const SourceLobe& lobe, UnitSquare xi) {
  return lobe.table.empty() ? sample_source(xi, lobe.cosine_power) : sample_source(xi, lobe.table);
}

}  // namespace

double radiance(const SourceLobe& lobe, double cosine) {
  if (!lobe.table.empty()) return lobe.table.at(cosine) / cosine;
  const double power = lobe.cosine_power;
  return (power + 1) / (2 * std::numbers::pi) * portable_power(cosine, power - 1);
}

void sample_upright(const SourceLobe& lobe, CosineSamples& samples) {
  if (lobe.table.empty()) {
    sample_sources(samples, lobe.cosine_power);
  } else {
    sample_sources(samples, lobe.table);
  }
}

Vec3d about_lobe_axis(const SourceLobe& lobe, Vec3d upright, RandomStream& random) {
  if (lobe.is_upright()) return upright;
  Vec3d u = upright;
  Vec3d axis = lobe.direction;
  if (lobe.rotating) {
    const double tilt = std::sqrt(axis.x * axis.x + axis.y * axis.y);
    const auto [sine, cosine] = sample_azimuth(random.uniform());
    axis = {tilt * cosine, tilt * sine, axis.z};
  }
  constexpr double horizon = -1e-6;
  while ((u = about_axis(u.x, u.y, -u.z, axis)).z > horizon) {
    const double xi1 = random.uniform();
    u = sample_upright(lobe, {xi1, random.uniform()});
  }
  return normalized(u);
}

Vec3d sample_lobe(const SourceLobe& lobe, UnitSquare xi, RandomStream& random) {
  return about_lobe_axis(lobe, sample_upright(lobe, xi), random);
}

std::vector<Vec3d> lobe_directions(const SourceLobe& lobe, std::uint32_t count) {
  const ScrambledSobol points({1, 2, 3, 4});
  // Asked for what a lobe that leans sends away from the wafer, and how the wafer has turned.
  RandomStream random({});
  std::vector<Vec3d> directions;
  for (std::uint32_t k = 0; k < count; ++k) {
    const auto point = points.point(k);
    directions.push_back(sample_lobe(lobe, {point[0], point[1]}, random));
  }
  return directions;
}

double part_below(const SourceLobe& lobe, double slope) {
  if (lobe.is_upright() && lobe.table.empty()) return portable_power(slope, lobe.cosine_power + 1);
  constexpr std::uint32_t count = 1 << 12;
  const std::vector<Vec3d> directions = lobe_directions(lobe, count);
  return static_cast<double>(
             std::ranges::count_if(directions, [&](Vec3d u) { return -u.z < slope; })) /
         count;
}

namespace {

/// Sine and cosine of any angle, exact at multiples of 90 degrees.
SineCosine sine_cosine(double angle) {
  constexpr double quarter = std::numbers::pi / 2;
  const double turns = std::floor(angle / quarter + 0.5);
  double rest = angle - turns * quarter;
  // What is left at a multiple of 90 degrees is the rounding of the multiple.
  if (std::abs(rest) < 1e-14 * std::max(1.0, std::abs(turns))) rest = 0;
  return portable_sine_cosine(rest, turns);
}

}  // namespace

Vec3d beam_direction(double tilt_angle, double azimuth_angle) {
  const SineCosine theta = sine_cosine(tilt_angle);
  const SineCosine phi = sine_cosine(azimuth_angle);
  return {theta.sine * phi.cosine, theta.sine * phi.sine, -theta.cosine};
}

}  // namespace scarp
