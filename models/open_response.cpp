#include "models/open_response.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scarp {

namespace {

// Powers of two, as well spread points want. A wafer that turns is seen from some azimuths, each
// with fewer directions.
constexpr std::uint32_t direction_count = 1 << 13;
constexpr int azimuth_count = 16;

std::vector<Vec3d> directions_of(const SourceLobe& source) {
  if (!source.rotating) return lobe_directions(source, direction_count);
  std::vector<Vec3d> directions;
  SourceLobe still = source;
  still.rotating = false;
  const double sine = std::hypot(source.direction.x, source.direction.y);
  for (int k = 0; k < azimuth_count; ++k) {
    const double azimuth = 2 * std::numbers::pi * (k + 0.5) / azimuth_count;
    still.direction = {sine * std::cos(azimuth), sine * std::sin(azimuth), source.direction.z};
    const std::vector<Vec3d> some = lobe_directions(still, direction_count / azimuth_count);
    directions.insert(directions.end(), some.begin(), some.end());
  }
  return directions;
}

}  // namespace

OpenResponse::OpenResponse(const Species& ions, const YieldLaw& law)
    : yield_(law, ions.ions->energy),
      axis_(ions.source.rotating ? Vec3d{0, 0, 1} : -ions.source.direction),
      directions_(directions_of(ions.source)) {}

// Directions are those of particles that cross the plane of the source.
double OpenResponse::at(Vec3d normal) const {
  double sum = 0;
  for (const Vec3d& u : directions_) {
    const double cosine = -dot(u, normal);
    if (cosine > 0) sum += cosine / -u.z * yield_.at(AngleTable::half_sine(cosine));
  }
  return sum / static_cast<double>(directions_.size());
}

AngularFactor OpenResponse::factor() const {
  // Across the plane in which the axis leans.
  const double sine = std::hypot(axis_.x, axis_.y);
  const Vec3d across = sine > 0 ? Vec3d{-axis_.y / sine, axis_.x / sine, 0} : Vec3d{1, 0, 0};
  return BeamResponse(-axis_, [&](double cosine) {
    return at(cosine * axis_ + std::sqrt(std::max(0.0, 1 - cosine * cosine)) * across);
  });
}

}  // namespace scarp
