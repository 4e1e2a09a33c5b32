#include "models/source_parameters.h"

#include <array>
#include <numbers>

#include "models/directional.h"

namespace scarp {

namespace {

constexpr double degree = std::numbers::pi / 180;

constexpr std::array density_by_angle{
    Column{"angle", Dimension::angle, {.minimum = 0, .maximum = 90 * degree}},
    Column{"density", Dimension::number, {.minimum = 0}}};

}  // namespace

Parameter source_power_parameter(std::string_view name) {
  return {.name = name,
          .limits = {.fallback = "1", .minimum = 0, .maximum = 1e6},
          .meaning = "n of the source's cos^n(theta)",
          .source = "kinetic theory: 1 for a gas in equilibrium"};
}

Parameter source_table_parameter(std::string_view name) {
  return {.name = name,
          .kind = Parameter::Kind::table,
          .columns = density_by_angle,
          .needed = "none",
          .meaning = "a density by theta in place of cos^n(theta), per solid angle",
          .source = "reactor model or probe",
          .replaces = {"source_power"}};
}

Parameter tilt_parameter(std::string_view name) {
  return {.name = name,
          .dimension = Dimension::angle,
          .limits = {.fallback = "0 deg", .minimum = 0, .maximum = 89 * degree},
          .meaning = "angle of the source's axis to the vertical"};
}

Parameter azimuth_parameter(std::string_view name) {
  return {.name = name,
          .dimension = Dimension::angle,
          .limits = {.fallback = "0 deg"},
          .meaning = "where the axis leans, from x towards y"};
}

Parameter rotating_parameter(std::string_view name) {
  return {.name = name,
          .kind = Parameter::Kind::flag,
          .limits = {.fallback = "false"},
          .meaning = "the wafer turns: particles come from all azimuths"};
}

SourceLobe read_upright_source(const RecipeTable& table, const Parameter& power,
                               const StepScope& scope) {
  SourceLobe source;
  const Parameter by_angle = source_table_parameter("source_table");
  if (!stands_in(table, by_angle)) {
    source.cosine_power = read_value(table, inner(power));
    return source;
  }
  const auto rows = read_table(table, by_angle, scope);
  if (!rows) return source;
  source.table = accepted<PolarDensity>(table, by_angle.name, [&] {
                   return PolarDensity(rows->column(0), rows->column(1));
                 }).value_or(PolarDensity());
  return source;
}

SourceLobe read_source(const RecipeTable& table, const Parameter& power, const StepScope& scope) {
  SourceLobe source = read_upright_source(table, power, scope);
  const double tilt = read_value(table, tilt_parameter("tilt"));
  source.direction = beam_direction(tilt, read_value(table, azimuth_parameter("azimuth")));
  source.rotating = read_flag(table, rotating_parameter("rotating"));
  return source;
}

}  // namespace scarp
