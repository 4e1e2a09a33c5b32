#include "models/koh_etch.h"

#include <array>
#include <cmath>
#include <memory>
#include <numbers>

namespace scarp {

namespace {

enum class Wafer { plane_100, plane_110, plane_111 };

Parameter plane_rate(std::string_view name, std::string_view fallback, std::string_view meaning) {
  return {.name = name,
          .dimension = Dimension::rate,
          .limits = {.fallback = fallback, .minimum = 0, .maximum = fastest_rate},
          .meaning = meaning,
          .source = "30 % KOH, 70 degrees Celsius"};
}

const Parameter rate_100 = plane_rate("etch_rate_100", "1 um/min", "rate of {100} planes");
const Parameter rate_110 = plane_rate("etch_rate_110", "1.855 um/min", "rate of {110} planes");
const Parameter rate_111 = plane_rate("etch_rate_111", "0.0073 um/min", "rate of {111} planes");
const Parameter rate_311 = plane_rate("etch_rate_311", "1.801 um/min", "rate of {311} planes");
const Parameter etches{.name = "etches",
                       .kind = Parameter::Kind::material_list,
                       .limits = {.fallback = "[\"Si\"]"},
                       .meaning = "the crystal; all else withstands",
                       .source = "the process"};
const Parameter wafer{.name = "wafer",
                      .kind = Parameter::Kind::text,
                      .limits = {.fallback = "100"},
                      .meaning = "100, 110 or 111: the plane of the wafer's surface"};
const Parameter azimuth{.name = "azimuth",
                        .dimension = Dimension::angle,
                        .limits = {.fallback = "0 deg"},
                        .meaning = "of a <110> direction in that plane, from x towards y"};

std::span<const Parameter> parameters() {
  static const std::array rows{rate_100, rate_110, rate_111, rate_311, etches, wafer, azimuth};
  return rows;
}

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

StepModel read(const RecipeTable& step, const StepScope& scope) {
  const CrystalRates::Values rates{.r100 = read_value(step, rate_100),
                                   .r110 = read_value(step, rate_110),
                                   .r111 = read_value(step, rate_111),
                                   .r311 = read_value(step, rate_311)};
  const auto plane = step.choice<Wafer>(
      "wafer", {{"100", Wafer::plane_100}, {"110", Wafer::plane_110}, {"111", Wafer::plane_111}},
      wafer.limits.fallback);
  std::vector<bool> is_etched(scope.materials.size());
  for (const MaterialId m : read_material_list(step, etches, scope)) is_etched[m] = true;
  const AngularFactor rate = CrystalRates(rates, crystal_axes(plane, read_value(step, azimuth)));
  return {std::make_shared<KohEtch>(KohEtch::Values{rate, std::move(is_etched)})};
}

}  // namespace

std::vector<float> KohEtch::speeds(const SurfacePoints& points,
                                   std::span<const std::span<const float>>) const {
  std::vector<float> speeds(points.material.size());
  for (std::size_t p = 0; p < speeds.size(); ++p)
    if (values_.is_etched[points.material[p]]) speeds[p] = -values_.rate.value(points.normal[p]);
  return speeds;
}

std::vector<std::vector<float>> KohEtch::amplitudes(const SurfacePoints& points,
                                                    std::span<const std::span<const float>>) const {
  std::vector<std::vector<float>> parts(2, std::vector<float>(points.material.size()));
  for (std::size_t p = 0; p < points.material.size(); ++p)
    if (values_.is_etched[points.material[p]]) parts[1][p] = -1;
  return parts;
}

// Seen at directions that no symmetry of the crystal joins by chance.
bool KohEtch::is_mirror_symmetric(int axis) const {
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

ModelDescription koh_etch_description() {
  return {
      .name = "koh_etch",
      .summary = "wet etching of crystalline silicon, by the rates of its planes",
      .equation = "v = -rate(n)",
      .symbols =
          "v is the speed along the outward normal n. The rate is that of the four planes, and in "
          "between linear in the components of n along the axes of the crystal over the largest "
          "one, "
          "in two triangles of directions: {100}, {110}, {311} and {111}, {110}, {311}. Planes of "
          "low rate are what is left of a concave shape, planes of high rate take off convex "
          "edges. "
          "The bath reaches all that is open.",
      .limits =
          "The rate depends on the plane alone: no transport in the bath, no dependence on doping "
          "or "
          "on stress. Between the four planes it is an interpolation.",
      .source =
          "T. J. Hubbard, thesis (Caltech, 1994), as used by O. Ertl, S. Selberherr for KOH; the "
          "rates are those of ViennaPS",
      .parameters = parameters(),
      .read = read};
}

}  // namespace scarp
