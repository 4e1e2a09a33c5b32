#include "models/catalogue/directional.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "flux/sampling/portable_math.h"

namespace scarp {

namespace {

Parameter rate(std::string_view name, std::string_view needed, std::string_view fallback,
               std::string_view meaning) {
  return {.name = name,
          .kind = Parameter::Kind::per_material,
          .dimension = Dimension::rate,
          .limits = {.fallback = fallback, .minimum = 0, .maximum = fastest_rate},
          .needed = needed,
          .meaning = meaning,
          .source = "blanket wafer"};
}

const Parameter directional_growth_rate =
    rate("directional_growth_rate", "this or directional_etch_rate", "",
         "speed of growth of a surface that faces the beam");
const Parameter directional_etch_rate =
    rate("directional_etch_rate", "this or directional_growth_rate", "",
         "speed of etching of a surface that faces the beam");
const Parameter isotropic_growth_rate =
    rate("isotropic_growth_rate", "", "0 nm/s", "speed of growth in all directions, on top of it");
const Parameter isotropic_etch_rate =
    rate("isotropic_etch_rate", "", "0 nm/s", "speed of etching in all directions, on top of it");
const Parameter visibility{.name = "visibility",
                           .kind = Parameter::Kind::flag,
                           .limits = {.fallback = "true"},
                           .meaning = "a beam does not reach what lies in the shadow"};
const Parameter tilt{
    .name = "beam.tilt",
    .dimension = Dimension::angle,
    .limits = {.fallback = "0 deg", .minimum = 0, .maximum = 89 * (std::numbers::pi / 180)},
    .meaning = "angle of the beam to the vertical"};
const Parameter azimuth{.name = "beam.azimuth",
                        .dimension = Dimension::angle,
                        .limits = {.fallback = "0 deg"},
                        .meaning = "where the beam leans, from x towards y"};
const Parameter share{.name = "beam.share",
                      .limits = {.fallback = "1", .minimum = 0, .exclusive = true},
                      .meaning = "strength relative to the other beams"};

std::vector<Directional::Beam> read_beams(const RecipeTable& step) {
  std::vector<Directional::Beam> beams;
  double sum = 0;
  for (const RecipeTable& table : step.tables_or_one("beam")) {
    const double theta = read_value(table, inner(tilt));
    const double towards = read_value(table, inner(azimuth));
    const double strength = read_value(table, inner(share));
    beams.push_back({beam_direction(theta, towards), strength});
    sum += strength;
  }
  for (Directional::Beam& beam : beams) beam.share /= sum;
  return beams;
}

std::span<const Parameter> parameters() {
  static const std::array rows{directional_growth_rate,
                               directional_etch_rate,
                               isotropic_growth_rate,
                               isotropic_etch_rate,
                               deposited_parameter("directional_growth_rate"),
                               visibility,
                               tilt,
                               azimuth,
                               share};
  return rows;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  const std::optional<Action> action =
      read_action(step, directional_growth_rate, directional_etch_rate, parameters(), scope);
  if (!action) return {};
  Directional::Values values;
  values.directional_speed =
      read_per_material(step, action->grows ? directional_growth_rate : directional_etch_rate,
                        scope, action->deposited);
  values.isotropic_speed = read_per_material(
      step, action->grows ? isotropic_growth_rate : isotropic_etch_rate, scope, action->deposited);
  for (float& v : values.directional_speed) v = action->speed(v);
  for (float& v : values.isotropic_speed) v = action->speed(v);
  values.visibility = read_flag(step, visibility);
  values.beams = read_beams(step);
  return {std::make_shared<Directional>(std::move(values)), action->deposited};
}

std::vector<Species> species_of(const Directional::Values& values) {
  std::vector<Species> species;
  if (!values.visibility) return species;
  for (const Directional::Beam& beam : values.beams) {
    Species particles;
    particles.name = values.beams.size() == 1 ? "beam" : "beam " + std::to_string(species.size());
    particles.source = {.kind = SourceLobe::Kind::beam, .direction = beam.direction};
    particles.sticking.assign(values.directional_speed.size(), 1.0F);
    species.push_back(std::move(particles));
  }
  return species;
}

}  // namespace

Directional::Directional(Values values)
    : SurfaceModel(species_of(values), {.angular = this}), values_(std::move(values)) {}

std::vector<float> Directional::speeds(const SurfacePoints& points,
                                       std::span<const std::span<const float>> flux) const {
  std::vector<float> speeds(points.material.size());
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    double arrivals = 0;
    for (std::size_t b = 0; b < values_.beams.size(); ++b) {
      const Beam& beam = values_.beams[b];
      const double facing = values_.visibility
                                ? flux[b * flux.size() / values_.beams.size()][p]
                                : std::max(0.0, -dot(beam.direction, Vec3d(points.normal[p])));
      arrivals += beam.share * facing;
    }
    const MaterialId material = points.material[p];
    speeds[p] = values_.directional_speed[material] * static_cast<float>(arrivals) +
                values_.isotropic_speed[material];
  }
  return speeds;
}

bool Directional::is_isotropic() const {
  return std::all_of(values_.beams.begin(), values_.beams.end(), [](const Beam& beam) {
    return beam.direction.x == 0 && beam.direction.y == 0;
  });
}

bool Directional::is_mirror_symmetric(int axis) const {
  // The share of all beams along a direction.
  const auto share_along = [&](Vec3d direction) {
    double sum = 0;
    for (const Beam& beam : values_.beams)
      if (length(beam.direction - direction) < 1e-9) sum += beam.share;
    return sum;
  };
  return std::all_of(values_.beams.begin(), values_.beams.end(), [&](const Beam& beam) {
    Vec3d mirrored = beam.direction;
    mirrored[axis] = -mirrored[axis];
    return std::abs(share_along(beam.direction) - share_along(mirrored)) < 1e-9;
  });
}

std::vector<AngularFactor> Directional::factors() const {
  std::vector<AngularFactor> factors;
  for (const Beam& beam : values_.beams) {
    factors.push_back(CosineResponse(beam.direction));
  }
  return factors;
}

std::vector<std::vector<float>> Directional::amplitudes(
    const SurfacePoints& points, std::span<const std::span<const float>> flux,
    std::span<const AngularFactor>) const {
  const std::size_t count = points.material.size();
  std::vector<std::vector<float>> parts(1 + values_.beams.size(), std::vector<float>(count));
  for (std::size_t p = 0; p < count; ++p) {
    const MaterialId material = points.material[p];
    parts[0][p] = values_.isotropic_speed[material];
    for (std::size_t b = 0; b < values_.beams.size(); ++b) {
      // Of a beam the second tally is the part of the point that sees the source.
      const float seen = values_.visibility ? flux[2 * b + 1][p] : 1.0F;
      parts[1 + b][p] =
          values_.directional_speed[material] * static_cast<float>(values_.beams[b].share) * seen;
    }
  }
  return parts;
}

ModelDescription directional_description() {
  return {
      .name = "directional",
      .summary = "parallel beams with shadows, and an isotropic part",
      .equation = "v = directional_rate sum_i share_i max(0, -d_i.n) seen_i + isotropic_rate",
      .symbols =
          "v is the speed along the outward normal n, negative for etching; d_i is the direction "
          "of beam i towards the wafer, seen_i the part of the point from which the source is in "
          "sight against d_i, and the shares add up to 1. Without a [[step.beam]] table there is "
          "one vertical beam: flat ground moves at the directional rate, vertical walls do not "
          "move by it.",
      .limits =
          "Particles stay where they arrive; the rate depends on the angle by the cosine "
          "alone. Beams that lean towards a reflective side have to come in mirrored pairs of "
          "equal share.",
      .source = "J. A. Sethian, D. Adalsteinsson, IEEE Trans. Semicond. Manuf. 10, 167 (1997)",
      .parameters = parameters(),
      .read = read};
}

}  // namespace scarp
