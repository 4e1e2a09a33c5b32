#include "flux/sampling/sampling.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "core/vector_kernel.h"
#include "flux/sampling/portable_math.h"

namespace scarp {

namespace {

struct DiskPoint {
  double x;
  double y;
  double radius_squared;
};

// Without branches: which way a point goes cannot be foreseen, and loops over points become
// vectors.
inline DiskPoint sample_disk(UnitSquare xi) {
  const double a = 2 * xi.xi1 - 1;
  const double b = 2 * xi.xi2 - 1;
  const bool is_wide = std::abs(a) > std::abs(b);
  const double radius = is_wide ? a : b;
  const double slope = radius == 0 ? 0 : (is_wide ? b : a) / radius;
  const auto [sine, cosine] = portable_sine_cosine(std::numbers::pi / 4 * slope);
  return {radius * (is_wide ? cosine : sine), radius * (is_wide ? sine : cosine), radius * radius};
}

// The better of two for an axis, again without branches.
struct Tangents {
  Vec3d x;
  Vec3d y;
};

inline Vec3d chosen(bool first, Vec3d a, Vec3d b) {
  return {first ? a.x : b.x, first ? a.y : b.y, first ? a.z : b.z};
}

// On walls x is down, whichever way they face: all see as much at the same numbers.
inline Tangents tangents_of(Vec3d axis) {
  constexpr double steepest = 0.75;
  const bool is_wall = std::abs(axis.z) < steepest;
  const double sine = std::sqrt(axis.x * axis.x + axis.y * axis.y);
  const Vec3d across{-axis.y / sine, axis.x / sine, 0};
  const double sign = axis.z < 0 ? -1.0 : 1.0;
  const double a = -1.0 / (sign + axis.z);
  const double b = axis.x * axis.y * a;
  const Vec3d tangent{1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x};
  const Vec3d bitangent{b, sign + axis.y * axis.y * a, -axis.y};
  return {chosen(is_wall, cross(across, axis), tangent), chosen(is_wall, across, bitangent)};
}

inline Vec3d put_about(const Tangents& tangents, double x, double y, double height, Vec3d axis) {
  return x * tangents.x + y * tangents.y + height * axis;
}

// Keeps flights off the horizon, where they would never end.
constexpr double smallest_cosine = 1e-6;

inline Vec3d cosine_about(UnitSquare xi, Vec3d n) {
  const auto [x, y, radius_squared] = sample_disk(xi);
  const double height = std::sqrt(std::max(1 - radius_squared, smallest_cosine * smallest_cosine));
  const Vec3d u = put_about(tangents_of(n), x, y, height, n);
  return u / length(u);
}

// The radius of the concentric map squared is a uniform number, so the map of a lobe keeps the
// azimuth and takes the cosine beyond which a part 1 - radius^2 of the lobe lies.
inline double part_beyond(double radius_squared) { return std::max(1 - radius_squared, 0.0); }

inline Vec3d at_cosine(const DiskPoint& point, double beyond) {
  const auto [x, y, radius_squared] = point;
  const double cosine = std::max(beyond, smallest_cosine);
  const double stretch = std::sqrt(std::max(1 - cosine * cosine, 0.0) / radius_squared);
  const Vec3d u{x * stretch, y * stretch, -cosine};
  return chosen(radius_squared == 0, {0, 0, -1}, u / length(u));
}

double cosine_beyond(double part, double power) {
  return power == 1 ? std::sqrt(part) : portable_power(part, 1 / (power + 1));
}

double cosine_beyond(double part, const PolarDensity& density) { return density.cosine(1 - part); }

// By steps, of which those are vectors that can.
SCARP_WIDE_KERNEL void sample_disks(CosineSamples& samples) {
  for (std::size_t k = 0; k < samples.count; ++k) {
    const auto [x, y, radius_squared] = sample_disk({samples.xi1[k], samples.xi2[k]});
    samples.u[0][k] = x;
    samples.u[1][k] = y;
    samples.u[2][k] = radius_squared;
  }
}

SCARP_WIDE_KERNEL void put_at_cosines(CosineSamples& samples,
                                      const CosineSamples::Numbers& beyond) {
  for (std::size_t k = 0; k < samples.count; ++k) {
    const Vec3d u = at_cosine({samples.u[0][k], samples.u[1][k], samples.u[2][k]}, beyond[k]);
    samples.u[0][k] = u.x;
    samples.u[1][k] = u.y;
    samples.u[2][k] = u.z;
  }
}

// Puts cosines in place of the parts beyond them.
void find_cosines(std::span<double> parts, double power) {
  if (power != 1) return portable_powers(parts, 1 / (power + 1));
  for (double& part : parts) part = std::sqrt(part);
}

void find_cosines(std::span<double> parts, const PolarDensity& density) {
  for (double& part : parts) part = cosine_beyond(part, density);
}

template <class Lobe>
void sample_lobes(CosineSamples& samples, const Lobe& lobe) {
  sample_disks(samples);
  CosineSamples::Numbers beyond;
  for (std::size_t k = 0; k < samples.count; ++k) beyond[k] = part_beyond(samples.u[2][k]);
  find_cosines(std::span(beyond).first(samples.count), lobe);
  put_at_cosines(samples, beyond);
}

// The square s of a skyward direction's slope has a density proportional to 1 / (s + narrow) up to
// widest.
constexpr double narrow = 4e-3;
constexpr double widest = 1;
const double skyward_range = portable_log(1 + widest / narrow);

}  // namespace

Vec3d sample_skyward(UnitSquare xi) {
  const double slope = std::sqrt(narrow * (portable_exp(xi.xi1 * skyward_range) - 1));
  const auto [sine, cosine] = sample_azimuth(xi.xi2);
  return normalized(Vec3d{slope * cosine, slope * sine, 1});
}

double skyward_density(Vec3d u) {
  if (u.z <= 0) return 0;
  const double s = (u.x * u.x + u.y * u.y) / (u.z * u.z);
  if (s > widest) return 0;
  return 1 / (std::numbers::pi * skyward_range * (s + narrow) * u.z * u.z * u.z);
}

Vec3d about_axis(double x, double y, double height, Vec3d axis) {
  return put_about(tangents_of(axis), x, y, height, axis);
}

SineCosine sample_azimuth(double xi) {
  const double quarters = 4 * xi;
  const double nearest = std::floor(quarters + 0.5);
  return portable_sine_cosine(std::numbers::pi / 2 * (quarters - nearest), nearest);
}

Vec3d sample_cosine(UnitSquare xi, Vec3d n) { return cosine_about(xi, n); }

SCARP_WIDE_KERNEL void sample_cosines(CosineSamples& samples) {
  for (std::size_t k = 0; k < samples.count; ++k) {
    const Vec3d u = cosine_about({samples.xi1[k], samples.xi2[k]},
                                 {samples.n[0][k], samples.n[1][k], samples.n[2][k]});
    samples.u[0][k] = u.x;
    samples.u[1][k] = u.y;
    samples.u[2][k] = u.z;
  }
}

Vec3d sample_source(UnitSquare xi, double power) {
  const DiskPoint point = sample_disk(xi);
  return at_cosine(point, cosine_beyond(part_beyond(point.radius_squared), power));
}

Vec3d sample_source(UnitSquare xi, const PolarDensity& density) {
  const DiskPoint point = sample_disk(xi);
  return at_cosine(point, cosine_beyond(part_beyond(point.radius_squared), density));
}

void sample_sources(CosineSamples& samples, double power) { sample_lobes(samples, power); }

void sample_sources(CosineSamples& samples, const PolarDensity& density) {
  sample_lobes(samples, density);
}

// Without branches, half of which would go the other way than foreseen.
Vec3d sample_triangle(UnitSquare xi) {
  const double larger = std::max(xi.xi1, xi.xi2);
  const double half = std::min(xi.xi1, xi.xi2) / 2;
  const std::array<double, 2> parts{larger - half, half};
  const std::size_t first = xi.xi2 > xi.xi1 ? 1 : 0;
  return {parts[first], parts[1 - first], 1 - larger};
}

}  // namespace scarp
