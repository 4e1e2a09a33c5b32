#include "models/single_particle.h"

#include <array>

namespace scarp {

namespace {

const Parameter growth_rate{.name = "growth_rate",
                            .kind = Parameter::Kind::per_material,
                            .dimension = Dimension::rate,
                            .limits = {.minimum = 0},
                            .needed = "this or etch_rate",
                            .meaning = "speed of growth of an open flat wafer",
                            .source = "blanket wafer"};
const Parameter etch_rate{.name = "etch_rate",
                          .kind = Parameter::Kind::per_material,
                          .dimension = Dimension::rate,
                          .limits = {.minimum = 0},
                          .needed = "this or growth_rate",
                          .meaning = "speed of etching of an open flat wafer",
                          .source = "blanket wafer"};
const Parameter sticking{.name = "sticking",
                         .kind = Parameter::Kind::per_material,
                         .limits = {.fallback = "1", .minimum = 0, .maximum = 1},
                         .meaning = "probability that a particle stays where it arrives",
                         .source = "TEOS oxide 0.03-0.1, silane oxide 0.3-0.8, W 0.001-0.1, PVD 1"};
const Parameter source_power{.name = "source_power",
                             .limits = {.fallback = "1", .minimum = 0, .maximum = 1e6},
                             .meaning = "n of the source's cos^n(theta)",
                             .source = "kinetic theory: 1 for a gas in equilibrium"};

}  // namespace

std::vector<Species> SingleParticle::species() const {
  return {{.name = "particle",
           .source = {.kind = SourceLobe::Kind::cosine, .cosine_power = values_.source_power},
           .sticking = values_.sticking}};
}

std::vector<float> SingleParticle::speeds(const SurfacePoints& points,
                                          std::span<const std::span<const float>> flux) const {
  const std::span<const float> arrivals = flux.front();
  std::vector<float> speeds(points.material.size());
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    speeds[p] = values_.speed[points.material[p]] * arrivals[p];
  }
  return speeds;
}

std::span<const Parameter> single_particle_parameters() {
  static const std::array parameters{growth_rate, etch_rate, deposited_parameter("growth_rate"),
                                     sticking, source_power};
  return parameters;
}

StepModel read_single_particle(const RecipeTable& step, const StepScope& scope) {
  const std::optional<Action> action =
      read_action(step, growth_rate, etch_rate, single_particle_parameters(), scope);
  if (!action) return {};
  SingleParticle::Values values;
  values.speed =
      read_per_material(step, action->grows ? growth_rate : etch_rate, scope, action->deposited);
  for (float& v : values.speed) v = action->speed(v);
  values.sticking = read_per_material(step, sticking, scope, action->deposited);
  values.source_power = read_value(step, source_power);
  return {std::make_shared<SingleParticle>(std::move(values)), action->deposited};
}

}  // namespace scarp
