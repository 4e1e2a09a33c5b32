#include "models/source_parameters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

namespace scarp {

namespace {

constexpr double degree = std::numbers::pi / 180;

constexpr std::array density_by_angle{
    Column{"angle", Dimension::angle, {.minimum = 0, .maximum = 90 * degree}},
    Column{"density", Dimension::number, {.minimum = 0}}};
constexpr Column density{"density", Dimension::number, {.minimum = 0}};
constexpr std::array density_by_place{Column{"x", Dimension::length},
                                      Column{"y", Dimension::length}, density};
constexpr std::array density_by_x{Column{"x", Dimension::length}, density};

// The lines along y of a grid whose rows ascend by x, then by y. Nothing, and an error, where the
// rows of an x do not have the same.
std::optional<std::vector<double>> lines_along_y(const RecipeTable& table, std::string_view key,
                                                 const NumberTable& rows) {
  std::vector<double> y;
  for (const std::vector<double>& row : rows.values)
    if (row[0] == rows.values[0][0]) y.push_back(row[1]);
  if (y.size() < 2) {
    table.row_error(key, rows, 0, "for every x two or more y are wanted");
    return std::nullopt;
  }
  for (std::size_t r = 0; r < rows.values.size(); ++r) {
    const std::vector<double>& row = rows.values[r];
    const bool begins_line = r % y.size() == 0;
    const bool fits = row[1] == y[r % y.size()] &&
                      (begins_line || row[0] == rows.values[r - 1][0]) &&
                      (!begins_line || r == 0 || row[0] != rows.values[r - 1][0]);
    if (fits && (r + 1 < rows.values.size() || (r + 1) % y.size() == 0)) continue;
    table.row_error(key, rows, r, "for every x the same y are wanted, those of the first x");
    return std::nullopt;
  }
  return y;
}

SourceMap read_map(const RecipeTable& table, const StepScope& scope) {
  const std::string_view key = "source_map";
  const bool by_x = scope.frame.is_section();
  const auto rows =
      table.number_table(key, by_x ? std::span<const Column>(density_by_x) : density_by_place);
  if (!rows) return {};
  const auto y = by_x ? std::vector<double>{0} : lines_along_y(table, key, *rows);
  if (!y) return {};
  std::vector<double> x;
  for (std::size_t r = 0; r < rows->values.size(); r += y->size()) x.push_back(rows->values[r][0]);
  const auto map = accepted<SourceMap>(table, key, [&] {
    return SourceMap(x, *y, rows->column(by_x ? 1 : 2), scope.frame.sides());
  });
  return map.value_or(SourceMap());
}

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

Parameter source_map_parameter(std::string_view name) {
  return {.name = name,
          .kind = Parameter::Kind::table,
          .columns = density_by_place,
          .needed = "none",
          .meaning = "a density over the domain: more particles come from here than from there",
          .source = "map of a wafer"};
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
  source.map = read_map(table, scope);
  const Parameter by_angle = source_table_parameter("source_table");
  if (!stands_in(table, by_angle)) {
    source.cosine_power = read_value(table, inner(power));
    return source;
  }
  const auto rows = table.number_table(by_angle.name, by_angle.columns);
  if (!rows) return source;
  const std::vector<double>& last = rows->values.back();
  if (last[0] > 90 * degree * (1 - 1e-9) && last[1] > 0) {
    table.row_error(by_angle.name, *rows, rows->values.size() - 1,
                    "has to be 0 at 90 deg: per area of a vertical wall, particles along the wafer "
                    "would be endlessly many");
  }
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

bool are_mirror_symmetric(std::span<const Species> species, int axis) {
  return std::all_of(species.begin(), species.end(), [axis](const Species& each) {
    return each.source.rotating || std::abs(each.source.direction[axis]) < 1e-9;
  });
}

}  // namespace scarp
