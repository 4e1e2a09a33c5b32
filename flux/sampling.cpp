#include "flux/sampling.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flux/portable_math.h"

namespace scarp {

namespace {

struct DiskPoint {
  double x;
  double y;
  double radius_squared;
};

DiskPoint sample_disk(UnitSquare xi) {
  const double a = 2 * xi.xi1 - 1;
  const double b = 2 * xi.xi2 - 1;
  if (a == 0 && b == 0) return {0, 0, 0};
  if (std::abs(a) > std::abs(b)) {
    const auto [sine, cosine] = portable_sine_cosine(std::numbers::pi / 4 * (b / a));
    return {a * cosine, a * sine, a * a};
  }
  const auto [sine, cosine] = portable_sine_cosine(std::numbers::pi / 4 * (a / b));
  return {b * sine, b * cosine, b * b};
}

// Keeps flights off the horizon, where they would never end.
constexpr double smallest_cosine = 1e-6;

// The radius of the concentric map squared is a uniform number, so the map of a lobe keeps the
// azimuth and takes the cosine beyond which a part 1 - radius^2 of the lobe lies.
template <class Cosine>
Vec3d at_cosine(const DiskPoint& point, const Cosine& cosine_beyond) {
  const auto [x, y, radius_squared] = point;
  const double rest = std::max(1 - radius_squared, 0.0);
  const double cosine = std::max(cosine_beyond(rest), smallest_cosine);
  if (radius_squared == 0) return {0, 0, -1};
  const double stretch = std::sqrt(std::max(1 - cosine * cosine, 0.0) / radius_squared);
  return normalized(Vec3d{x * stretch, y * stretch, -cosine});
}

// The square s of a skyward direction's slope has a density proportional to 1 / (s + narrow) up to
// widest.
constexpr double narrow = 4e-3;
constexpr double widest = 4;
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
  // On walls x is down, whichever way they face: all see as much at the same numbers.
  constexpr double steepest = 0.75;
  if (std::abs(axis.z) < steepest) {
    const double sine = std::sqrt(axis.x * axis.x + axis.y * axis.y);
    const Vec3d across{-axis.y / sine, axis.x / sine, 0};
    return x * cross(across, axis) + y * across + height * axis;
  }
  const double sign = axis.z < 0 ? -1.0 : 1.0;
  const double a = -1.0 / (sign + axis.z);
  const double b = axis.x * axis.y * a;
  const Vec3d tangent{1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x};
  const Vec3d bitangent{b, sign + axis.y * axis.y * a, -axis.y};
  return x * tangent + y * bitangent + height * axis;
}

SineCosine sample_azimuth(double xi) {
  const double quarters = 4 * xi;
  const double nearest = std::floor(quarters + 0.5);
  return portable_sine_cosine(std::numbers::pi / 2 * (quarters - nearest), nearest);
}

Vec3d sample_cosine(UnitSquare xi, Vec3d n) {
  const auto [x, y, radius_squared] = sample_disk(xi);
  const double height = std::sqrt(std::max(1 - radius_squared, smallest_cosine * smallest_cosine));
  return normalized(about_axis(x, y, height, n));
}

Vec3d sample_source(UnitSquare xi, double power) {
  return at_cosine(sample_disk(xi), [power](double rest) {
    return power == 1 ? std::sqrt(rest) : portable_power(rest, 1 / (power + 1));
  });
}

Vec3d sample_source(UnitSquare xi, const PolarDensity& density) {
  return at_cosine(sample_disk(xi), [&](double rest) { return density.cosine(1 - rest); });
}

Vec3d sample_triangle(UnitSquare xi) {
  if (xi.xi2 > xi.xi1) {
    const double half = xi.xi1 / 2;
    return {half, xi.xi2 - half, 1 - xi.xi2};
  }
  const double half = xi.xi2 / 2;
  return {xi.xi1 - half, half, 1 - xi.xi1};
}

}  // namespace scarp
