#include "models/ion_parameters.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "models/source_parameters.h"

namespace scarp {

namespace {

constexpr double right_angle = std::numbers::pi / 2;
constexpr Limits angles(std::string_view fallback) {
  return {.fallback = fallback, .minimum = 0, .maximum = right_angle};
}

constexpr std::array sticking_by_angle{
    angle_column, Column{"sticking", Dimension::number, {.minimum = 0, .maximum = 1}}};

const Parameter ion_power{.name = "ion.source_power",
                          .limits = {.fallback = "500", .minimum = 0, .maximum = 1e6},
                          .meaning = "n of the source's cos^n(theta); 1 / sqrt(n) is its spread",
                          .source = "sheath: n = 2 E / (k T) of the ions"};
const Parameter ion_table = source_table_parameter("ion.source_table");
const Parameter ion_map = source_map_parameter("ion.source_map");
const Parameter ion_tilt = tilt_parameter("ion.tilt");
const Parameter ion_azimuth = azimuth_parameter("ion.azimuth");
const Parameter ion_rotating = rotating_parameter("ion.rotating");
const Parameter ion_energy{.name = "ion.energy",
                           .dimension = Dimension::energy,
                           .limits = {.fallback = "100 eV", .minimum = 0, .maximum = 1e6},
                           .meaning = "mean at the source"};
const Parameter ion_energy_deviation{.name = "ion.energy_deviation",
                                     .dimension = Dimension::energy,
                                     .limits = {.fallback = "10 eV", .minimum = 0, .maximum = 1e6},
                                     .meaning = "standard deviation of the energy"};
const Parameter ion_energy_width{
    .name = "ion.energy_width",
    .dimension = Dimension::energy,
    .limits = {.minimum = 0, .maximum = 1e6, .exclusive = true},
    .needed = "none",
    .meaning = "distance of two peaks in place of the deviation: ions of an RF sheath",
    .source = "Benoit-Cattin, Bernard 1968: (8 e V / (3 w d)) sqrt(2 e V / m)",
    .replaces = {"energy_deviation"}};
constexpr std::array density_by_energy{energy_column,
                                       Column{"density", Dimension::number, {.minimum = 0}}};
const Parameter ion_energy_table{.name = "ion.energy_table",
                                 .kind = Parameter::Kind::table,
                                 .columns = density_by_energy,
                                 .needed = "none",
                                 .meaning = "a density by energy in place of mean and deviation",
                                 .source = "reactor model or probe",
                                 .replaces = {"energy", "energy_deviation", "energy_width"}};
const Parameter ion_sticks_to{.name = "ion.sticks_to",
                              .dimension = Dimension::angle,
                              .limits = angles("70 deg"),
                              .meaning = "all stick up to this angle of incidence ...",
                              .source = "Belen et al. 2005"};
const Parameter ion_reflects_from{.name = "ion.reflects_from",
                                  .dimension = Dimension::angle,
                                  .limits = angles("90 deg"),
                                  .meaning = "... and none from this one on, linear in between",
                                  .source = "Belen et al. 2005"};
const Parameter ion_sticking_table{
    .name = "ion.sticking_table",
    .kind = Parameter::Kind::table,
    .columns = sticking_by_angle,
    .needed = "none",
    .meaning = "sticking by angle of incidence in place of these two",
    .source = "experiment or molecular dynamics",
    .replaces = {"sticks_to", "reflects_from"}};
const Parameter ion_cone{.name = "ion.narrowest_at",
                         .dimension = Dimension::angle,
                         .limits = angles("80 deg"),
                         .meaning = "angle from which on the cone of reflection is narrowest",
                         .source = "Belen et al. 2005"};
const Parameter ion_inflection{
    .name = "ion.inflection",
    .dimension = Dimension::angle,
    .limits = {.fallback = "89 deg", .minimum = 0, .maximum = right_angle, .exclusive = true},
    .meaning = "angle where the kept energy goes from power to line",
    .source = "Belen et al. 2005"};
const Parameter ion_energy_power{.name = "ion.energy_power",
                                 .limits = {.fallback = "10", .minimum = 0, .maximum = 100},
                                 .meaning = "power of the kept energy below that angle",
                                 .source = "Belen et al. 2005"};

// For a reader that goes on although the recipe is wrong.
EnergyDistribution stand_in_energy() { return EnergyDistribution::gaussian(100, 10); }

EnergyDistribution read_energy(const RecipeTable& table) {
  const Parameter by_energy = inner(ion_energy_table);
  const Parameter width = inner(ion_energy_width);
  if (stands_in(table, by_energy)) {
    const auto rows = table.number_table(by_energy.name, by_energy.columns);
    if (!rows) return stand_in_energy();
    const auto energy = accepted<EnergyDistribution>(table, by_energy.name, [&] {
      return EnergyDistribution::tabulated(rows->column(0), rows->column(1));
    });
    return energy ? *energy : stand_in_energy();
  }
  const double mean = read_value(table, inner(ion_energy));
  if (!stands_in(table, width))
    return EnergyDistribution::gaussian(mean, read_value(table, inner(ion_energy_deviation)));
  const double distance = read_value(table, width);
  if (distance > 2 * mean) {
    table.error(width.name, "the lower peak lies at a negative energy; at most twice the mean, " +
                                format_quantity(2 * mean, Dimension::energy));
  }
  return EnergyDistribution::bimodal(mean, distance);
}

AngleTable read_sticking(const RecipeTable& table) {
  const Parameter by_angle = inner(ion_sticking_table);
  if (stands_in(table, by_angle)) return read_angle_table(table, by_angle);
  const double sticks_to = read_value(table, inner(ion_sticks_to));
  const double reflects_from = read_value(table, inner(ion_reflects_from));
  if (sticks_to > reflects_from)
    table.error("reflects_from", "has to be at least sticks_to: between them sticking falls");
  return sticking_between(sticks_to, reflects_from);
}

}  // namespace

std::span<const Parameter> ion_parameters() {
  static const std::array rows{
      ion_power,          ion_table,        ion_map,        ion_tilt,
      ion_azimuth,        ion_rotating,     ion_energy,     ion_energy_deviation,
      ion_energy_width,   ion_energy_table, ion_sticks_to,  ion_reflects_from,
      ion_sticking_table, ion_cone,         ion_inflection, ion_energy_power};
  return rows;
}

Species read_ions(const RecipeTable& table, const StepScope& scope) {
  Species species;
  species.sticking.assign(scope.materials.size(), 1.0F);
  species.source = read_source(table, ion_power, scope);
  Ions ions{.energy = read_energy(table), .energy_deviation = 0.1};
  ions.sticking = read_sticking(table);
  ions.cone = reflection_cone(read_value(table, inner(ion_cone)));
  const double inflection = read_value(table, inner(ion_inflection));
  ions.energy_kept = kept_energy(inflection, read_value(table, inner(ion_energy_power)));
  species.ions = std::move(ions);
  return species;
}

void stop_without_yield(Species& ions) {
  double& least = ions.ions->least_energy;
  least = ions.yields.empty() ? 0 : ions.ions->energy.largest();
  for (const YieldLaw& law : ions.yields) least = std::min(least, law.least_energy());
}

AngleTable read_angle_table(const RecipeTable& table, const Parameter& parameter) {
  const auto rows = table.number_table(parameter.name, parameter.columns);
  if (!rows) return {};
  const auto by_angle = accepted<AngleTable>(table, parameter.name, [&] {
    return AngleTable::tabulated(rows->column(0), rows->column(1));
  });
  return by_angle.value_or(AngleTable());
}

AngleTable sputter_factor(double b) {
  return AngleTable([b](double theta) {
    const double c = std::max(0.0, std::cos(theta));
    return c * (1 + b * (1 - c * c));
  });
}

AngleTable enhanced_factor() {
  return AngleTable([](double theta) { return std::clamp(3 - 3 * theta / right_angle, 0.0, 1.0); });
}

}  // namespace scarp
