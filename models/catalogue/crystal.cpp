#include "models/catalogue/crystal.h"

#include <cmath>

namespace scarp {

namespace {

enum class Wafer { plane_100, plane_110, plane_111 };

// The crystal's axes on the wafer, with a <110> direction along x.
std::array<Vec3d, 3> upright_axes(Wafer plane) {
  const double half = std::sqrt(1.0 / 2);
  const double third = std::sqrt(1.0 / 3);
  const double sixth = std::sqrt(1.0 / 6);
  switch (plane) {
    case Wafer::plane_100:
      return {Vec3d{half, -half, 0}, {half, half, 0}, {0, 0, 1}};
    case Wafer::plane_110:
      return {Vec3d{half, 0, half}, {-half, 0, half}, {0, -1, 0}};
    default:
      return {Vec3d{half, sixth, third}, {-half, sixth, third}, {0, -2 * sixth, third}};
  }
}

std::array<Vec3d, 3> crystal_axes(Wafer plane, double angle) {
  std::array<Vec3d, 3> axes = upright_axes(plane);
  const double sine = std::sin(angle);
  const double cosine = std::cos(angle);
  for (Vec3d& axis : axes)
    axis = {cosine * axis.x - sine * axis.y, sine * axis.x + cosine * axis.y, axis.z};
  return axes;
}

}  // namespace

Parameter wafer_plane_parameter() {
  return {.name = "wafer",
          .kind = Parameter::Kind::text,
          .limits = {.fallback = "100"},
          .meaning = "100, 110 or 111: the plane of the wafer's surface"};
}

Parameter crystal_azimuth_parameter() {
  return {.name = "azimuth",
          .dimension = Dimension::angle,
          .limits = {.fallback = "0 deg"},
          .meaning = "of a <110> direction in that plane, from x towards y"};
}

AngularFactor read_crystal(const RecipeTable& step, const CrystalRates::Values& rates) {
  const Parameter wafer = wafer_plane_parameter();
  const auto plane = step.choice<Wafer>(
      wafer.name, {{"100", Wafer::plane_100}, {"110", Wafer::plane_110}, {"111", Wafer::plane_111}},
      wafer.limits.fallback);
  const double angle = read_value(step, crystal_azimuth_parameter());
  return CrystalRates(rates, crystal_axes(plane, angle));
}

std::vector<float> Crystal::speeds(const SurfacePoints& points,
                                   std::span<const std::span<const float>>) const {
  std::vector<float> speeds(points.material.size());
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    const float amplitude = values_.amplitude[points.material[p]];
    if (amplitude != 0) speeds[p] = amplitude * values_.rate.value(points.normal[p]);
  }
  return speeds;
}

std::vector<std::vector<float>> Crystal::amplitudes(const SurfacePoints& points,
                                                    std::span<const std::span<const float>>,
                                                    std::span<const AngularFactor>) const {
  std::vector<std::vector<float>> parts(2, std::vector<float>(points.material.size()));
  for (std::size_t p = 0; p < points.material.size(); ++p)
    parts[1][p] = values_.amplitude[points.material[p]];
  return parts;
}

// Seen at directions that no symmetry of the crystal joins by chance.
bool Crystal::is_mirror_symmetric(int axis) const {
  for (int k = 1; k < 200; ++k) {
    const double z = -1 + k / 100.0;
    const double angle = 0.7 * k;
    const double sine = std::sqrt(1 - z * z);
    Vec3d n{sine * std::cos(angle), sine * std::sin(angle), z};
    const float here = values_.rate.value(Vec3f(n));
    n[axis] = -n[axis];
    if (std::abs(values_.rate.value(Vec3f(n)) - here) > 1e-3 * values_.rate.bounds().value)
      return false;
  }
  return true;
}

}  // namespace scarp
