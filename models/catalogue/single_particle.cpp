#include "models/catalogue/single_particle.h"

#include <array>

#include "models/source_parameters.h"

namespace scarp {

namespace {

const Parameter growth_rate{.name = "growth_rate",
                            .kind = Parameter::Kind::per_material,
                            .dimension = Dimension::rate,
                            .limits = rate_limits,
                            .needed = "this or etch_rate",
                            .meaning = "speed of growth of an open flat wafer",
                            .source = "blanket wafer"};
const Parameter etch_rate{.name = "etch_rate",
                          .kind = Parameter::Kind::per_material,
                          .dimension = Dimension::rate,
                          .limits = rate_limits,
                          .needed = "this or growth_rate",
                          .meaning = "speed of etching of an open flat wafer",
                          .source = "blanket wafer"};
const Parameter sticking{.name = "sticking",
                         .kind = Parameter::Kind::per_material,
                         .limits = {.fallback = "1", .minimum = 0, .maximum = 1},
                         .meaning = "probability that a particle stays where it arrives",
                         .source = "TEOS oxide 0.03-0.1, silane oxide 0.3-0.8, W 0.001-0.1, PVD 1"};
const Parameter source_power = source_power_parameter("source_power");
const Parameter source_table = source_table_parameter("source_table");
const Parameter source_map = source_map_parameter("source_map");

std::span<const Parameter> parameters() {
  static const std::array rows{growth_rate, etch_rate,    deposited_parameter("growth_rate"),
                               sticking,    source_power, source_table,
                               source_map};
  return rows;
}

StepModel read(const RecipeTable& step, const StepScope& scope) {
  const std::optional<Action> action =
      read_action(step, growth_rate, etch_rate, parameters(), scope);
  if (!action) return {};
  SingleParticle::Values values;
  values.speed =
      read_per_material(step, action->grows ? growth_rate : etch_rate, scope, action->deposited);
  for (float& v : values.speed) v = action->speed(v);
  values.sticking = read_per_material(step, sticking, scope, action->deposited);
  values.source = read_upright_source(step, source_power, scope);
  return {std::make_shared<SingleParticle>(std::move(values)), action->deposited};
}

}  // namespace

SingleParticle::SingleParticle(Values values)
    : SurfaceModel({{.name = "particle", .source = values.source, .sticking = values.sticking}}),
      values_(std::move(values)) {}

std::vector<float> SingleParticle::speeds(const SurfacePoints& points,
                                          std::span<const std::span<const float>> flux) const {
  const std::span<const float> arrivals = flux.front();
  std::vector<float> speeds(points.material.size());
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    speeds[p] = values_.speed[points.material[p]] * arrivals[p];
  }
  return speeds;
}

ModelDescription single_particle_description() {
  return {
      .name = "single_particle",
      .summary = "one species with constant sticking: CVD, plain reactive etching",
      .equation = "v = growth_rate F or -etch_rate F",
      .symbols =
          "v is the speed along the outward normal; F is what arrives, first and later arrivals "
          "together, relative to an open flat wafer. There F = 1 whatever the sticking, because "
          "nothing comes back, so the rate is what a blanket wafer shows. Particles leave the "
          "source with a density cos^n(theta) per solid angle about the downward normal, among "
          "those that cross a plane, or with the one of a table, linear in theta and 0 outside; "
          "those that do not stick are re-emitted by the cosine law. With a "
          "source_map, relative to its mean, an open flat wafer has F = 1 on average.",
      .limits =
          "Molecules meet walls and not each other (mean free path above ten widths). "
          "Sticking does not depend on flux, angle or temperature.",
      .source =
          "J. C. Rey, J. P. McVittie, K. C. Saraswat, 1990, for one sticking probability; "
          "kinetic theory for n = 1",
      .parameters = parameters(),
      .read = read};
}

}  // namespace scarp
